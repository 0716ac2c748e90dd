"""Giving way: back off from who comes nearer, and step aside for who waits for the robot to let them past."""

from __future__ import annotations

import math
from dataclasses import dataclass

from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.skills.navigation.navigate.costmap import moved_points
from florence_bt.skills.navigation.navigate.following.planned_way import PlannedWay
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.following.way_back import WayBack
from florence_bt.skills.navigation.navigate.legs import Place
from florence_bt.skills.navigation.navigate.state import RobotState
from florence_bt.skills.navigation.navigate.step_aside import place_to_step_aside

_TOWARDS = 0.7
"""Somebody comes towards the robot who walks no further beside it than this cosine."""
_WAITS_S, _STAYS_M, _NEAR_M = 3.0, 0.25, 0.75
"""Who is so near while the robot stands, for so long, and goes no further than this, waits for it to let them
pass."""
_STANDS_MPS = 0.05
"""Slower than this it does not get on."""
_ASIDE_S, _ASIDE_MORE_M = 15.0, 0.3
"""For how long it drives to where it can be passed at most, and how much further away than it follows."""
_ARRIVED_M = 0.1


@dataclass(frozen=True, slots=True)
class _Aside:
    """Stepping aside.

    Attributes:
        stood: Where the robot stood, odometry frame, metres.
        place: Where it drives to, map frame, metres.
        waits: Where somebody else than the person waits, odometry frame, metres; None for the person.
        deadline: When it is over, seconds.
    """

    stood: Place
    place: Place
    waits: Place | None
    deadline: float


class GiveWay:
    """Lets people pass."""

    def __init__(self, task: FollowTask, way_back: WayBack, planned: PlannedWay) -> None:
        self._task = task
        self._way_back = way_back
        self._planned = planned
        self._waits: tuple[Place, float] | None = None
        self._aside: _Aside | None = None
        self._backwards = False

    @property
    def steps_aside(self) -> bool:
        """Whether the robot drives to where it can be passed."""
        return self._aside is not None

    def is_too_near(self, state: RobotState, distance: float, bearing: float) -> bool:
        """Whether the person is nearer than wanted; who does not come may be a little nearer."""
        track = self._task.track
        comes = track.walks and track.walks_away(state.pose, bearing) < -_TOWARDS * track.speed
        return distance < self._task.goal.distance - (0.0 if comes else self._task.use.follow_give_way)

    def back_off(self, state: RobotState, person: Place, bearing: float) -> Twist2:
        """Back off as far as there is room, else face the person."""
        too_near = self._task.goal.distance - math.dist(person, (state.pose.x, state.pose.y))
        comes = max(0.0, -self._task.track.walks_away(state.pose, bearing))
        speed = comes + self._task.use.follow_linear_gain * too_near
        command = self._way_back.back_off(state, bearing, speed)
        return self._task.motions.turn_towards(state, bearing) if command.is_zero() else command

    def watch_who_waits(self, state: RobotState, command: Twist2) -> None:
        """Begin to step aside for who waits while the robot does not get on: the person, or somebody else."""
        here, track = (state.pose.x, state.pose.y), self._task.track
        near: list[Place] = []
        if abs(command.linear) < _STANDS_MPS:
            others: list[Place] = [(float(x), float(y)) for x, y in state.people.rows[:, :2]]
            near = [place for place in others if math.dist(place, here) < _NEAR_M]
        too_near = min(_NEAR_M, self._task.goal.distance - self._task.use.follow_give_way)
        # While the robot turns to the person, they do not wait yet.
        seen = command.is_zero() and track.is_seen(state.now)
        if seen and math.dist(track.at(state.now), here) < too_near:
            near.append(track.at(state.now))
        nearest = min(near, key=lambda place: math.dist(place, here), default=None)
        if nearest is None:
            self._waits = None
        elif self._waits is None or math.dist(nearest, self._waits[0]) > _STAYS_M:
            self._waits = nearest, state.now
        elif state.now - self._waits[1] > _WAITS_S:
            self._waits = None
            self._begin_to_step_aside(state, nearest)

    def step_aside(self, state: RobotState) -> Twist2:
        """Drive to where the robot can be passed, backwards where that does not turn its back on them.

        Who is not seen then has gone through where it stood.
        """
        aside, track = self._aside, self._task.track
        assert aside is not None
        waits = track.at(state.now) if aside.waits is None else aside.waits
        there = state.map_from_odom.inverse().apply(*aside.place)
        command, remaining = self._planned.drive(state, there, waits)
        far = math.dist(waits, (state.pose.x, state.pose.y)) > self._task.goal.distance + _ASIDE_MORE_M
        if far or state.now > aside.deadline or remaining <= _ARRIVED_M or self._planned.path is None:
            self._aside = None
            self._planned.forget()
            if aside.waits is None and not track.is_seen(state.now):
                track.suppose(state.now, aside.stood)
            return STANDSTILL
        if self._backwards:
            way = moved_points(self._planned.path, state.map_from_odom.inverse())
            bearing = state.pose.bearing_to(*waits)
            back = self._way_back.back_along(state, [(float(x), float(y)) for x, y in way], bearing)
            self._backwards = not back.is_zero()
            return back
        return command

    def _begin_to_step_aside(self, state: RobotState, waits: Place) -> None:
        track, apart = self._task.track, self._task.goal.distance + _ASIDE_MORE_M
        in_map = state.map_from_odom.apply(*waits)
        place = place_to_step_aside(self._task.costmaps, state.map_pose, in_map, apart)
        if place is not None:
            person = track.is_seen(state.now) and track.at(state.now) == waits
            here = state.pose.x, state.pose.y
            self._aside = _Aside(here, place, None if person else waits, state.now + _ASIDE_S)
            self._backwards = True
            self._planned.plan_anew()
