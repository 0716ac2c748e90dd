"""The locator without ROS: rooms, the last known user, the robot, its goal and the manual override.

All poses are in the map frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from florence_bt.core.clock import Clock
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.locator.bindings import USER_UNKNOWN
from florence_bt.skills.locator.habits import RoomHabits
from florence_bt.skills.locator.hotspots import ROOM_NAMES, Hotspot, Hotspots, kind_of_new

if TYPE_CHECKING:
    from florence_bt.core.sensing import OccupancyGrid

STATUS_OF_RUN_STATE = {
    "IDLE": "LOST",
    "ACTIVE": "ACTIVE",
    "SUCCEEDED": "SUCCEEDED",
    "ABORTED": "ABORTED",
    "PREEMPTED": "PREEMPTED",
}
"""State of a mission run -> the name move_base would have given (REFERENCE 10 and 12.1, row 7).

Before the first goal an actionlib client answers LOST: it has no goal that it could know about.
"""

MAX_AHEAD_S = 10.0
"""Time by which a sighting may be ahead of the present."""
PERSON_SLACK_M = 1.0
"""So near to something that the map knows a person may be seen (chosen: on a sofa or a balcony that the laser
of the map did not see, and by a sensor with an error)."""
MAX_HOTSPOTS = 1000
"""More take so long to write and to read back that other requests would wait too long."""


INITIAL_ROOM, SET_ROOM, SET_POSITION = "initial_user_room", "setUserPosRoom", "setUserPosXYPhi"
"""Sources of the user's place: the parameter and the services of the document's table 11."""


@dataclass(frozen=True, slots=True)
class LastSeen:
    """The time and source of the last location of the user.

    Attributes:
        source: The sensor, service or topic.
        since: When it began to say where the user is, seconds; what began later counts.
        at: Until when it said so, seconds.
    """

    source: str
    since: float
    at: float


class Locator:
    """Answers who is where, and whether the robot may be sent somewhere.

    Args:
        hotspots: The rooms and objects.
        clock: Tells how long ago the user was seen.
        initial_user_room: The room to believe the user in at the start, empty for none.
        habits: Where the user usually is; what is seen from now on is counted there.
        room_names: What a hotspot is called that is a room when it is taught.

    Raises:
        ConfigError: The initial room is not among the hotspots.

    Source:
        Document, section 3.8; REFERENCE 12.1, 12.3 to 12.5.
    """

    def __init__(
        self,
        hotspots: Hotspots,
        clock: Clock,
        initial_user_room: str = "",
        habits: RoomHabits | None = None,
        room_names: Iterable[str] = ROOM_NAMES,
    ) -> None:
        self._room_names = tuple(room_names)
        self.hotspots = hotspots
        self.habits = habits or RoomHabits()
        self._clock = clock
        self._last_seen: LastSeen | None = None
        self.robot: Pose2 | None = None
        """The robot's pose, None while that is not known."""
        self.goal: Pose2 | None = None
        """The most recent navigation goal, None before the first."""
        self.user: Pose2 | None = None
        """The last known pose of the user."""
        self.map: OccupancyGrid | None = None
        """The map, None while it is not known."""
        self.override = False
        """A person has taken the robot over."""
        self._run_state = "IDLE"
        if initial_user_room:
            # Believed, not seen: whatever a sensor says, also of the time before the start, replaces it.
            result = self._see_in_room(initial_user_room, LastSeen(INITIAL_ROOM, -math.inf, clock.now()))
            if not result.succeeded:
                raise ConfigError(f"{INITIAL_ROOM}: {result.reason}")

    def room_of(self, x: float, y: float) -> str:
        """Return a point's room (``Hotspots.room_of``)."""
        return self.hotspots.room_of(x, y)

    def room_of_pose(self, pose: Pose2 | None) -> str:
        """Do as :meth:`room_of`; empty when there is no pose."""
        return self.room_of(pose.x, pose.y) if pose is not None else ""

    def set_user_position(self, pose: Pose2, source: str = SET_POSITION) -> Result:
        """Take over a coordinate from a precise sensor, which sees the user now.

        It always replaces the old one, unless it is not finite or off the map. In an obstacle of the map
        somebody may sit or lie: on a sofa, in bed.
        """
        if not pose.is_finite():
            return failure("bad_input", f"the position must be finite, not {pose}")
        problem = self._off_the_map(pose, PERSON_SLACK_M)
        if problem is not None:
            return failure(
                "bad_input",
                f"({pose.x:.2f} m, {pose.y:.2f} m) is {problem}; a place on its free floor would be stored",
            )
        self.user = pose
        now = self._clock.now()
        self._last_seen = LastSeen(source, now, now)
        self._count_room(now)
        return success()

    def _off_the_map(self, pose: Pose2, slack: float = 0.0) -> str | None:
        """Tell why the map, if known, says nothing about a place; None if it does."""
        return None if self.map is None else self.map.problem_with_place(pose.x, pose.y, slack)

    def set_user_room(self, label: str) -> Result:
        """Take over a room from a coarse sensor; a known position in the same room stays as it is."""
        now = self._clock.now()
        return self._see_in_room(label, LastSeen(SET_ROOM, now, now))

    def take_sighting(self, room: str, seen: LastSeen) -> Result:
        """Take over a room from the home sensors, unless something else located the user after that began.

        In the room where the user is anyway, it says how long they have been seen there.
        """
        now, last = self._clock.now(), self._last_seen
        if seen.since > now + MAX_AHEAD_S or seen.at > now + MAX_AHEAD_S:
            return failure("bad_input", f"{seen.source}: the user was seen in the future")
        elsewhere = self.user is None or self.room_of_pose(self.user) != room
        # What lies in the future was said before the clock was set back.
        known = last if last is not None and last.at <= now + MAX_AHEAD_S else None
        if known is not None and elsewhere and seen.since < known.since:
            return success()
        if known is not None and not elsewhere:
            at = seen.at if seen.source == known.source else max(seen.at, known.at)
            seen = LastSeen(seen.source, max(seen.since, known.since), at)
        return self._see_in_room(room, seen)

    def _see_in_room(self, label: str, seen: LastSeen) -> Result:
        hotspot = self.hotspots.get(label)
        if hotspot is None:
            return failure("unknown_hotspot", self.hotspots.unknown(label))
        if self.user is None or self.room_of_pose(self.user) != label:
            self.user = hotspot.pose
        self._last_seen = seen
        if seen.source != INITIAL_ROOM:
            self._count_room(seen.at)
        return success()

    def _count_room(self, at: float) -> None:
        self.habits.saw(self.room_of_pose(self.user), at)

    def set_hotspot(self, label: str, pose: Pose2) -> Result:
        """Move a hotspot, whose kind and polygon stay, or add one: a room if it is called so, else an object.

        Returns:
            With the output ``hotspot``; or why not.
        """
        if not label.strip():
            return failure("bad_input", "a hotspot needs a label")
        if not pose.is_finite():
            return failure("bad_input", f"the pose of a hotspot must be finite, not {pose}")
        if self.hotspots.get(label) is None and len(self.hotspots) >= MAX_HOTSPOTS:
            return failure("bad_input", f"there are {MAX_HOTSPOTS} hotspots already; move one of them")
        problem = None if self.map is None else self.map.problem_with_standing(pose.x, pose.y)
        if problem is not None:
            where = f"({pose.x:.2f} m, {pose.y:.2f} m) is {problem}"
            return failure("bad_input", f"{where}; a place where the robot can stand would be stored")
        known = self.hotspots.get(label)
        kind = kind_of_new(label, self._room_names)
        hotspot = replace(known, pose=pose) if known else Hotspot(label, pose, kind)
        self.hotspots.put(hotspot)
        return success(hotspot=hotspot)

    def get_user_room(self) -> Result:
        """Run the skill ``get_user_room``."""
        if self.user is None:
            return failure("user_unknown", USER_UNKNOWN)
        assert self._last_seen is not None  # set together with the user
        age = max(0.0, self._clock.now() - self._last_seen.at)
        return success(room=self.room_of_pose(self.user), source=self._last_seen.source, age=age)

    def get_hotspot(self, label: str) -> Result:
        """Run the skill ``get_hotspot``."""
        hotspot = self.hotspots.get(label)
        if hotspot is None:
            return failure("unknown_hotspot", self.hotspots.unknown(label))
        return success(pose=hotspot.pose)

    def get_views(self, room: str) -> Result:
        """Run the skill ``get_views``.

        Args:
            room: The label of its hotspot.
        """
        hotspot = self.hotspots.get(room)
        if hotspot is None:
            return failure("unknown_room", self.hotspots.unknown(room))
        return success(poses=tuple(self._views(hotspot)))

    def _views(self, room: Hotspot) -> Iterable[Pose2]:
        if self.map is None:
            return [room.pose]
        from florence_bt.skills.locator.views import views  # loads scipy

        return views(room.pose, lambda x, y: self.room_of(x, y) == room.label, self.map)

    def likely_rooms(self) -> tuple[str, ...]:
        """Return every room, in the order in which to look for the user.

        First the room where the user was last known to be, then those where the user was on most days at this
        hour, then the nearest to the robot and to the room before, by the straight line to their hotspots.
        """
        here, believed, now = self.robot, self.room_of_pose(self.user), self._clock.now()

        def order(room: Hotspot) -> tuple[bool, int, float]:
            distance = here.distance_to(room.pose) if here is not None else 0.0
            return room.label != believed, -self.habits.count(room.label, now), distance

        left, ordered = list(self.hotspots.rooms()), []
        while left:
            room = min(left, key=order)
            left.remove(room)
            ordered.append(room.label)
            here = room.pose if here is not None else None
        return tuple(ordered)

    def take_run_state(self, state: str) -> None:
        """Take over the state of the most recent mission run; an unknown word is kept as it is."""
        self._run_state = state

    @property
    def status(self) -> str:
        """The navigation status in move_base's words."""
        return STATUS_OF_RUN_STATE.get(self._run_state, self._run_state)

    def why_not_goto_user(self) -> str | None:
        """Tell why the robot cannot be sent to the user now, or None when it can."""
        return self._override_reason() or (USER_UNKNOWN if self.user is None else None)

    def why_not_goto_room(self, label: str) -> str | None:
        """Tell why the robot cannot be sent to a hotspot now, or None when it can."""
        hotspot = self.hotspots.get(label)
        if hotspot is None:
            return self._override_reason() or self.hotspots.unknown(label)
        return self._override_reason() or self._why_no_goal(f"the hotspot {label!r}", hotspot.pose)

    def why_not_goto_pose(self, pose: Pose2) -> str | None:
        """Tell why the robot cannot be sent to a pose now, or None when it can."""
        if not pose.is_finite():
            return self._override_reason() or f"the goal must be finite, not {pose}"
        return self._override_reason() or self._why_no_goal("the goal", pose)

    def _why_no_goal(self, what: str, pose: Pose2) -> str | None:
        """Tell why navigation and ``florence check --map`` refuse a place that the map does not know."""
        problem = self._off_the_map(pose)
        return problem and f"{what} at ({pose.x:.2f} m, {pose.y:.2f} m) is {problem}"

    def _override_reason(self) -> str | None:
        if self.override:
            return "the manual override is on: send False on manualOverride first"
        return None
