"""A walking person of the simulated flat: on a route, and round whoever is in the way."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Sequence

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.free_space import FreeSpace, Point, free_space_of
from florence_bt.simulation.home.person import BODY_RADIUS_M, PersonSpec, forward_reach, half_width

STOP_DISTANCE_M = 0.6
"""A walking person keeps this far from the middle of the robot and of other people; further with something
before them."""

_RESERVE_M = 0.05
"""A way round keeps this much more, and may be this much narrower on a side than a route: a cell of the free
space."""

_SIGHT_M, _BEYOND_M, _SPACING_M = 0.5, 4.0, 0.1
"""Distances along the route in which a person looks for somebody in the way, and beyond them for a place, and
the steps of that look."""

_RIGHT_M = 0.15
"""So much room more is needed to pass somebody on the left: two people who meet go different ways."""

_DETOUR_M = 2.0
"""A person who would have to walk this much further waits."""

_RETHINK_S = 0.5
"""Between two searches for a way round."""

_PATIENCE_S = 3.0, 10.0
"""After how long somebody who walks to and fro turns round before another person, and before the robot."""

_STEP_BACK_M, _LET_PASS_S = 1.0, 3.0
"""Somebody who walks once and has waited for another person as long as for the robot goes back so far, and
stands there for so long: the other one gets past."""

_SQUEEZE_AFTER_S, _SQUEEZE_S, SQUEEZE_M = 3.0, 5.0, 0.1
"""A person who has waited for so long passes nearer by, for so long, by so much: half a metre between the
middles is as near as one gets past the robot, or somebody in a door, without touching."""


class Walker:
    """Leads a person along a route: there and back for ever, or once.

    Round the robot and other people the person walks where the floor is free; where it is not (in a door),
    the person waits, and tries to pass nearer by when that takes long; somebody who walks to and fro turns
    round then, and one who walks once steps back and lets another person pass. Somebody who walks once stands
    for a while where they have something to do (``pauses``).

    Args:
        spec: A person with a route.
        flat: The home. Without it no floor is known beside the route, and the person only waits.

    Raises:
        ConfigError: The route leads nowhere.
    """

    def __init__(self, spec: PersonSpec, flat: Flat | None = None) -> None:
        self._route = _Line([(spec.pose.x, spec.pose.y), *spec.route])
        if not self._route.length > 0.0:
            raise ConfigError(f"the route of {spec.name!r} leads nowhere")
        self._spec = spec
        self._flat = flat
        self._usual = STOP_DISTANCE_M + max(0.0, forward_reach(spec) - BODY_RADIUS_M)
        self._walked = 0.0
        self._detour: _Detour | None = None
        self._time = self._waited = self._rethink = 0.0
        self._squeezes_until, self._next_squeeze = -math.inf, 0.0
        self._off_at = spec.wait
        self._pauses = list(zip(self._route.ends, spec.pauses, strict=False)) if spec.once else []
        self.pose = self._pose_after(0.0)

    @property
    def _distance(self) -> float:
        """Compute how far from everybody else the person keeps now, metres."""
        return self._usual - (SQUEEZE_M if self._time < self._squeezes_until else 0.0)

    @property
    def arrived(self) -> bool:
        """Tell whether a person who walks once has come to the end."""
        return self._spec.once and self._walked >= self._route.length

    def advance(self, seconds: float, robot: Pose2, people: Sequence[Pose2] = ()) -> Pose2:
        """Walk on for a while, unless somebody is in the way.

        Args:
            seconds: For how long.
            robot: Where the robot is, map frame.
            people: Where everybody else is, map frame.

        Returns:
            The new pose.
        """
        self._time += seconds
        if self._time <= self._off_at or self.arrived:
            return self.pose
        leg = self._walked // self._route.length
        bodies = (robot, *people)
        if self._detour is None and any(self._runs_into(point, bodies) for point in self._ahead(bodies)):
            self._look_for_way_round(bodies)
        step = self._spec.speed * seconds
        there = (
            self._detour.after(step) if self._detour is not None else self._pose_after(self._walked + step)
        )
        if self._runs_into(there, bodies):
            self._wait(seconds, there, bodies)
            return self.pose
        self.pose = there
        self._waited = 0.0
        if self._detour is None:
            self._walked += step
        elif self._detour.go(step):
            self._walked, self._detour = self._detour.back_at, None
        if self._walked // self._route.length > leg:
            self._off_at = self._time + self._spec.wait
        while self._pauses and self._walked >= self._pauses[0][0]:
            self._off_at = self._time + self._pauses.pop(0)[1]
        return self.pose

    def _wait(self, seconds: float, there: Pose2, bodies: Sequence[Pose2]) -> None:
        self._waited += seconds
        person = self._waited >= _PATIENCE_S[0] and self._runs_into(there, bodies[1:])
        turns_round = self._waited >= _PATIENCE_S[1] or (person and not self._spec.once)
        if turns_round:
            self._waited = 0.0
            if not self._spec.once:
                self._walked = 2 * self._route.length - self._walked % (2 * self._route.length)
            if self._detour is not None:
                self._detour = self._detour.back(self._walked)
            elif self._spec.once and person:
                self._step_back()
            return
        if self._waited >= _SQUEEZE_AFTER_S and self._time >= self._next_squeeze:
            self._squeeze_past(bodies)
        elif self._detour is not None:
            self._look_for_way_round(bodies)

    def _step_back(self) -> None:
        """Go back along the route, and stand there for a while."""
        back_at = max(0.0, self._walked - _STEP_BACK_M)
        there = self._route.at(back_at)
        if there.distance_to(self.pose) > 0.0:
            self._detour = _Detour(_Line([(self.pose.x, self.pose.y), (there.x, there.y)]), back_at)
            self._pauses.insert(0, (back_at, _LET_PASS_S))

    def _squeeze_past(self, bodies: Sequence[Pose2]) -> None:
        """Pass nearer by for a while, if that leads anywhere."""
        self._next_squeeze = self._time + _SQUEEZE_AFTER_S
        self._squeezes_until = self._time + _SQUEEZE_S
        before, self._rethink = self._detour, 0.0
        if before is None and not any(self._runs_into(point, bodies) for point in self._ahead(bodies)):
            return
        self._look_for_way_round(bodies)
        if self._detour is before:
            self._squeezes_until = -math.inf

    def _pose_after(self, walked: float) -> Pose2:
        total = self._route.length
        if self._spec.once:
            return self._route.at(min(walked, total))
        along = walked % (2 * total)
        if along <= total:
            return self._route.at(along)
        there = self._route.at(2 * total - along)
        return Pose2(there.x, there.y, normalize_angle(there.yaw + math.pi))

    def _runs_into(self, there: Pose2, bodies: Sequence[Pose2]) -> bool:
        """Tell whether a step runs into somebody: near a body only steps that lead away from it are taken."""
        return any(
            (after := there.distance_to(body)) < self._distance and after <= self.pose.distance_to(body)
            for body in bodies
        )

    def _steps_ahead(self, distance: float) -> list[float]:
        """Return how far will have been walked at points ahead, up to where the person turns round."""
        left = min(distance, self._route.length - self._walked % self._route.length)
        count = math.floor(left / _SPACING_M)
        return [*(self._walked + _SPACING_M * number for number in range(1, count + 1)), self._walked + left]

    def _ahead(self, bodies: Sequence[Pose2]) -> list[Pose2]:
        """Return the route right ahead; nothing while nobody is near enough to be on it."""
        if all(self.pose.distance_to(body) > self._distance + _SIGHT_M for body in bodies):
            return []
        return [self._pose_after(walked) for walked in self._steps_ahead(_SIGHT_M)]

    def _look_for_way_round(self, bodies: Sequence[Pose2]) -> None:
        """Leave the route for the shortest way round everybody, if there is one that is not too long."""
        if self._flat is None or self._time < self._rethink:
            return
        self._rethink = self._time + _RETHINK_S
        apart = self._distance + _RESERVE_M
        steps = self._steps_ahead(_BEYOND_M)
        clear = apart + _RIGHT_M
        taken = [min(map(self._pose_after(walked).distance_to, bodies)) < clear for walked in steps]
        first = taken.index(True) if True in taken else 0
        back_at = next((steps[n] for n in range(first, len(steps)) if not taken[n]), None)
        if back_at is None:
            return
        goal = self._pose_after(back_at)
        way = self._way_round(
            free_space_of(self._flat), (goal.x, goal.y), [(b.x, b.y, apart) for b in bodies]
        )
        if way is not None and way.length <= back_at - self._walked + _DETOUR_M:
            self._detour = _Detour(way, back_at)

    def _way_round(
        self, space: FreeSpace, goal: Point, bodies: Sequence[tuple[float, float, float]]
    ) -> _Line | None:
        """Return the way to a point, first a step away from anybody too near; rather to their right."""
        here = (self.pose.x, self.pose.y)
        radius = half_width(self._spec.aid) - _RESERVE_M
        towards = math.atan2(goal[1] - here[1], goal[0] - here[0])
        left = (-_RIGHT_M * math.sin(towards), _RIGHT_M * math.cos(towards))
        wider = [*bodies, *((x + left[0], y + left[1], apart) for x, y, apart in bodies)]
        start = space.nearest(here, radius, wider)
        if start is None or math.dist(start, here) > _SIGHT_M:
            return None
        way = space.shortest_way(start, goal, radius, wider)
        return _Line([here, start, *way[1:-1], goal]) if way is not None else None


class _Line:
    """Straight legs between points.

    Args:
        points: At least two, map frame.

    Attributes:
        ends: How far along each leg ends, metres.
        length: Of all legs, metres.
    """

    def __init__(self, points: Sequence[Point]) -> None:
        self._points = points
        self.ends = list(itertools.accumulate(math.dist(a, b) for a, b in itertools.pairwise(points)))
        self.length = self.ends[-1]

    def back_from(self, along: float) -> _Line | None:
        """Return the way from so many metres along back to the beginning; None when that is here."""
        if along <= 0.0:
            return None
        here = self.at(min(along, self.length))
        passed = [point for point, end in zip(self._points[1:], self.ends, strict=True) if end < along]
        return _Line([(here.x, here.y), *reversed(passed), self._points[0]])

    def at(self, along: float) -> Pose2:
        """Return the point at so many metres from the beginning, looking along the leg."""
        leg = min(bisect.bisect_right(self.ends, along), len(self.ends) - 1)
        (ax, ay), (bx, by) = self._points[leg], self._points[leg + 1]
        start = self.ends[leg - 1] if leg else 0.0
        length = self.ends[leg] - start
        part = (along - start) / length if length > 0.0 else 0.0
        yaw = normalize_angle(math.atan2(by - ay, bx - ax))
        return Pose2(ax + part * (bx - ax), ay + part * (by - ay), yaw)


class _Detour:
    """A way beside the route.

    Args:
        way: From where the person leaves the route to where they come back to it.
        back_at: How much of the route has been walked there, metres.
    """

    def __init__(self, way: _Line, back_at: float) -> None:
        self.back_at = back_at
        self._way = way
        self._gone = 0.0

    def back(self, left_at: float) -> _Detour | None:
        """Return the same way back to where the person left the route; None where they have just left it.

        Args:
            left_at: How much of the route has been walked there, metres.
        """
        way = self._way.back_from(self._gone)
        return None if way is None else _Detour(way, left_at)

    def after(self, step: float) -> Pose2:
        """Return where the person is so many metres further on."""
        return self._way.at(min(self._gone + step, self._way.length))

    def go(self, step: float) -> bool:
        """Go so many metres on; whether the route is reached again."""
        self._gone += step
        return self._gone >= self._way.length
