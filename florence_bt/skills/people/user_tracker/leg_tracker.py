"""The legs in laser scans of people whom the camera does not see at the moment.

The camera knows who somebody is; the laser sees further round the robot, and cannot tell whose legs it sees.

Source:
    REFERENCE 12.7; document, section 4.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.skills.filters.legs.leg_detector import REACH_M, all_legs, legs_near, of_nobody_known
from florence_bt.skills.filters.legs.walking_legs import WalkingLegs
from florence_bt.skills.people.user_tracker.standing_things import StandingThings
from florence_bt.skills.people.user_tracker.track import Track

_CAMERA_GAP_S = 0.3
"""Time without a sight by the camera after which the laser goes on."""
_LEGS_ALONE_S, _EXPECTED_S = 6.0, 0.7
"""So long after the camera saw somebody, legs count as theirs that are where they should be; nobody knows
where that is of whom nothing was noticed for the second time."""
_WALKING_LEGS_S, _HIDDEN_S, _TURNED_MPS = 15.0, 4.0, 0.6
"""So long after the camera saw somebody, legs count as theirs that walk, hidden for so long at most, and so
much further away from where they should be each second."""
_KNOWN_S = 1.0
"""Of whom something was noticed within this time the place is known."""


class LegTracker:
    """Finds in each scan the legs of people who are tracked. All places are in the frame of the tracker."""

    def __init__(self) -> None:
        self._things = StandingThings()
        self._walking = WalkingLegs()

    def saw(
        self, now: float, unmapped: NDArray[np.float64], robot: Pose2, tracks: Sequence[Track]
    ) -> list[Track]:
        """Move on to their legs the people whom the camera does not see.

        Args:
            now: The time of the scan, seconds.
            unmapped: Where beams end at nothing of the map, in the order of the scan, shape (n, 2), metres.
            robot: The robot.
            tracks: The people.

        Returns:
            Those whose legs were seen.
        """
        legs = all_legs(unmapped)
        self._walking.saw(now, legs)
        found = [track for track in tracks if self._go_on(now, track, unmapped, robot, tracks)]
        known = [track.place for track in tracks if now - track.noticed < _CAMERA_GAP_S]
        if known:
            self._things.saw(now, legs, known)
        return found

    def _go_on(
        self,
        now: float,
        track: Track,
        unmapped: NDArray[np.float64],
        robot: Pose2,
        tracks: Sequence[Track],
    ) -> bool:
        unseen, unnoticed = now - track.seen, now - track.noticed
        if unseen < _CAMERA_GAP_S:
            return False
        place = None
        if unseen <= _LEGS_ALONE_S and unnoticed <= _EXPECTED_S:
            place = legs_near(self._things.without(unmapped), robot, track.expected(now))
        if place is None and unseen <= _WALKING_LEGS_S and _CAMERA_GAP_S <= unnoticed <= _HIDDEN_S:
            others = [
                other.place for other in tracks if other is not track and now - other.noticed <= _KNOWN_S
            ]
            place = self._walking_legs(now, track, others)
        if place is not None:
            track.take_legs(place, now)
        return place is not None

    def _walking_legs(self, now: float, track: Track, others: Sequence[Point2]) -> Point2 | None:
        """Return the nearest legs that walk, of somebody who turned a corner or was hidden."""
        expected, reach = track.expected(now), REACH_M + _TURNED_MPS * (now - track.noticed)
        walking = of_nobody_known(self._walking.places(now), others)
        near = [place for place in walking if math.dist(place, expected) <= reach]
        return min(near, key=lambda place: math.dist(place, expected), default=None)
