"""What missions may ask of the base beside driving, and how it is served."""

from __future__ import annotations

from typing import Any

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.serving import ConditionBinding
from florence_bt.core.skill import Inputs

BATTERY_ABOVE = SkillDeclaration(
    name="battery_above",
    summary="Check that the battery of the base holds more than a part of its full charge",
    inputs={
        "charge": Port(Kind.NUMBER, "the part of the full charge", default=0.2, minimum=0.0, maximum=1.0),
    },
    failures={"battery_low": "the battery holds no more than that"},
    deadline_s=5.0,
    instant=True,
    reports_changes=True,
)


def _judge_battery(inputs: Inputs, message: Any) -> Result:
    charge = message.percentage
    if not 0.0 <= charge <= 1.0:
        raise ValueError(f"the charge is {charge}, not a part of the full charge")
    if charge > inputs["charge"]:
        return success()
    return failure("battery_low", f"the battery holds {charge:.0%} of its full charge")


BINDINGS = (
    ConditionBinding(
        skill=BATTERY_ABOVE,
        interface="sensor_msgs/msg/BatteryState",
        name="battery_state",
        judge=_judge_battery,
        max_age_s=10.0,
    ),
)
