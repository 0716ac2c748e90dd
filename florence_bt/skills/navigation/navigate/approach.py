"""Approach somebody: drive to a place at them by odometry alone, and turn. No ROS, no clock of its own."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Point2, Pose2, Twist2, normalize_angle
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.filters.legs.leg_detector import REACH_M, legs_near, narrow_things
from florence_bt.skills.navigation.navigate.contact import ContactRecovery
from florence_bt.skills.navigation.navigate.controller import Control, Controller
from florence_bt.skills.navigation.navigate.goal import NavigationGoal
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.person_track import PersonTrack
from florence_bt.skills.navigation.navigate.personal_space import NEAREST_M, keep_off
from florence_bt.skills.navigation.navigate.recovery import ProgressWatch
from florence_bt.skills.navigation.navigate.state import Costmaps, CycleState, Feedback

_AT_M = 0.5
"""A person whom the camera sees so near to where the person should be is the person (REFERENCE 12.6)."""
_CAMERA_GAP_S = 0.3
"""Time without a sight of the person by the camera after which the laser goes on."""
_COS_BEAM = math.cos(0.1)
"""Beams so near to a direction, as the cosine of the angle, look there."""
_LEAST_M = NEAREST_M + 0.03
"""The robot aims no nearer than this at the person: it may stand some centimetres off."""
_ROUND_M, _CUT_M = 0.7, 0.03
"""The way leads round the person at this distance, when straight on it would come nearer than that and, by
more than the second, than its ends."""
_STEP_M = 0.05
_HALF_CIRCLE_RAD = 2.6
"""From here on both ways round are about as long: the one that was begun goes on."""


@dataclass(frozen=True, slots=True)
class ApproachGoal:
    """The place to stand.

    Attributes:
        x: The person at the start, in front of the robot, metres.
        y: To its left; both 0: the nearest person whom the camera sees.
        distance: From the person, between the middles, metres.
        p2r: The direction from the person to the robot; 0 is where the robot is at the start, radians.
        r2p: The direction from the robot to the person in the end; 0 is straight ahead, radians.
        max_linear: m/s.
        max_angular: rad/s.
    """

    x: float
    y: float
    distance: float
    p2r: float
    r2p: float
    max_linear: float
    max_angular: float


class Approach(NavigationGoal):
    """Drives to a place at somebody who stands, and turns there. It needs no map.

    The person is where the goal says, as a fixed place of the odometry frame, until somebody sees them; then
    where the camera saw them last, and beside its image where the laser sees their legs. Where neither can
    look they stand where they stood. The robot does not move before they are seen.

    Source:
        REFERENCE 12.7; document, section 4.3.
    """

    by_odometry = True

    def __init__(
        self, goal: ApproachGoal, costmaps: Costmaps, parameters: NavigatorParameters, now: float
    ) -> None:
        self._goal = goal
        self._local_costmap = costmaps.local_costmap
        self._params = parameters.approach
        # To stop short of the place is not to reach it.
        exact = dataclasses.replace(parameters.controller, blocked_xy_tolerance=0.0)
        self._controller = Controller(exact)
        self._contact = ContactRecovery(costmaps, parameters.recovery)
        self._progress = ProgressWatch(parameters.recovery)
        self._progress.reset(now)
        self._track = PersonTrack(parameters.people.people_velocity_time, 0.0)
        self._recognised = self._told = -math.inf
        self._began = self._there = now
        self._start: Pose2 | None = None
        self._from_person: float | None = None
        self._side = 0.0

    @property
    def person(self) -> Point2 | None:
        """Give the place where the person should be, odometry frame, metres; None while nobody knows."""
        if self._track.seen is not None:
            return self._track.last
        if self._start is None or (self._goal.x == 0.0 and self._goal.y == 0.0):
            return None
        return self._start.apply(self._goal.x, self._goal.y)

    def saw_people(self, stamp: float, people: Sequence[Point2]) -> None:
        """Note that the camera saw people: time in seconds, places in the odometry frame in metres.

        What was told before counts once: who asks in every cycle tells the last sight again and again.
        """
        if self._start is None or not people or stamp < self._began or stamp <= self._told:
            return
        self._told = stamp
        expected = self.person
        around = expected or (self._start.x, self._start.y)
        place = min(people, key=lambda each: math.dist(each, around))
        if expected is None or math.dist(place, expected) <= _AT_M:
            self._track.saw(stamp, *place)
            self._recognised = self._there = stamp

    def saw_scan(
        self, stamp: float, points: NDArray[np.float64], robot: Pose2, map_from_odom: Pose2 | None
    ) -> None:
        """Go on with the legs in a scan while the camera does not see the person.

        Args:
            stamp: Seconds.
            points: Where the beams end, in the order of the scan, shape (n, 2), odometry frame, metres.
            robot: The robot in the odometry frame at that time.
            map_from_odom: Not used: it needs no map.
        """
        expected = self.person
        if expected is None or stamp - self._recognised < _CAMERA_GAP_S:
            return
        legs = legs_near(narrow_things(points), robot, expected)
        if legs is not None:
            gain = self._params.approach_person_laser_gain
            x, y = (old + gain * (new - old) for old, new in zip(expected, legs, strict=True))
            self._track.saw(stamp, x, y)
        if self._track.seen is not None and not _is_empty(expected, points, robot):
            self._there = stamp

    def step(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step: the velocity, the feedback, and the result when it is over."""
        if self._start is None:
            self._start = state.pose
        contact = self._contact.step(state)
        end = contact if isinstance(contact, Result) else self._failure(state.now)
        if end is not None:
            return STANDSTILL, self._feedback(end.reason), end
        if isinstance(contact, Twist2):
            return contact, self._feedback(self._contact.text), None
        if self._track.seen is None:
            return STANDSTILL, self._feedback("waiting: nobody is seen yet"), None
        return self._drive(state, self._start)

    def _failure(self, now: float) -> Result | None:
        params = self._params
        if now - self._there > params.approach_person_patience:
            reason = f"for {params.approach_person_patience:g} s nobody was where the person should be"
            return failure("user_lost", reason)
        if now - self._began > params.approach_person_limit:
            return failure("timed_out", f"the robot was not there after {params.approach_person_limit:g} s")
        return None

    def _drive(self, state: CycleState, start: Pose2) -> tuple[Twist2, Feedback, Result | None]:
        person = self.person
        assert person is not None, "somebody was seen"
        goal = self._goal_pose(person, start)
        way, self._side = way_round((state.pose.x, state.pose.y), (goal.x, goal.y), person, self._side)
        self._controller.set_plan(way, goal)
        control = self._controller.control(
            state.pose,
            state.twist,
            self._local_costmap,
            Pose2(),
            state.clearance,
            state.people.around_goal(goal),
        )
        feedback = self._feedback(control.text or f"waiting: {control.blocked}", control.remaining)
        if control.reached:
            return STANDSTILL, feedback, success()
        command = control.command.slowed_to(self._goal.max_linear, self._goal.max_angular)
        return keep_off(state.pose, person, command), feedback, self._no_progress(state, control)

    def _goal_pose(self, person: Point2, start: Pose2) -> Pose2:
        """Return where to stand, in the odometry frame."""
        if self._from_person is None:
            self._from_person = math.atan2(start.y - person[1], start.x - person[0])
        angle, away = self._from_person + self._goal.p2r, max(_LEAST_M, self._goal.distance)
        return Pose2(
            person[0] + away * math.cos(angle),
            person[1] + away * math.sin(angle),
            normalize_angle(angle + math.pi - self._goal.r2p),
        )

    def _no_progress(self, state: CycleState, control: Control) -> Result | None:
        problem = self._progress.problem(state.now, state.pose, control.remaining)
        if problem is None:
            return None
        return failure("blocked", control.blocked) if control.blocked else failure("no_progress", problem)

    def _feedback(self, text: str, remaining: float = 0.0) -> Feedback:
        return Feedback(remaining, recoveries=self._contact.back_offs, text=text)


def way_round(start: Point2, end: Point2, person: Point2, side: float) -> tuple[NDArray[np.float64], float]:
    """Return the shortest way that keeps away from somebody: straight, or along two tangents and an arc.

    Args:
        start: Metres.
        end: Metres.
        person: Metres.
        side: Below 0 it began clockwise round the person, above 0 counter-clockwise, 0 it has not begun.

    Returns:
        Points at most 0.05 m apart, shape (n, 2), n >= 2, and the side of this way.
    """
    (from_x, from_y), (to_x, to_y) = np.subtract(start, person), np.subtract(end, person)
    far = math.hypot(from_x, from_y), math.hypot(to_x, to_y)
    angle = math.atan2(from_y, from_x)
    turn = normalize_angle(math.atan2(to_y, to_x) - angle)
    if turn * side < 0.0 and abs(turn) > _HALF_CIRCLE_RAD:
        turn += math.copysign(math.tau, side)
    side = math.copysign(1.0, turn)
    straight = _dense(np.array([start, end]))
    if np.hypot(*(straight - person).T).min() >= min(_ROUND_M, *far) - _CUT_M:
        return straight, side
    before, after = (math.acos(_ROUND_M / max(_ROUND_M, each)) for each in far)
    on_arc = angle + side * np.arange(before, abs(turn) - after, _STEP_M)
    arc = np.add(person, _ROUND_M * np.stack([np.cos(on_arc), np.sin(on_arc)], axis=1))
    return _dense(np.vstack([start, arc, end])), side


def _dense(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points along a line through some corners, shape (n, 2) each."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    at = np.linspace(0.0, along[-1], max(2, math.ceil(along[-1] / _STEP_M) + 1))
    return np.stack([np.interp(at, along, corners[:, axis]) for axis in (0, 1)], axis=1)


def _is_empty(place: Point2, points: NDArray[np.float64], robot: Pose2) -> bool:
    """Tell whether the laser sees past a place, and sees nothing there."""
    bearing, away = robot.bearing_to(*place), math.dist(place, (robot.x, robot.y))
    x, y = (points - [robot.x, robot.y]).T
    turn = np.arctan2(y, x) - robot.yaw - bearing
    beams = np.cos(turn) > _COS_BEAM
    past = bool(beams.any()) and bool((np.hypot(x, y)[beams] > away).all())
    near = np.hypot(points[:, 0] - place[0], points[:, 1] - place[1]) <= REACH_M
    return past and not near.any()
