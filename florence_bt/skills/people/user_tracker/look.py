"""A look for a person: the nearest one that is seen for long enough, or nobody within the window.

A look ends as soon as it is decided: nobody is there when enough pictures show nothing that may be a person.
A look with too few pictures to decide says so: that is not the same as nobody being there. Nor is it when the
camera does not see the place free where they should be: from nearby it does not see everybody, and something
may be in between.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.sensing import TrackedUser
from florence_bt.skills.people.user_tracker.camera_view import UPRIGHT, CameraView
from florence_bt.skills.people.user_tracker.laser_view import LaserView
from florence_bt.skills.people.user_tracker.parameters import LookParameters

_REMEMBERED_S = 60.0
"""Age at which the place where somebody was found says nothing any more."""
_FLOOR_M, _BODY_M = 0.05, 0.25
"""Height of the floor at most, and thickness of somebody who lies; metres."""
_Sample = tuple[float, TrackedUser]
"""Time and what the tracker said."""

GOAL_LIMITS = {
    "window": Port(Kind.DURATION, "", 5.0, 0.5, 15.0),
    "user_id": Port(Kind.INTEGER, "", 0, 0),
    **dict.fromkeys(("x", "y"), Port(Kind.LENGTH, "", 0.0)),
}
"""Limits of a goal of look_for_user, whoever sends it; a window of 0 is the default."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """The person to look for.

    Attributes:
        user_id: The persistent id; 0 for anybody.
        x: In front of the robot, metres.
        y: To its left, metres; both 0 for anywhere.
    """

    user_id: int = 0
    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class _Place:
    """The place where somebody was found.

    Attributes:
        x: Map frame, metres.
        y: The same.
        heights: Between them, above the floor, they would be seen, metres.
        found: When they were found there, seconds.
        stands: Whether they may have stood: of who sits or lies the laser sees the sofa or nothing.
    """

    x: float
    y: float
    heights: tuple[float, float]
    found: float
    stands: bool


def _heights_of(user: TrackedUser) -> tuple[float, float]:
    if user.posture != "lying":
        return UPRIGHT
    return max(_FLOOR_M, user.height - _BODY_M), user.height


class LookForUser:
    """Decides whom the robot has found.

    Args:
        parameters: When a person counts as seen.

    Source:
        REFERENCE 12.2, steps 6 and 7.
    """

    def __init__(self, parameters: LookParameters | None = None) -> None:
        self._params = parameters or LookParameters()
        self._samples: dict[int, list[_Sample]] = {}
        self._certain: set[int] = set()
        self._robot: Pose2 | None = None
        self._started = 0.0
        self._window = 0.0
        self._pictures = 0
        self._first_picture: float | None = None
        self._undecided = False
        self._wanted = Wanted()
        self._found_at: dict[int, _Place] = {}
        self._free_pictures = 0
        self._laser: LaserView | None = None

    @property
    def started(self) -> float:
        """Return when the look began, seconds; pictures of before are none of it."""
        return self._started

    @property
    def deadline(self) -> float:
        """The moment at which the look ends in any case, seconds."""
        return self._started + self._window

    @property
    def pictures(self) -> int:
        """Count the pictures that were looked at so far."""
        return self._pictures

    @property
    def users_seen(self) -> int:
        """Count the people who were seen so far."""
        return len(self._samples)

    def start(self, now: float, window_s: float, wanted: Wanted | None = None) -> None:
        """Begin a look of at most some seconds, for anybody or for one person."""
        self._started, self._window = now, window_s
        self._wanted = wanted or Wanted()
        self._samples = {}
        self._robot = None
        self._pictures = 0
        self._first_picture = None
        self._undecided = False
        self._free_pictures = 0

    def feed(
        self,
        now: float,
        users: Sequence[TrackedUser],
        robot: Pose2 | None = None,
        *,
        undecided: bool = False,
        view: CameraView | None = None,
    ) -> None:
        """Take the confirmed people of a picture.

        Args:
            now: The time of the picture, seconds; not before :attr:`started`.
            users: Whom it shows, map frame; those out of range or not finite do not count.
            robot: Where the robot is, map frame; gives the person's yaw its meaning.
            undecided: Whether there is something else in view that may be a person.
            view: What the picture says of places, map frame; without it the camera sees no place free.
        """
        self._pictures += 1
        self._first_picture = now if self._first_picture is None else self._first_picture
        self._undecided = undecided or bool(users)
        self._robot = robot or self._robot
        for user in users:
            if self._in_range(user.distance) and self._is_wanted(user):
                self._samples.setdefault(user.user_id, []).append((now, user))
        place = self._expected()
        if place is not None:
            through = self._laser is not None and place.stands and self._laser.is_free(place.x, place.y)
            seen = view is not None and view.is_free(place.x, place.y, place.heights)
            self._free_pictures += through or seen

    def saw_scan(self, laser: LaserView) -> None:
        """Take a scan of the laser: from nearby it sees the legs of whom the camera does not."""
        self._laser = laser

    def result(self, now: float) -> Result | None:
        """Return the end of the look, or None while it goes on.

        Returns:
            Success with ``user`` (its yaw points to the robot, 0 when the robot's pose is not known),
            ``distance``, ``user_id``, ``posture`` and ``height``; ``no_user_seen``; ``user_not_in_view`` when
            a place was asked for, or somebody who was found before, and that place is not seen free; or
            ``no_image`` when there were too few pictures to see anybody.
        """
        seen = {key: each for key, each in self._samples.items() if self._counts(each)}
        settled = any(each[-1][0] - each[0][0] >= self._params.settle_s for each in seen.values())
        if seen and (settled or now >= self.deadline):
            return self._found(seen)
        if now >= self.deadline or (not self._samples and self._is_empty(now)):
            return self._nobody(now)
        firsts = [each[0][0] for each in self._samples.values()]
        uncertain = bool(firsts) and not seen and now - min(firsts) >= self._params.uncertain_s
        return self._nobody(now) if uncertain else None

    def _counts(self, samples: Sequence[_Sample]) -> bool:
        """Tell whether somebody was seen often enough, and for certain."""
        if len(samples) < self._params.minimum_pictures:
            return False
        user_id = samples[0][1].user_id
        if statistics.median(user.confidence for _, user in samples) >= self._params.certain:
            self._certain.add(user_id)
        return bool(self._wanted.user_id) or user_id in self._certain

    def _is_empty(self, now: float) -> bool:
        """Tell whether enough pictures have shown nothing that may be a person."""
        if self._first_picture is None or self._undecided or self._pictures < self._params.enough_pictures:
            return False
        return now - self._first_picture >= self._params.settle_s

    def _nobody(self, now: float) -> Result:
        if self._pictures >= self._params.enough_pictures:
            seconds = min(now, self.deadline) - self._started
            nobody = f"no user seen within {seconds:.1f} s in {self._pictures} images"
            if self._expected() is None:
                return failure("no_user_seen", nobody)
            if 2 * self._free_pictures >= self._pictures:
                return failure("no_user_seen", f"{nobody}, and the place where they were is free")
            return failure("user_not_in_view", f"{nobody}, but the camera does not see their place free")
        return failure(
            "no_image",
            f"{self._pictures} usable images within {self._window:g} s, "
            f"{self._params.enough_pictures} would have been enough to see somebody",
        )

    def _expected(self) -> _Place | None:
        """Return where who is looked for should be; None when that is not known."""
        wanted = self._wanted
        known = {
            user_id: place
            for user_id, place in self._found_at.items()
            if self._started - place.found <= _REMEMBERED_S
        }
        if self._robot is None or not (wanted.x or wanted.y):
            return known.get(wanted.user_id)
        x, y = self._robot.apply(wanted.x, wanted.y)
        tolerance = self._params.place_tolerance
        there = [each for each in known.values() if self._beside_place(each.x, each.y) <= tolerance]
        heights, stands = (there[-1].heights, there[-1].stands) if there else (UPRIGHT, False)
        return _Place(x, y, heights, self._started, stands)

    def _in_range(self, distance: float) -> bool:
        return self._params.nearest <= distance <= self._params.farthest

    def _far(self, user: Sequence[TrackedUser]) -> tuple[float, float]:
        """Return what is least for the person meant: metres from the place asked for, then the camera."""
        beside = statistics.median(self._beside_place(each.x, each.y) for each in user)
        return beside, statistics.median(each.distance for each in user)

    def _is_wanted(self, user: TrackedUser) -> bool:
        if not (math.isfinite(user.x) and math.isfinite(user.y)):
            return False
        return (
            self._wanted.user_id in (0, user.user_id)
            and self._beside_place(user.x, user.y) <= self._params.place_tolerance
        )

    def _beside_place(self, x: float, y: float) -> float:
        """Return how far somebody (map frame) is from the place that was asked for; 0 where none was."""
        wanted, robot = self._wanted, self._robot
        if robot is None or not (wanted.x or wanted.y):
            return 0.0
        return math.dist(robot.apply(wanted.x, wanted.y), (x, y))

    def _found(self, seen: dict[int, list[_Sample]]) -> Result:
        users = {key: [user for _, user in each] for key, each in seen.items()}
        user_id = min(users, key=lambda key: self._far(users[key]))
        mine = users[user_id]
        x, y = statistics.median(user.x for user in mine), statistics.median(user.y for user in mine)
        yaw = math.atan2(self._robot.y - y, self._robot.x - x) if self._robot else 0.0
        self._found_at.pop(user_id, None)  # the latest stands last
        stands = all(user.posture not in ("sitting", "lying") for user in mine)
        self._found_at[user_id] = _Place(x, y, _heights_of(mine[-1]), self._started, stands)
        return success(
            user=Pose2(x, y, yaw),
            distance=statistics.median(user.distance for user in mine),
            user_id=user_id,
            posture=mine[-1].posture,
            height=mine[-1].height,
        )
