"""The search for its place of a robot that has a goal: it looks round and drives a little.

It goes by odometry and by what its sensors see now, until the localiser has found it. The map says
nothing here.
"""

from __future__ import annotations

import math
from dataclasses import replace

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2
from florence_bt.core.outcome import Result, failure
from florence_bt.skills.navigation.navigate.clearance import Clearance
from florence_bt.skills.navigation.navigate.contact import ContactRecovery
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.spin import Spin
from florence_bt.skills.navigation.navigate.state import Costmaps, CycleState
from florence_bt.skills.navigation.navigate.straight import StraightDrive

NO_PLACE = "the robot does not know where it is in the map"
LOOKING_FOR_PLACE = f"{NO_PLACE}: looking for its place"
_FIRST_PAUSE_S = 1.0
"""A place that comes back so soon was only late; chosen, as ``sensor_timeout``."""
_MOTION_TIME_S = 15.0
"""For one turn or drive, with waiting for people; chosen: a whole turn takes 9 s."""
_LEAST_TURN_RAD, _LEAST_WAY_M = 0.3, 0.4
"""Shorter motions show nothing new: the localiser keeps a scan every 0.25 m and 0.25 rad."""
_SPARE_M, _SPARE_RAD = 0.15, 0.1
"""A drive ends so far before what was seen, and so does a turn; chosen: room to turn beside it."""
_HEADINGS = 16
"""Directions that are tried for a way. Chosen."""


class FindPlace:
    """Turns once round, then drives from place to place, each as far as possible from where it was before.

    Args:
        costmaps: Of which only the local one counts.
        parameters: All of navigation.
        now: Seconds.

    Attributes:
        moved: Whether the robot was moved since it does not know where it is.
    """

    def __init__(self, costmaps: Costmaps, parameters: NavigatorParameters, now: float) -> None:
        self._local = costmaps.local_costmap
        self._p = params = parameters.recovery
        self._turning = replace(
            parameters.turn, spin_max_speed=max(parameters.turn.spin_min_speed, params.find_place_turn_speed)
        )
        self._contact = ContactRecovery(costmaps, params)
        self._pause_until = now + _FIRST_PAUSE_S
        self._patience = params.find_place_time or parameters.cycle.sensor_patience
        self._end = now + self._patience
        self._motion: Spin | StraightDrive | None = None
        self._visited: list[Pose2] = []
        self._way: float | None = None
        self._cleared = False
        self.moved = False

    def step(self, state: CycleState) -> tuple[Twist2, Result | None]:
        """Take one step: the velocity, and a failure when the place was not found in time."""
        contact = self._contact.step(state)
        if isinstance(contact, Result):
            return STANDSTILL, contact
        if state.now > self._end:
            tried = " after turning and driving a little" if self.moved else ""
            return STANDSTILL, failure("no_pose", NO_PLACE + tried)
        if contact is not None:
            self._motion = self._way = None
            return contact, None
        if state.now < self._pause_until or self._p.find_place_time == 0.0:
            return STANDSTILL, None
        if self._motion is None:
            self._motion = self._next_motion(state)
        return self._move(state), None

    def _move(self, state: CycleState) -> Twist2:
        motion = self._motion
        if motion is None or (isinstance(motion, Spin) and state.people.anybody_beside(state.pose)):
            return STANDSTILL
        command, _, result = motion.step(state)
        if result is not None:
            self._motion = None
            self._way = self._way if result.succeeded and isinstance(motion, Spin) else None
        self.moved |= not command.is_zero()
        return command

    def _next_motion(self, state: CycleState) -> Spin | StraightDrive | None:
        """Return the first turn; then turns towards room, and drives there; None when nothing is free."""
        if self._way is not None:
            return self._drive(state, self._way)
        first = not self._visited
        self._visited.append(state.pose)
        turn = self._free_turn(state, math.tau) if first else 0.0
        if abs(turn) < _LEAST_TURN_RAD:
            turn, self._way = self._where_to(state)
        if self._way is not None and abs(turn) <= self._turning.spin_precision:
            return self._drive(state, self._way)
        if abs(turn) >= self._turning.spin_precision:
            return Spin(turn, self._turning, state.now, _MOTION_TIME_S)
        self._look_again(state)
        return None

    def _drive(self, state: CycleState, way: float) -> StraightDrive:
        return StraightDrive(way, self._p.find_place_speed, state.now, _MOTION_TIME_S)

    def _free_turn(self, state: CycleState, angle: float) -> float:
        """Return the longer one of the turns to both sides, as far as they are free, up to an angle."""
        parts = [state.clearance.free_part(0.0, side * angle) for side in (1.0, -1.0)]
        turn = angle if max(parts) >= 1.0 else angle * max(parts) - _SPARE_RAD
        return math.copysign(max(0.0, turn), parts[0] - parts[1])

    def _where_to(self, state: CycleState) -> tuple[float, float | None]:
        """Return the turn and the way to the place that is farthest from where the robot has been."""
        found: tuple[float, float | None] = 0.0, None
        best, pose = 0.0, state.pose
        for number in range(_HEADINGS):
            turn = math.remainder(math.tau * number / _HEADINGS, math.tau)
            there = Clearance(self._local, replace(pose, yaw=pose.yaw + turn), None, None)
            longest = self._p.find_place_distance
            way = there.free_part(longest + _SPARE_M, 0.0) * (longest + _SPARE_M) - _SPARE_M
            if way < _LEAST_WAY_M or not state.clearance.is_free(0.0, turn):
                continue
            end = pose @ Pose2(way * math.cos(turn), way * math.sin(turn))
            new = min(end.distance_to(before) for before in self._visited)
            if new > best:
                best, found = new, (turn, way)
        return found

    def _look_again(self, state: CycleState) -> None:
        """Look again if nothing is free: where the robot was carried from may still be marked around it."""
        self._pause_until = state.now + _FIRST_PAUSE_S
        self._visited.clear()
        if not self._cleared:
            self._cleared = True
            self._local.reset_outside(state.pose.x, state.pose.y, self._local.resolution)
