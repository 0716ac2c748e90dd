"""The actions of the node ``navigate``: how each goal is begun, and which numbers its ends have.

Their messages are filled by the names of their fields: what a type has a field for, it is told.

Source: REFERENCE 7.9 (Nav2), 12.6 and 12.7.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from florence_interfaces.action import ApproachMe, FollowUser
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import (
    BackUp,
    DriveOnHeading,
    FollowPath,
    NavigateThroughPoses,
    NavigateToPose,
    Spin,
    Wait,
)
from nav_msgs.msg import Path

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure
from florence_bt.ros.conversions import duration_from_ros
from florence_bt.skills.navigation.navigate.bindings import PRECISE
from florence_bt.skills.navigation.navigate.navigator import Navigator
from florence_bt.skills.navigation.navigate.results import (
    BACK_UP_SERVER_CODES,
    HEADING_SERVER_CODES,
    PATH_SERVER_CODES,
    SERVER_CODES,
    SPIN_SERVER_CODES,
    THROUGH_SERVER_CODES,
    WAIT_SERVER_CODES,
)

ToMap = Callable[[PoseStamped], Pose2 | Result]
"""Takes a pose to the map frame, or says why that cannot be done."""
Begin = Callable[[Navigator, Any, float, ToMap], Result | None]
"""Given the navigator, the goal message, the time and ``ToMap``: begins the goal, or says why it ends."""


@dataclass(frozen=True, slots=True, eq=False)
class GoalAction:
    """One action.

    Attributes:
        interface: Its type.
        name: Its name.
        begin: Begins a goal.
        codes: Our code -> ``error_code``.
        unknown: The ``error_code`` of what the table does not have.
        every_cycle: Whether feedback comes in every cycle, not twice a second.
    """

    interface: Any
    name: str
    begin: Begin
    codes: Mapping[str, int]
    unknown: int
    every_cycle: bool = False

    def number(self, result: Result) -> int:
        """Return the ``error_code`` of a result."""
        return self.codes.get(result.code, self.unknown)


def filled(message_type: Any, facts: Mapping[str, Any]) -> Any:
    """Make a message with the facts that it has fields for."""
    names = message_type.get_fields_and_field_types()
    return message_type(**{name: value for name, value in facts.items() if name in names})


def _in_map(poses: Iterable[PoseStamped], to_map: ToMap) -> list[Pose2] | Result:
    found = []
    for pose in poses:
        one = to_map(pose)
        if isinstance(one, Result):
            return one
        found.append(one)
    return found


def poses_of_path(path: Path) -> Iterable[PoseStamped]:
    """Yield the poses of a path; those without a frame are in the frame of the path."""
    for pose in path.poses:
        frame = pose.header.frame_id or path.header.frame_id
        yield PoseStamped(header=type(pose.header)(frame_id=frame), pose=pose.pose)


def _to_pose(navigator: Navigator, goal: NavigateToPose.Goal, now: float, to_map: ToMap) -> Result | None:
    pose = to_map(goal.pose)
    if isinstance(pose, Result):
        return pose
    navigator.start(pose, now, precise=goal.behavior_tree == PRECISE)
    return None


def _through(
    navigator: Navigator, goal: NavigateThroughPoses.Goal, now: float, to_map: ToMap
) -> Result | None:
    poses = _in_map(goal.poses, to_map)
    if isinstance(poses, Result):
        return poses
    navigator.start_through(poses, now)
    return None


def _path(navigator: Navigator, goal: FollowPath.Goal, now: float, to_map: ToMap) -> Result | None:
    poses = _in_map(poses_of_path(goal.path), to_map)
    if isinstance(poses, Result):
        return poses
    navigator.start_path(poses, now)
    return None


def _spin(navigator: Navigator, goal: Spin.Goal, now: float, to_map: ToMap) -> None:
    navigator.start_spin(float(goal.target_yaw), now, duration_from_ros(goal.time_allowance))


def _only_in_x(goal: Any) -> Result | None:
    if goal.target.y == 0.0 and goal.target.z == 0.0:
        return None
    return failure(
        "bad_input", f"the robot cannot drive by y = {goal.target.y:g} and z = {goal.target.z:g} m"
    )


def _back_up(navigator: Navigator, goal: BackUp.Goal, now: float, to_map: ToMap) -> Result | None:
    problem = _only_in_x(goal)
    if problem is None:
        allowance = duration_from_ros(goal.time_allowance)
        navigator.start_straight(-abs(goal.target.x), abs(float(goal.speed)), now, allowance)
    return problem


def _heading(navigator: Navigator, goal: DriveOnHeading.Goal, now: float, to_map: ToMap) -> Result | None:
    problem = _only_in_x(goal)
    if problem is None and goal.target.x * goal.speed < 0.0:
        problem = failure(
            "bad_input",
            f"{goal.target.x:g} m and the speed of {goal.speed:g} m/s have opposite signs",
        )
    if problem is None:
        allowance = duration_from_ros(goal.time_allowance)
        navigator.start_straight(float(goal.target.x), abs(float(goal.speed)), now, allowance)
    return problem


def _wait(navigator: Navigator, goal: Wait.Goal, now: float, to_map: ToMap) -> None:
    navigator.start_wait(duration_from_ros(goal.time), now)


def _follow(navigator: Navigator, goal: FollowUser.Goal, now: float, to_map: ToMap) -> None:
    numbers = goal.distance, goal.max_lin_speed, goal.max_ang_speed
    navigator.start_follow(now, goal.user_id, *map(float, numbers))


def _search(navigator: Navigator, goal: FollowUser.Goal, now: float, to_map: ToMap) -> None:
    navigator.start_search(now, goal.user_id, float(goal.max_lin_speed), float(goal.max_ang_speed))


def _approach(navigator: Navigator, goal: ApproachMe.Goal, now: float, to_map: ToMap) -> None:
    navigator.start_approach(
        now,
        (float(goal.x), float(goal.y)),
        float(goal.desired_distance),
        (float(goal.desired_p2r_orientation), float(goal.desired_r2p_orientation)),
        float(goal.max_lin_speed),
        float(goal.max_ang_speed),
    )


NAVIGATE_TO_POSE = GoalAction(NavigateToPose, "navigate_to_pose", _to_pose, SERVER_CODES, 100)
GOAL_ACTIONS = (
    NAVIGATE_TO_POSE,
    GoalAction(NavigateThroughPoses, "navigate_through_poses", _through, THROUGH_SERVER_CODES, 100),
    GoalAction(FollowPath, "follow_path", _path, PATH_SERVER_CODES, 100),
    GoalAction(Spin, "spin", _spin, SPIN_SERVER_CODES, 700),
    GoalAction(BackUp, "backup", _back_up, BACK_UP_SERVER_CODES, 710),
    GoalAction(DriveOnHeading, "drive_on_heading", _heading, HEADING_SERVER_CODES, 720),
    GoalAction(Wait, "wait", _wait, WAIT_SERVER_CODES, 740),
    # In every cycle: document, sections 4.1 and 4.3.
    GoalAction(FollowUser, "follow_user", _follow, SERVER_CODES, 100, every_cycle=True),
    GoalAction(FollowUser, "search_for_user", _search, SERVER_CODES, 100, every_cycle=True),
    GoalAction(ApproachMe, "approach_person", _approach, SERVER_CODES, 100, every_cycle=True),
)
"""They share the base: a goal of one takes it from the goal of another."""
