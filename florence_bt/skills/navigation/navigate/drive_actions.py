"""The actions that drive the robot, as one table: how each goal is begun, and which numbers its ends have.

Source: REFERENCE 7.9 (Nav2), 12.6 and 12.7.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from florence_bt.core.geometry import FramedPose, Point3, Pose2
from florence_bt.core.outcome import Result, failure
from florence_bt.core.ports import Action
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

ToMap = Callable[[FramedPose], Pose2 | Result]
"""Takes a pose to the map frame, or says why that cannot be done."""
Begin = Callable[[Navigator, Any, float, ToMap], Result | None]
"""Given the navigator, the goal, the time and ``ToMap``: begins the goal, or says why it ends."""


@dataclass(frozen=True, slots=True, eq=False)
class DriveAction:
    """One action.

    Attributes:
        port: Its name, type and goals.
        begin: Begins a goal.
        codes: Our code -> ``error_code``.
        unknown: The ``error_code`` of what the table does not have.
        every_cycle: Whether feedback comes in every cycle, not twice a second.
    """

    port: Action
    begin: Begin
    codes: Mapping[str, int]
    unknown: int
    every_cycle: bool = False

    def number(self, result: Result) -> int:
        """Return the ``error_code`` of a result."""
        return self.codes.get(result.code, self.unknown)


# Goals, with the fields of their interfaces; durations in seconds, metres, radians.


@dataclass(frozen=True, slots=True)
class PoseGoal:
    """``nav2_msgs/NavigateToPose``."""

    pose: FramedPose
    behavior_tree: str = ""


@dataclass(frozen=True, slots=True)
class PosesGoal:
    """``nav2_msgs/NavigateThroughPoses``."""

    poses: tuple[FramedPose, ...]


@dataclass(frozen=True, slots=True)
class PathGoal:
    """``nav2_msgs/FollowPath``."""

    path: tuple[FramedPose, ...]


@dataclass(frozen=True, slots=True)
class SpinGoal:
    """``nav2_msgs/Spin``."""

    target_yaw: float
    time_allowance: float = 0.0


@dataclass(frozen=True, slots=True)
class StraightGoal:
    """``nav2_msgs/BackUp`` and ``nav2_msgs/DriveOnHeading``."""

    target: Point3
    speed: float
    time_allowance: float = 0.0


@dataclass(frozen=True, slots=True)
class WaitGoal:
    """``nav2_msgs/Wait``."""

    time: float


@dataclass(frozen=True, slots=True)
class FollowGoal:
    """``florence_interfaces/FollowUser``."""

    user_id: int
    distance: float = 0.0
    max_lin_speed: float = 0.0
    max_ang_speed: float = 0.0


@dataclass(frozen=True, slots=True)
class ApproachGoal:
    """``florence_interfaces/ApproachMe``."""

    x: float
    y: float
    desired_distance: float
    desired_p2r_orientation: float
    desired_r2p_orientation: float
    max_lin_speed: float = 0.0
    max_ang_speed: float = 0.0


def _in_map(poses: Iterable[FramedPose], to_map: ToMap) -> list[Pose2] | Result:
    found = []
    for pose in poses:
        one = to_map(pose)
        if isinstance(one, Result):
            return one
        found.append(one)
    return found


def _to_pose(navigator: Navigator, goal: PoseGoal, now: float, to_map: ToMap) -> Result | None:
    pose = to_map(goal.pose)
    if isinstance(pose, Result):
        return pose
    navigator.start(pose, now, precise=goal.behavior_tree == PRECISE)
    return None


def _through(navigator: Navigator, goal: PosesGoal, now: float, to_map: ToMap) -> Result | None:
    poses = _in_map(goal.poses, to_map)
    if isinstance(poses, Result):
        return poses
    navigator.start_through(poses, now)
    return None


def _path(navigator: Navigator, goal: PathGoal, now: float, to_map: ToMap) -> Result | None:
    poses = _in_map(goal.path, to_map)
    if isinstance(poses, Result):
        return poses
    navigator.start_path(poses, now)
    return None


def _spin(navigator: Navigator, goal: SpinGoal, now: float, to_map: ToMap) -> None:
    navigator.start_spin(goal.target_yaw, now, goal.time_allowance)


def _only_in_x(goal: StraightGoal) -> Result | None:
    if goal.target.y == 0.0 and goal.target.z == 0.0:
        return None
    return failure(
        "bad_input", f"the robot cannot drive by y = {goal.target.y:g} and z = {goal.target.z:g} m"
    )


def _back_up(navigator: Navigator, goal: StraightGoal, now: float, to_map: ToMap) -> Result | None:
    problem = _only_in_x(goal)
    if problem is None:
        navigator.start_straight(-abs(goal.target.x), abs(goal.speed), now, goal.time_allowance)
    return problem


def _heading(navigator: Navigator, goal: StraightGoal, now: float, to_map: ToMap) -> Result | None:
    problem = _only_in_x(goal)
    if problem is None and goal.target.x * goal.speed < 0.0:
        problem = failure(
            "bad_input",
            f"{goal.target.x:g} m and the speed of {goal.speed:g} m/s have opposite signs",
        )
    if problem is None:
        navigator.start_straight(goal.target.x, abs(goal.speed), now, goal.time_allowance)
    return problem


def _wait(navigator: Navigator, goal: WaitGoal, now: float, to_map: ToMap) -> None:
    navigator.start_wait(goal.time, now)


def _follow(navigator: Navigator, goal: FollowGoal, now: float, to_map: ToMap) -> None:
    navigator.start_follow(now, goal.user_id, goal.distance, goal.max_lin_speed, goal.max_ang_speed)


def _search(navigator: Navigator, goal: FollowGoal, now: float, to_map: ToMap) -> None:
    navigator.start_search(now, goal.user_id, goal.max_lin_speed, goal.max_ang_speed)


def _approach(navigator: Navigator, goal: ApproachGoal, now: float, to_map: ToMap) -> None:
    orientations = goal.desired_p2r_orientation, goal.desired_r2p_orientation
    speeds = goal.max_lin_speed, goal.max_ang_speed
    navigator.start_approach(now, (goal.x, goal.y), goal.desired_distance, orientations, *speeds)


def _nav2(
    kind: str,
    name: str,
    goal: type,
    begin: Begin,
    codes: Mapping[str, int],
    unknown: int,
) -> DriveAction:
    port = Action(name, f"nav2_msgs/action/{kind}", goal, codes["bad_input"])
    return DriveAction(port, begin, codes, unknown)


def _florence(kind: str, name: str, goal: type, begin: Begin) -> DriveAction:
    """Make one whose feedback comes in every cycle: document, sections 4.1 and 4.3."""
    port = Action(name, f"florence_interfaces/action/{kind}", goal, SERVER_CODES["bad_input"])
    return DriveAction(port, begin, SERVER_CODES, 100, every_cycle=True)


NAVIGATE_TO_POSE = _nav2("NavigateToPose", "navigate_to_pose", PoseGoal, _to_pose, SERVER_CODES, 100)
DRIVE_ACTIONS = (
    NAVIGATE_TO_POSE,
    _nav2("NavigateThroughPoses", "navigate_through_poses", PosesGoal, _through, THROUGH_SERVER_CODES, 100),
    _nav2("FollowPath", "follow_path", PathGoal, _path, PATH_SERVER_CODES, 100),
    _nav2("Spin", "spin", SpinGoal, _spin, SPIN_SERVER_CODES, 700),
    _nav2("BackUp", "backup", StraightGoal, _back_up, BACK_UP_SERVER_CODES, 710),
    _nav2("DriveOnHeading", "drive_on_heading", StraightGoal, _heading, HEADING_SERVER_CODES, 720),
    _nav2("Wait", "wait", WaitGoal, _wait, WAIT_SERVER_CODES, 740),
    _florence("FollowUser", "follow_user", FollowGoal, _follow),
    _florence("FollowUser", "search_for_user", FollowGoal, _search),
    _florence("ApproachMe", "approach_person", ApproachGoal, _approach),
)
"""They share the base: a goal of one takes it from the goal of another."""
