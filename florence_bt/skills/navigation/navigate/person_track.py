"""The track of a person (place, walk and way they came) from the sights of the user tracker."""

from __future__ import annotations

import math

import numpy as np

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.skills.navigation.navigate.person_trail import PersonTrail

_WALKING_MPS = 0.1
"""Slower, the direction in which somebody walks means nothing."""


class PersonTrack:
    """A person. All places are in the odometry frame, metres.

    Args:
        velocity_time: The velocity is averaged over about this long, in seconds.
        coast: They count as in sight for so long after they were seen, in seconds.

    Attributes:
        seen: The time they were seen last, seconds; None before.
        path: The way they walked.
        velocity: m/s.
    """

    def __init__(self, velocity_time: float, coast: float) -> None:
        self._time, self._coast = velocity_time, coast
        self._place: Point2 = (0.0, 0.0)
        self.velocity: Point2 = (0.0, 0.0)
        self.seen: float | None = None
        self.path = PersonTrail()

    def saw(self, stamp: float, x: float, y: float) -> None:
        """Note that the person was seen; ignore what is not newer, or not finite."""
        if not np.isfinite([stamp, x, y]).all() or (self.seen is not None and stamp <= self.seen):
            return
        if self.seen is not None:
            passed = stamp - self.seen
            share = passed / (passed + self._time)
            vx, vy = self.velocity
            moved = (x - self._place[0]) / passed, (y - self._place[1]) / passed
            self.velocity = (1.0 - share) * vx + share * moved[0], (1.0 - share) * vy + share * moved[1]
        self._place, self.seen = (x, y), stamp
        self.path.saw(stamp, self._place)

    def is_seen(self, now: float, seconds: float | None = None) -> bool:
        """Tell whether they were seen in the last seconds, by default as long as they count as in sight."""
        return self.seen is not None and now - self.seen <= (self._coast if seconds is None else seconds)

    @property
    def last(self) -> Point2:
        """Give the place where they were seen last."""
        assert self.seen is not None
        return self._place

    def at(self, now: float) -> Point2:
        """Return where they should be now, walking on for a moment when they are not seen."""
        assert self.seen is not None
        passed = min(self._coast, max(0.0, now - self.seen))
        return self._place[0] + self.velocity[0] * passed, self._place[1] + self.velocity[1] * passed

    def suppose(self, now: float, place: Point2) -> None:
        """Suppose that since they were last seen they have walked straight to a place, and walk on."""
        assert self.seen is not None and now > self.seen
        passed = now - self.seen
        self.velocity = (place[0] - self._place[0]) / passed, (place[1] - self._place[1]) / passed
        self._place = place

    @property
    def speed(self) -> float:
        """m/s."""
        return math.hypot(*self.velocity)

    @property
    def walks(self) -> bool:
        """Tell whether they walk, or nearly stand."""
        return self.speed >= _WALKING_MPS

    def walks_away(self, robot: Pose2, bearing: float) -> float:
        """Return how fast they walk away from the robot, m/s; ``bearing`` is theirs (rad)."""
        (vx, vy), heading = self.velocity, robot.yaw + bearing
        return math.cos(heading) * vx + math.sin(heading) * vy
