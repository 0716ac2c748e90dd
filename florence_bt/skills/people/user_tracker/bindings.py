"""Bindings of the skills of the user tracker."""

from __future__ import annotations

from typing import Any

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success
from florence_bt.core.serving import ActionBinding, ConditionBinding, ServiceBinding
from florence_bt.core.skill import Inputs

LOOK_CODES_BY_NUMBER = {1: "no_user_seen", 2: "no_image", 3: "user_not_in_view"}
"""error_code of LookForUser -> our code."""


def _lies(inputs: Inputs, message: Any) -> Result:
    return success() if message.data else failure("nobody_lies", "nobody is seen to lie on the floor")


def _switched(message: Any) -> Result:
    return success() if message.success else failure("tracker_failed", message.message or "it answered no")


def _looked(message: Any, outcome: Outcome) -> Result:
    if outcome is Outcome.CANCELLED:
        return cancelled()
    if not message.found:
        code = LOOK_CODES_BY_NUMBER.get(message.error_code, "no_user_seen")
        return failure(code, message.error_msg or "no user seen")
    user = Pose2(message.x, message.y, message.phi)
    return success(
        user=user,
        distance=message.distance,
        user_id=message.user_id,
        posture=message.posture or "unknown",  # a tracker that tells no postures leaves it empty
        height=message.height,
    )


BINDINGS = (
    ServiceBinding(
        skill="start_tracker",
        interface="std_srvs/srv/Trigger",
        name="user_tracker_ni_node/Start",
        result=_switched,
    ),
    ServiceBinding(
        skill="stop_tracker",
        interface="std_srvs/srv/Trigger",
        name="user_tracker_ni_node/Stop",
        result=_switched,
    ),
    ActionBinding(
        skill="look_for_user",
        interface="florence_interfaces/action/LookForUser",
        name="look_for_user",
        request=dict,
        error_codes=LOOK_CODES_BY_NUMBER,
        result=_looked,
        feedback=lambda message: f"looking; people seen so far: {message.users_seen}",
    ),
    ConditionBinding(
        skill="user_lying", interface="std_msgs/msg/Bool", name="user_lying", judge=_lies, max_age_s=2.0
    ),
)
