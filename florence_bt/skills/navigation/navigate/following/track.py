"""Keeping track of the person: the camera knows who it is, the laser goes on with their legs."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.skills.navigation.navigate.legs import (
    REACH_M,
    all_legs,
    go_on_with_legs,
    of_nobody_known,
)
from florence_bt.skills.navigation.navigate.moving_target import CAMERA_GAP_S, MovingTarget
from florence_bt.skills.navigation.navigate.parameters import FollowParameters
from florence_bt.skills.navigation.navigate.person_trail import PersonTrail
from florence_bt.skills.navigation.navigate.standing_things import StandingThings
from florence_bt.skills.navigation.navigate.walking_legs import WalkingLegs

PERSON_M = 0.6
"""What the sensors have marked so near to the person is the person."""
_WALKING_MPS = 0.1
"""Slower, the direction in which somebody walks means nothing."""
VIEW_RAD, VIEW_M = 0.35, (0.9, 3.5)
"""Somebody no further beside the middle of the camera's picture, and so far away, is seen whole."""
UNCLEAR_S = 1.5
"""Whom the camera does not know there for so long is somebody or something else."""
_WALKING_LEGS_S, _HIDDEN_S, _TURNED_MPS = 15.0, 4.0, 0.6
"""So long after the camera saw the person the robot goes on with legs that walk, hidden for so long at most,
and so much further away from where they should be each second."""
_OTHERS_S = 10.0
"""For so long it is remembered where somebody else was."""


def is_in_picture(robot: Pose2, place: Point2) -> bool:
    """Tell whether somebody at a place is in the middle of the camera's picture, and seen whole."""
    away = math.dist(place, (robot.x, robot.y))
    return abs(robot.bearing_to(*place)) < VIEW_RAD and VIEW_M[0] < away < VIEW_M[1]


class PersonTrack:
    """Where the person is, how they walk and which way they came. All places in the odometry frame, metres.

    Args:
        params: How long they count as in sight.
        now: Seconds.

    Attributes:
        path: The way they walked.
        things: What stands around and is not the person.
        walking: The legs that walk, of whomever.
        unknown: Where beams of the last scan end at nothing of the map, shape (n, 2).
        scanned: When that was, seconds.
        others: When and where other people were seen lately.
    """

    def __init__(self, params: FollowParameters, now: float) -> None:
        self._coast = params.follow_coast
        self._target = MovingTarget(params.follow_velocity_time)
        self._unclear_since = now
        self.path = PersonTrail()
        self.things = StandingThings()
        self.walking = WalkingLegs()
        self.others: list[tuple[float, Point2]] = []
        self.unknown, self.scanned = np.empty((0, 2)), -math.inf

    def saw(self, stamp: float, x: float, y: float) -> None:
        """Note that the camera saw the person; ``stamp`` in seconds."""
        self._target.recognise(stamp, x, y)
        self._note_place()

    def saw_scan(
        self, stamp: float, unknown: NDArray[np.float64], robot: Pose2, others: Sequence[Point2]
    ) -> None:
        """Go on with the legs in a scan while the camera does not see the person.

        Args:
            stamp: Seconds.
            unknown: Where beams end at nothing of the map, shape (n, 2).
            robot: The robot at that time.
            others: Where other people are.
        """
        self.unknown, self.scanned = unknown, stamp
        self.others = [each for each in self.others if stamp - each[0] <= _OTHERS_S]
        self.others += [(stamp, place) for place in others]
        legs = all_legs(unknown)
        self.walking.saw(stamp, legs)
        go_on_with_legs(self._target, stamp, self.things.without(unknown), robot, self._coast)
        if self._target.seen != stamp:
            self._go_on_with_walking_legs(stamp, others)
        self._note_place()
        if self._target.seen == stamp or self._target.is_recognised(stamp):
            self.things.saw(stamp, legs, self.last)

    def check_camera(self, now: float, robot: Pose2) -> None:
        """Reject legs in the middle of the picture where the camera sees no person."""
        if not self.is_seen(now):
            return
        place = self.at(now)
        target = self._target
        if not is_in_picture(robot, place) or target.recognised == target.seen:
            self._unclear_since = now
        elif now - self._unclear_since > UNCLEAR_S:
            self.walking.reject(target.at(now, 0.0))
            target.drop_laser()
            self.path.forget_since(target.seen or now)

    @property
    def seen(self) -> float | None:
        """When they were seen last, seconds; None before."""
        return self._target.seen

    def is_seen(self, now: float, seconds: float | None = None) -> bool:
        """Tell whether they were seen in the last seconds, by default as long as they count as in sight."""
        return self.seen is not None and now - self.seen <= (self._coast if seconds is None else seconds)

    @property
    def last(self) -> Point2:
        """Where they were seen last."""
        assert self.seen is not None
        return self._target.at(self.seen, 0.0)

    def at(self, now: float) -> Point2:
        """Return where they should be now, walking on for a moment when they are not seen."""
        return self._target.at(now, self._coast)

    def suppose(self, now: float, place: Point2) -> None:
        """Suppose that since they were last seen they have walked to a place."""
        self._target.suppose(now, *place)

    @property
    def velocity(self) -> tuple[float, float]:
        """m/s."""
        return self._target.velocity

    @property
    def speed(self) -> float:
        """m/s."""
        return math.hypot(*self.velocity)

    @property
    def walks(self) -> bool:
        """Whether they walk, or nearly stand."""
        return self.speed >= _WALKING_MPS

    def walks_away(self, robot: Pose2, bearing: float) -> float:
        """Return how fast they walk away from the robot, m/s; ``bearing`` is theirs (rad)."""
        (vx, vy), heading = self.velocity, robot.yaw + bearing
        return math.cos(heading) * vx + math.sin(heading) * vy

    def _go_on_with_walking_legs(self, stamp: float, others: Sequence[Point2]) -> None:
        """Take the nearest legs that walk for those of the person who turned a corner or was hidden."""
        target = self._target
        if target.seen is None or target.recognised is None or stamp - target.recognised > _WALKING_LEGS_S:
            return
        unseen = stamp - target.seen
        if not CAMERA_GAP_S <= unseen <= _HIDDEN_S:
            return
        expected = self.at(stamp)
        near = [
            place
            for place in of_nobody_known(self.walking.places(stamp), others)
            if math.dist(place, expected) <= REACH_M + _TURNED_MPS * unseen
        ]
        if near:
            target.saw(stamp, *min(near, key=lambda place: math.dist(place, expected)))

    def _note_place(self) -> None:
        if self.seen is not None:
            self.path.saw(self.seen, self.last)
