"""What missions know of navigation, and how it is served."""

from __future__ import annotations

import math
from datetime import timedelta
from functools import partial
from itertools import pairwise
from typing import Any

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, Result, failure, success
from florence_bt.core.serving import ActionBinding, PublicationBinding, ServiceBinding
from florence_bt.core.skill import Inputs
from florence_bt.skills.navigation.navigate.results import (
    APPROACH_FAILURES,
    BACK_UP_CODES_BY_NUMBER,
    DRIVING_GROUPS,
    FOLLOW_FAILURES,
    FRONTIER_FAILURES,
    HEADING_CODES_BY_NUMBER,
    MAP_IS_FIXED,
    NAVIGATE_CODES_BY_NUMBER,
    NAVIGATE_FAILURES,
    NO_POSE,
    OUT_OF_REACH,
    PERSON_GROUPS,
    PLAN_CODES_BY_NUMBER,
    PLAN_FAILURES,
    SEARCH_FAILURES,
    SERVER_CODES,
    SPIN_CODES_BY_NUMBER,
    STRAIGHT_FAILURES,
    THROUGH_CODES_BY_NUMBER,
    TURN_FAILURES,
    result_from_approach,
    result_from_server,
)

SPEED_LIMIT = "navigate/speed_limit"
"""``std_msgs/Float64``: how fast the robot drives at most, m/s; 0 means as fast as it may."""

NOT_OF_NAV2 = frozenset(
    {"follow_user", "search_for_user", "approach_person", "set_speed_limit", "get_frontier"}
)
"""The skills that Nav2 cannot perform."""
ACTIONS_WITHOUT_SKILL = ("follow_path", "wait")
"""For other programs: missions have no paths, and a node of their own that waits."""

_SPEED_LIMITS = {
    "max_lin_speed": Port(
        Kind.SPEED,
        "How fast to drive at most; 0 means as fast as it may.",
        default=0.0,
        minimum=0.0,
        maximum=2.0,
    ),
    "max_ang_speed": Port(
        Kind.NUMBER,
        "How fast to turn at most, rad/s; 0 means 1 rad/s.",
        default=0.0,
        minimum=0.0,
        maximum=3.0,
    ),
}

NAVIGATE_TO = SkillDeclaration(
    name="navigate_to",
    summary="Drive to a pose in the map, around everything that is in the way.",
    inputs={"goal": Port(Kind.POSE, "Where to go, in the map frame.")},
    failures=NAVIGATE_FAILURES,
    groups=DRIVING_GROUPS,
    resources=frozenset({"base"}),
    deadline_s=180.0,
    server_codes=NAVIGATE_CODES_BY_NUMBER,
)

TURN = SkillDeclaration(
    name="turn",
    summary="Turn in place by an angle.",
    inputs={
        "angle": Port(
            Kind.ANGLE,
            "How far, counter-clockwise positive.",
            minimum=-2.0 * math.pi,
            maximum=2.0 * math.pi,
        ),
        "time_allowance": Port(
            Kind.DURATION, "How long the turn may take.", default=10.0, minimum=0.1, maximum=120.0
        ),
    },
    failures=TURN_FAILURES,
    groups=DRIVING_GROUPS,
    resources=frozenset({"base"}),
    deadline_s=30.0,
    server_codes=SPIN_CODES_BY_NUMBER,
)

NAVIGATE_THROUGH = SkillDeclaration(
    name="navigate_through",
    summary="Drive to a pose in the map past another one, without a stop there.",
    inputs={
        "via": Port(Kind.POSE, "Where to pass, within 0.7 m; its heading does not matter."),
        "goal": Port(Kind.POSE, "Where to go, in the map frame."),
    },
    failures=NAVIGATE_FAILURES,
    groups=DRIVING_GROUPS,
    resources=frozenset({"base"}),
    deadline_s=360.0,
    server_codes=THROUGH_CODES_BY_NUMBER,
)

PLAN_TO = SkillDeclaration(
    name="plan_to",
    summary="Find out whether a way leads to a pose now, and how long it is; nothing moves",
    inputs={"goal": Port(Kind.POSE, "Where to, in the map frame.")},
    outputs={"length": Port(Kind.LENGTH, "how long the way is")},
    failures=PLAN_FAILURES,
    groups=DRIVING_GROUPS,
    deadline_s=15.0,
    server_codes=PLAN_CODES_BY_NUMBER,
)

_ALLOWANCE = Port(Kind.DURATION, "How long it may take.", default=20.0, minimum=0.1, maximum=120.0)

BACK_UP = SkillDeclaration(
    name="drive_back",
    summary="Drive straight back by odometry, while nothing is behind the robot",
    inputs={
        "distance": Port(Kind.LENGTH, "How far.", default=0.15, minimum=0.0, maximum=2.0),
        "speed": Port(Kind.SPEED, "How fast.", default=0.1, minimum=0.03, maximum=0.3),
        "time_allowance": _ALLOWANCE,
    },
    failures=STRAIGHT_FAILURES,
    groups=DRIVING_GROUPS,
    resources=frozenset({"base"}),
    deadline_s=130.0,
    server_codes=BACK_UP_CODES_BY_NUMBER,
)

DRIVE_STRAIGHT = SkillDeclaration(
    name="drive_straight",
    summary="Drive straight on by odometry, while nothing is in the way",
    inputs={
        "distance": Port(Kind.LENGTH, "How far; below 0 backwards.", minimum=-10.0, maximum=10.0),
        "speed": Port(Kind.SPEED, "How fast.", default=0.2, minimum=0.03, maximum=0.5),
        "time_allowance": _ALLOWANCE,
    },
    failures=STRAIGHT_FAILURES,
    groups=DRIVING_GROUPS,
    resources=frozenset({"base"}),
    deadline_s=130.0,
    server_codes=HEADING_CODES_BY_NUMBER,
)

CLEAR_COSTMAP = SkillDeclaration(
    name="clear_costmap",
    summary="Forget the obstacles that the sensors have marked in the map; what they see they mark again",
    deadline_s=10.0,
)

FOLLOW_USER = SkillDeclaration(
    name="follow_user",
    summary="Follow a person whom the user tracker sees, around obstacles, until they are lost",
    inputs={
        "user_id": Port(Kind.INTEGER, "The persistent id of the person.", minimum=1),
        "distance": Port(
            Kind.LENGTH, "How far to stay behind; 0 means 1 m.", default=0.0, minimum=0.0, maximum=3.0
        ),
        **_SPEED_LIMITS,
    },
    failures=FOLLOW_FAILURES,
    groups=PERSON_GROUPS,
    resources=frozenset({"base"}),
    deadline_s=3600.0,
    server_codes={SERVER_CODES[code]: code for code in FOLLOW_FAILURES},
)

SEARCH_FOR_USER = SkillDeclaration(
    name="search_for_user",
    summary="Drive to where a person may be whom follow_user has just lost, until they are seen",
    inputs={"user_id": FOLLOW_USER.inputs["user_id"], **_SPEED_LIMITS},
    failures=SEARCH_FAILURES,
    groups=PERSON_GROUPS,
    resources=frozenset({"base"}),
    deadline_s=600.0,
    server_codes={SERVER_CODES[code]: code for code in SEARCH_FAILURES},
)

_AT_THE_PERSON = ("distance", "p2r_orientation", "r2p_orientation")


def _orientation(meaning: str) -> Port:
    return Port(Kind.ANGLE, meaning, default=0.0, minimum=-2.0 * math.pi, maximum=2.0 * math.pi)


APPROACH_PERSON = SkillDeclaration(
    name="approach_person",
    summary="Drive by odometry alone to a place at a person who stands, and turn there",
    inputs={
        "x": Port(Kind.LENGTH, "Where the person is, in front of the robot.", default=0.0),
        "y": Port(Kind.LENGTH, "The same, to its left; both 0: the nearest person in sight.", default=0.0),
        "distance": Port(
            Kind.LENGTH,
            "How far from the person to stand, 0.5 m or more; 0 means 0.8 m.",
            default=0.0,
            minimum=0.0,
            maximum=3.0,
        ),
        "p2r_orientation": _orientation(
            "Where to stand as the person sees it: 0 is where the robot comes from, 90 deg counter-clockwise."
        ),
        "r2p_orientation": _orientation("Where the person is in the end as the robot sees it: 0 is ahead."),
        **_SPEED_LIMITS,
    },
    failures=APPROACH_FAILURES,
    groups=PERSON_GROUPS,
    resources=frozenset({"base"}),
    deadline_s=90.0,
)

SET_SPEED_LIMIT = SkillDeclaration(
    name="set_speed_limit",
    summary="Drive no faster than this from now on, until another limit is set",
    inputs={
        "speed": Port(Kind.SPEED, "How fast at most; 0 takes the limit back.", minimum=0.0, maximum=10.0)
    },
    deadline_s=10.0,
)

GET_FRONTIER = SkillDeclaration(
    name="get_frontier",
    summary="Look up where to look next while the map grows: at known floor beside what nobody has seen yet",
    inputs={
        "number": Port(
            Kind.INTEGER,
            "1 begins anew; each further number leaves aside what the robot has been sent to look at before",
            minimum=1,
        )
    },
    outputs={"pose": Port(Kind.POSE, "where the robot is to stand, towards what is not known")},
    failures=FRONTIER_FAILURES,
    deadline_s=10.0,
)


def _frontier_result(message: Any) -> Result:
    if message.valid:
        return success(pose=Pose2(message.x, message.y, message.phi))
    codes = {NO_POSE: "no_pose", MAP_IS_FIXED: "map_is_fixed"}
    other = "out_of_reach" if message.message.startswith(OUT_OF_REACH) else "nothing_left"
    return failure(codes.get(message.message, other), message.message)


def _plan_result(message: Any, outcome: Outcome) -> Result:
    result = result_from_server(PLAN_TO, "no_path", message, outcome)
    if not result.succeeded:
        return result
    places = [(pose.pose.position.x, pose.pose.position.y) for pose in message.path.poses]
    return success(length=sum(math.dist(one, two) for one, two in pairwise(places)))


def _straight_request(distance: float, inputs: Inputs) -> dict[str, Any]:
    return {
        "target": (distance, 0.0, 0.0),
        "speed": math.copysign(inputs["speed"], distance),
        "time_allowance": timedelta(seconds=inputs["time_allowance"]),
    }


def _driving(message: Any) -> str:
    """Say where the robot drives, not how far: a countdown would make every feedback look like a change."""
    recoveries = message.number_of_recoveries
    return "driving" if recoveries == 0 else f"driving, {recoveries} recoveries so far"


BINDINGS = (
    ActionBinding(
        skill=NAVIGATE_TO,
        interface="nav2_msgs/action/NavigateToPose",
        name="navigate_to_pose",
        request=lambda inputs: {"pose": inputs["goal"]},
        result=partial(result_from_server, NAVIGATE_TO, "blocked"),
        feedback=_driving,
        component="base",
        start_in_rig=lambda base, inputs: base.navigate(inputs["goal"]),
    ),
    ActionBinding(
        skill=TURN,
        interface="nav2_msgs/action/Spin",
        name="spin",
        request=lambda inputs: {
            "target_yaw": float(inputs["angle"]),
            "time_allowance": timedelta(seconds=inputs["time_allowance"]),
        },
        result=partial(result_from_server, TURN, "turn_failed"),
        feedback=lambda message: "turning",
        component="base",
        start_in_rig=lambda base, inputs: base.turn(float(inputs["angle"]), inputs["time_allowance"]),
    ),
    ActionBinding(
        skill=NAVIGATE_THROUGH,
        interface="nav2_msgs/action/NavigateThroughPoses",
        name="navigate_through_poses",
        request=lambda inputs: {"poses": [inputs["via"], inputs["goal"]]},
        result=partial(result_from_server, NAVIGATE_THROUGH, "blocked"),
        feedback=_driving,
        component="base",
        start_in_rig=lambda base, inputs: base.navigate_through([inputs["via"], inputs["goal"]]),
    ),
    ActionBinding(
        skill=PLAN_TO,
        interface="nav2_msgs/action/ComputePathToPose",
        name="compute_path_to_pose",
        request=lambda inputs: {"goal": inputs["goal"]},
        result=_plan_result,
        feedback=lambda message: "planning",
        component="base",
        start_in_rig=lambda base, inputs: base.plan(inputs["goal"]),
    ),
    ActionBinding(
        skill=BACK_UP,
        interface="nav2_msgs/action/BackUp",
        name="backup",
        request=lambda inputs: _straight_request(inputs["distance"], inputs),
        result=partial(result_from_server, BACK_UP, "drive_failed"),
        feedback=lambda message: "backing up",
        component="base",
        start_in_rig=lambda base, inputs: base.drive_straight(
            -inputs["distance"], inputs["speed"], inputs["time_allowance"]
        ),
    ),
    ActionBinding(
        skill=DRIVE_STRAIGHT,
        interface="nav2_msgs/action/DriveOnHeading",
        name="drive_on_heading",
        request=lambda inputs: _straight_request(inputs["distance"], inputs),
        result=partial(result_from_server, DRIVE_STRAIGHT, "drive_failed"),
        feedback=lambda message: "driving straight on",
        component="base",
        start_in_rig=lambda base, inputs: base.drive_straight(**inputs),
    ),
    ServiceBinding(
        skill=CLEAR_COSTMAP,
        interface="nav2_msgs/srv/ClearEntireCostmap",
        name="global_costmap/clear_entirely_global_costmap",
        result=lambda response: success(),
        component="base",
        start_in_rig=lambda base, inputs: base.clear_costmap(),
    ),
    ActionBinding(
        skill=FOLLOW_USER,
        interface="florence_interfaces/action/FollowUser",
        name="follow_user",
        request=lambda inputs: {
            "user_id": inputs["user_id"],
            **{name: float(inputs[name]) for name in ("distance", *_SPEED_LIMITS)},
        },
        result=partial(result_from_server, FOLLOW_USER, "blocked"),
        feedback=lambda message: message.text,
        component="base",
        start_in_rig=lambda base, inputs: base.follow(**inputs),
    ),
    ActionBinding(
        skill=SEARCH_FOR_USER,
        interface="florence_interfaces/action/FollowUser",
        name="search_for_user",
        request=lambda inputs: {
            "user_id": inputs["user_id"],
            **{name: float(inputs[name]) for name in _SPEED_LIMITS},
        },
        result=partial(result_from_server, SEARCH_FOR_USER, "user_lost"),
        feedback=lambda message: message.text,
        component="base",
        start_in_rig=lambda base, inputs: base.search(**inputs),
    ),
    ActionBinding(
        skill=APPROACH_PERSON,
        interface="florence_interfaces/action/ApproachMe",
        name="approach_person",
        request=lambda inputs: {
            **{f"desired_{name}": float(inputs[name]) for name in _AT_THE_PERSON},
            **{name: float(inputs[name]) for name in ("x", "y", *_SPEED_LIMITS)},
        },
        result=lambda message, outcome: result_from_approach(outcome, message.code, message.reason),
        feedback=lambda message: "approaching the person",
        component="base",
        start_in_rig=lambda base, inputs: base.approach(**inputs),
    ),
    ServiceBinding(
        skill=GET_FRONTIER,
        interface="florence_interfaces/srv/GetView",
        name="navigate/get_frontier",
        request=lambda inputs: {"number": inputs["number"]},
        result=_frontier_result,
        component="base",
        start_in_rig=lambda base, inputs: base.get_frontier(inputs["number"]),
    ),
    PublicationBinding(
        skill=SET_SPEED_LIMIT,
        interface="std_msgs/msg/Float64",
        name=SPEED_LIMIT,
        message=lambda inputs: {"data": float(inputs["speed"])},
    ),
)
