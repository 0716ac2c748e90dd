"""Bindings of the skills of navigation."""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise
from typing import Any

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, Result, failure, success
from florence_bt.core.serving import ActionBinding, PublicationBinding, ServiceBinding
from florence_bt.core.skill import Inputs
from florence_bt.skills.navigation.navigate.results import (
    BACK_UP_CODES_BY_NUMBER,
    FOLLOW_CODES_BY_NUMBER,
    HEADING_CODES_BY_NUMBER,
    MAP_IS_FIXED,
    NAVIGATE_CODES_BY_NUMBER,
    NO_POSE,
    OUT_OF_REACH,
    PLAN_CODES_BY_NUMBER,
    SEARCH_CODES_BY_NUMBER,
    SPIN_CODES_BY_NUMBER,
    THROUGH_CODES_BY_NUMBER,
    result_from_approach,
    result_from_server,
)

SPEED_LIMIT = "navigate/speed_limit"
"""``std_msgs/Float64``: how fast the robot drives at most, m/s; 0 means as fast as it may."""

PRECISE = "precise"
"""``behavior_tree`` of a goal of NavigateToPose whose end is to be corrected: no other field of it is free.
Nav2, which takes the name for that of a file, refuses the goal."""
NOT_OF_NAV2 = frozenset(
    {"follow_user", "search_for_user", "approach_person", "set_speed_limit", "get_frontier"}
)
"""The skills that Nav2 cannot perform."""
ACTIONS_WITHOUT_SKILL = ("follow_path", "wait")
"""For other programs: missions have no paths, and a node of their own that waits."""

_AT_THE_PERSON = ("distance", "p2r_orientation", "r2p_orientation")


def _frontier_result(message: Any) -> Result:
    if message.valid:
        return success(pose=Pose2(message.x, message.y, message.phi))
    codes = {NO_POSE: "no_pose", MAP_IS_FIXED: "map_is_fixed"}
    other = "out_of_reach" if message.message.startswith(OUT_OF_REACH) else "nothing_left"
    return failure(codes.get(message.message, other), message.message)


def _plan_result(message: Any, outcome: Outcome) -> Result:
    result = result_from_server("plan_to", PLAN_CODES_BY_NUMBER, "no_path", message, outcome)
    if not result.succeeded:
        return result
    places = [(pose.pose.position.x, pose.pose.position.y) for pose in message.path.poses]
    return success(length=sum(math.dist(one, two) for one, two in pairwise(places)))


def _straight_request(distance: float, inputs: Inputs) -> dict[str, Any]:
    return {
        "target.x": distance,
        "speed": math.copysign(inputs["speed"], distance),
        "time_allowance": inputs["time_allowance"],
    }


def _driving(message: Any) -> str:
    """Say where the robot drives, not how far: a countdown would make every feedback look like a change."""
    recoveries = message.number_of_recoveries
    return "driving" if recoveries == 0 else f"driving, {recoveries} recoveries so far"


BINDINGS = (
    ActionBinding(
        skill="navigate_to",
        interface="nav2_msgs/action/NavigateToPose",
        name="navigate_to_pose",
        request=lambda inputs: {
            "pose": inputs["goal"],
            "behavior_tree": PRECISE if inputs.get("precise", False) else "",
        },
        error_codes=NAVIGATE_CODES_BY_NUMBER,
        result=partial(result_from_server, "navigate_to", NAVIGATE_CODES_BY_NUMBER, "blocked"),
        feedback=_driving,
    ),
    ActionBinding(
        skill="turn",
        interface="nav2_msgs/action/Spin",
        name="spin",
        request=lambda inputs: {"target_yaw": inputs["angle"], "time_allowance": inputs["time_allowance"]},
        error_codes=SPIN_CODES_BY_NUMBER,
        result=partial(result_from_server, "turn", SPIN_CODES_BY_NUMBER, "turn_failed"),
        feedback=lambda message: "turning",
    ),
    ActionBinding(
        skill="navigate_through",
        interface="nav2_msgs/action/NavigateThroughPoses",
        name="navigate_through_poses",
        request=lambda inputs: {"poses": [inputs["via"], inputs["goal"]]},
        error_codes=THROUGH_CODES_BY_NUMBER,
        result=partial(result_from_server, "navigate_through", THROUGH_CODES_BY_NUMBER, "blocked"),
        feedback=_driving,
    ),
    ActionBinding(
        skill="plan_to",
        interface="nav2_msgs/action/ComputePathToPose",
        name="compute_path_to_pose",
        request=dict,
        error_codes=PLAN_CODES_BY_NUMBER,
        result=_plan_result,
        feedback=lambda message: "planning",
    ),
    ActionBinding(
        skill="drive_back",
        interface="nav2_msgs/action/BackUp",
        name="backup",
        request=lambda inputs: _straight_request(inputs["distance"], inputs),
        error_codes=BACK_UP_CODES_BY_NUMBER,
        result=partial(result_from_server, "drive_back", BACK_UP_CODES_BY_NUMBER, "drive_failed"),
        feedback=lambda message: "backing up",
    ),
    ActionBinding(
        skill="drive_straight",
        interface="nav2_msgs/action/DriveOnHeading",
        name="drive_on_heading",
        request=lambda inputs: _straight_request(inputs["distance"], inputs),
        error_codes=HEADING_CODES_BY_NUMBER,
        result=partial(result_from_server, "drive_straight", HEADING_CODES_BY_NUMBER, "drive_failed"),
        feedback=lambda message: "driving straight on",
    ),
    ServiceBinding(
        skill="clear_costmap",
        interface="nav2_msgs/srv/ClearEntireCostmap",
        name="global_costmap/clear_entirely_global_costmap",
        result=lambda response: success(),
    ),
    ActionBinding(
        skill="follow_user",
        interface="florence_interfaces/action/FollowUser",
        name="follow_user",
        request=dict,
        error_codes=FOLLOW_CODES_BY_NUMBER,
        result=partial(result_from_server, "follow_user", FOLLOW_CODES_BY_NUMBER, "blocked"),
        feedback=lambda message: message.text,
    ),
    ActionBinding(
        skill="search_for_user",
        interface="florence_interfaces/action/FollowUser",
        name="search_for_user",
        request=dict,
        error_codes=SEARCH_CODES_BY_NUMBER,
        result=partial(result_from_server, "search_for_user", SEARCH_CODES_BY_NUMBER, "user_lost"),
        feedback=lambda message: message.text,
    ),
    ActionBinding(
        skill="approach_person",
        interface="florence_interfaces/action/ApproachMe",
        name="approach_person",
        request=lambda inputs: {
            f"desired_{name}" if name in _AT_THE_PERSON else name: value for name, value in inputs.items()
        },
        result=lambda message, outcome: result_from_approach(outcome, message.code, message.reason),
        feedback=lambda message: "approaching the person",
    ),
    ServiceBinding(
        skill="get_frontier",
        interface="florence_interfaces/srv/GetFrontier",
        name="navigate/get_frontier",
        request=dict,
        result=_frontier_result,
    ),
    PublicationBinding(
        skill="set_speed_limit",
        interface="std_msgs/msg/Float64",
        name=SPEED_LIMIT,
        message=lambda inputs: {"data": float(inputs["speed"])},
    ),
)
