"""Bindings of the skills of the base beside driving."""

from __future__ import annotations

from typing import Any

from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.serving import ConditionBinding
from florence_bt.core.skill import Inputs
from florence_bt.core.topic_names import BATTERY_STATE

MOST_CHARGE = 1.1
"""Of the full charge; what says more measures something else, or wrongly."""


def _judge_battery(inputs: Inputs, message: Any) -> Result:
    charge = message.percentage
    if not 0.0 <= charge <= MOST_CHARGE:
        return failure("battery_low", "the charge of the battery is not known, which counts as low")
    if charge > inputs["charge"]:
        return success()
    return failure("battery_low", f"the battery holds {charge:.0%} of its full charge")


BINDINGS = (
    ConditionBinding(
        skill="battery_above",
        interface="sensor_msgs/msg/BatteryState",
        name=BATTERY_STATE,
        judge=_judge_battery,
        max_age_s=10.0,
    ),
)
