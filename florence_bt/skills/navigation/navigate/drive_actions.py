"""The actions that drive the robot, as one table: what each goal makes, and which numbers its ends have.

Source: REFERENCE 7.9 (Nav2), 12.6 and 12.7.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from florence_bt.core.geometry import FramedPose, Point3, Pose2
from florence_bt.core.outcome import Result, failure
from florence_bt.core.ports import Action
from florence_bt.skills.navigation.navigate.approach import Approach, ApproachGoal
from florence_bt.skills.navigation.navigate.bindings import PRECISE
from florence_bt.skills.navigation.navigate.drive import Drive
from florence_bt.skills.navigation.navigate.follow import Follow
from florence_bt.skills.navigation.navigate.following.motions import FollowGoal
from florence_bt.skills.navigation.navigate.following.person_goal import PersonGoal
from florence_bt.skills.navigation.navigate.goal_start import GoalStart, ToMap
from florence_bt.skills.navigation.navigate.path_drive import PathDrive
from florence_bt.skills.navigation.navigate.personal_space import NEAREST_M
from florence_bt.skills.navigation.navigate.results import (
    BACK_UP_SERVER_CODES,
    HEADING_SERVER_CODES,
    PATH_SERVER_CODES,
    SERVER_CODES,
    SPIN_SERVER_CODES,
    THROUGH_SERVER_CODES,
    WAIT_SERVER_CODES,
)
from florence_bt.skills.navigation.navigate.search import Search
from florence_bt.skills.navigation.navigate.spin import Spin
from florence_bt.skills.navigation.navigate.straight import SLOWEST_MPS, StraightDrive, WaitInPlace
from florence_bt.skills.navigation.navigate.through import ThroughDrive


@dataclass(frozen=True, slots=True, eq=False)
class DriveAction:
    """One action.

    Attributes:
        port: Its name, type and goals.
        codes: Our code -> ``error_code``.
        unknown: The ``error_code`` of what the table does not have.
        every_cycle: Whether feedback comes in every cycle, not twice a second.
    """

    port: Action
    codes: Mapping[str, int]
    unknown: int
    every_cycle: bool = False

    def number(self, result: Result) -> int:
        """Return the ``error_code`` of a result."""
        return self.codes.get(result.code, self.unknown)


# Goals, with the fields of their interfaces (s, m, rad). Each makes what is driven.


@dataclass(frozen=True, slots=True)
class PoseGoal:
    """``nav2_msgs/NavigateToPose``."""

    pose: FramedPose
    behavior_tree: str = ""

    def begin(self, start: GoalStart) -> Drive | Result:
        """Drive there; correct where the drive ends when asked to (:mod:`fine_approach`)."""
        goal = start.to_map(self.pose)
        if isinstance(goal, Result):
            return goal
        problem = start.costmaps.problem_with(goal)
        if problem is not None:
            return failure(*problem)
        precise = self.behavior_tree == PRECISE
        return Drive(goal, start.costmaps, start.parameters, start.now, precise=precise)


@dataclass(frozen=True, slots=True)
class PosesGoal:
    """``nav2_msgs/NavigateThroughPoses``."""

    poses: Sequence[FramedPose]

    def begin(self, start: GoalStart) -> ThroughDrive | Result:
        """Drive to the last pose, past the others."""
        poses = _in_map(self.poses, start.to_map)
        if isinstance(poses, Result):
            return poses
        if not poses:
            return failure("no_poses", "no pose is given (would have worked: one or more)")
        for number, pose in enumerate(poses, start=1):
            problem = start.costmaps.problem_with(pose)
            if problem is not None:
                return failure(problem[0], f"pose {number} of {len(poses)}: {problem[1]}")
        return ThroughDrive(poses, start.costmaps, start.parameters, start.now)


@dataclass(frozen=True, slots=True)
class PathGoal:
    """``nav2_msgs/FollowPath``: from the robot to the goal, whose heading counts."""

    path: Sequence[FramedPose]

    def begin(self, start: GoalStart) -> PathDrive | Result:
        """Drive along the path, as it is."""
        path = _in_map(self.path, start.to_map)
        if isinstance(path, Result):
            return path
        if not path or not all(pose.is_finite() for pose in path):
            text = f"a path of {len(path)} poses cannot be driven (would have worked: finite poses)"
            return failure("bad_input", text)
        points = np.array([(pose.x, pose.y) for pose in path])
        return PathDrive(points, path[-1], start.costmaps, start.parameters, start.now)


@dataclass(frozen=True, slots=True)
class SpinGoal:
    """``nav2_msgs/Spin``: relative to the heading at the first step; an allowance of 0 is no limit."""

    target_yaw: float
    time_allowance: float = 0.0

    def begin(self, start: GoalStart) -> Spin | Result:
        """Turn in place."""
        angle, allowance = self.target_yaw, self.time_allowance
        if not math.isfinite(angle) or not math.isfinite(allowance):
            return failure("bad_input", f"a turn by {angle} rad in {allowance} s cannot be done")
        return Spin(angle, start.parameters.turn, start.now, allowance)


@dataclass(frozen=True, slots=True)
class HeadingGoal:
    """``nav2_msgs/DriveOnHeading``; an allowance of 0 is no limit."""

    target: Point3
    speed: float
    time_allowance: float = 0.0

    def begin(self, start: GoalStart) -> StraightDrive | Result:
        """Drive straight on by odometry, back when both are below zero."""
        distance, speed = self.target.x, self.speed
        if distance * speed < 0.0:
            text = f"{distance:g} m and the speed of {speed:g} m/s have opposite signs"
            return failure("bad_input", text)
        return self._straight(distance, start)

    def _straight(self, distance: float, start: GoalStart) -> StraightDrive | Result:
        target, speed, allowance = self.target, abs(self.speed), self.time_allowance
        if target.y != 0.0 or target.z != 0.0:
            text = f"the robot cannot drive by y = {target.y:g} and z = {target.z:g} m"
            return failure("bad_input", text)
        if not all(map(math.isfinite, (distance, speed, allowance))) or speed < SLOWEST_MPS:
            numbers = f"{distance} m at {speed} m/s in {allowance} s"
            text = f"cannot drive {numbers} (would have worked: {SLOWEST_MPS} m/s and more)"
            return failure("bad_input", text)
        speed = min(speed, start.parameters.controller.max_vel_x)
        return StraightDrive(distance, speed, start.now, allowance)


@dataclass(frozen=True, slots=True)
class BackUpGoal(HeadingGoal):
    """``nav2_msgs/BackUp``: the signs do not count."""

    def begin(self, start: GoalStart) -> StraightDrive | Result:
        """Drive straight back by odometry."""
        return self._straight(-abs(self.target.x), start)


@dataclass(frozen=True, slots=True)
class WaitGoal:
    """``nav2_msgs/Wait``."""

    time: float

    def begin(self, start: GoalStart) -> WaitInPlace | Result:
        """Stand still for some seconds."""
        if not math.isfinite(self.time) or self.time < 0.0:
            return failure("bad_input", f"cannot wait for {self.time} s")
        return WaitInPlace(self.time, start.now)


@dataclass(frozen=True, slots=True)
class FollowUserGoal:
    """``florence_interfaces/FollowUser``; 0 takes the parameter's, of ``follow_*``.

    It goes on where the goal before has left off with the same person, begins where they were seen within
    the last half minute, and waits for a sight of others.
    """

    user_id: int
    distance: float = 0.0
    max_lin_speed: float = 0.0
    max_ang_speed: float = 0.0

    def begin(self, start: GoalStart) -> PersonGoal | Result:
        """Follow them."""
        return self._go_after(Follow, start)

    def _go_after(self, kind: type[Follow | Search], start: GoalStart) -> PersonGoal | Result:
        distance, linear, angular = self.distance, self.max_lin_speed, self.max_ang_speed
        if not _are_not_negative(distance, linear, angular):
            text = f"cannot go after a person at {distance} m, {linear} m/s and {angular} rad/s"
            return failure("bad_input", text)
        params = start.parameters.follow
        goal = FollowGoal(
            self.user_id,
            distance or params.follow_distance,
            linear or params.follow_max_lin_speed,
            angular or params.follow_max_ang_speed,
        )
        return kind.begin(goal, start)


@dataclass(frozen=True, slots=True)
class SearchGoal(FollowUserGoal):
    """``florence_interfaces/FollowUser`` of ``search_for_user``: the distance does not count."""

    def begin(self, start: GoalStart) -> PersonGoal | Result:
        """Drive to where somebody may be who was followed and lost; succeed as soon as they are seen."""
        return self._go_after(Search, start)


@dataclass(frozen=True, slots=True)
class ApproachMeGoal:
    """``florence_interfaces/ApproachMe``; 0 takes the parameter's, of ``approach_person_*``.

    The person is where x and y say in the robot's frame; both 0: the nearest whom the camera sees.
    """

    x: float
    y: float
    desired_distance: float = 0.0
    desired_p2r_orientation: float = 0.0
    desired_r2p_orientation: float = 0.0
    max_lin_speed: float = 0.0
    max_ang_speed: float = 0.0

    def begin(self, start: GoalStart) -> Approach | Result:
        """Drive to a place at the person and turn there, by odometry alone."""
        person, distance = (self.x, self.y), self.desired_distance
        orientations = self.desired_p2r_orientation, self.desired_r2p_orientation
        linear, angular = self.max_lin_speed, self.max_ang_speed
        text = ""
        if not all(map(math.isfinite, (*person, *orientations))):
            text = f"cannot approach somebody at {person} m with the orientations {orientations} rad"
        elif not _are_not_negative(distance, linear, angular):
            text = f"cannot stand {distance} m away with {linear} m/s and {angular} rad/s"
        elif 0.0 < distance < NEAREST_M:
            text = f"{distance:g} m is too near to a person (would have worked: {NEAREST_M} m and more)"
        if text:
            return failure("bad_input", text)
        params = start.parameters.approach
        goal = ApproachGoal(
            *person,
            distance or params.approach_person_distance,
            *orientations,
            linear or params.approach_person_max_lin_speed,
            angular or params.approach_person_max_ang_speed,
        )
        return Approach(goal, start.costmaps, start.parameters, start.now)


def _in_map(poses: Iterable[FramedPose], to_map: ToMap) -> list[Pose2] | Result:
    found = []
    for pose in poses:
        one = to_map(pose)
        if isinstance(one, Result):
            return one
        found.append(one)
    return found


def _are_not_negative(*numbers: float) -> bool:
    return all(math.isfinite(number) and number >= 0.0 for number in numbers)


def _nav2(
    kind: str,
    name: str,
    goal: type,
    codes: Mapping[str, int],
    unknown: int,
) -> DriveAction:
    port = Action(name, f"nav2_msgs/action/{kind}", goal, codes["bad_input"])
    return DriveAction(port, codes, unknown)


def _florence(kind: str, name: str, goal: type) -> DriveAction:
    """Make one whose feedback comes in every cycle: document, sections 4.1 and 4.3."""
    port = Action(name, f"florence_interfaces/action/{kind}", goal, SERVER_CODES["bad_input"])
    return DriveAction(port, SERVER_CODES, 100, every_cycle=True)


NAVIGATE_TO_POSE = _nav2("NavigateToPose", "navigate_to_pose", PoseGoal, SERVER_CODES, 100)
DRIVE_ACTIONS = (
    NAVIGATE_TO_POSE,
    _nav2("NavigateThroughPoses", "navigate_through_poses", PosesGoal, THROUGH_SERVER_CODES, 100),
    _nav2("FollowPath", "follow_path", PathGoal, PATH_SERVER_CODES, 100),
    _nav2("Spin", "spin", SpinGoal, SPIN_SERVER_CODES, 700),
    _nav2("BackUp", "backup", BackUpGoal, BACK_UP_SERVER_CODES, 710),
    _nav2("DriveOnHeading", "drive_on_heading", HeadingGoal, HEADING_SERVER_CODES, 720),
    _nav2("Wait", "wait", WaitGoal, WAIT_SERVER_CODES, 740),
    _florence("FollowUser", "follow_user", FollowUserGoal),
    _florence("FollowUser", "search_for_user", SearchGoal),
    _florence("ApproachMe", "approach_person", ApproachMeGoal),
)
"""They share the base: a goal of one takes it from the goal of another."""
