"""The people whom the user tracker has seen lately, and who of them is where."""

from __future__ import annotations

import math

import numpy as np

from florence_bt.core.geometry import Point2
from florence_bt.skills.navigation.navigate.people import People, PeopleParameters
from florence_bt.skills.navigation.navigate.person_track import PersonTrack
from florence_bt.skills.navigation.navigate.vacated_cells import FASTEST_WALK_MPS

_STANDING_MPS = 0.2
"""A person who seems to walk slower may stand. Chosen."""
_SAME_M = 0.3
"""Two people are not so near to each other."""
_REMEMBERED_S = 30.0
"""Age up to which the sight of a person can be followed."""
_OTHERS_S = 10.0
"""For so long it is remembered where somebody was who is not followed."""


class PeopleTracks:
    """One track of each person. All places are in the odometry frame.

    Args:
        parameters: How long to remember them.
        coast: Of each :class:`PersonTrack`.
    """

    def __init__(self, parameters: PeopleParameters, coast: float) -> None:
        self._p, self._coast = parameters, coast
        self._tracks: dict[int, PersonTrack] = {}

    def saw(self, stamp: float, user_id: int, x: float, y: float) -> None:
        """Note that the tracker saw somebody; ignore what is not newer, or not finite."""
        self.of(user_id).saw(stamp, x, y)

    def of(self, user_id: int) -> PersonTrack:
        """Return the track of a person, which is empty when they were not seen lately."""
        if user_id not in self._tracks:
            self._tracks[user_id] = PersonTrack(self._p.people_velocity_time, self._coast)
        return self._tracks[user_id]

    def forget(self, now: float, but: int | None = None) -> None:
        """Forget who was not seen for long, or after ``now``: the clock was set back; keep one of them."""
        self._tracks = {
            who: track
            for who, track in self._tracks.items()
            if who == but or (track.seen is not None and 0.0 <= now - track.seen <= _REMEMBERED_S)
        }

    def others(self, user_id: int, now: float) -> list[Point2]:
        """Return where everybody but one person was a moment ago, metres."""
        return [
            place
            for who, track in self._tracks.items()
            if who != user_id
            for place in track.path.since(now - _OTHERS_S)
        ]

    def people(self, now: float, without: int | None = None, place: Point2 | None = None) -> People:
        """Return where people are now.

        Args:
            now: Seconds.
            without: The id of somebody to leave out.
            place: Where they are: the tracker may have given them another id.
        """
        rows = [
            self._row(track, now)
            for who, track in self._tracks.items()
            if who != without and track.is_seen(now, self._p.people_keep_time)
        ]
        if place is not None:
            rows = [row for row in rows if math.dist(row[:2], place) > _SAME_M]
        return People(np.array(rows).reshape(-1, 5), self._p)

    def _row(self, track: PersonTrack, now: float) -> tuple[float, ...]:
        assert track.seen is not None
        share = min(1.0, FASTEST_WALK_MPS / track.speed) if track.speed >= _STANDING_MPS else 0.0
        vx, vy = (share * part for part in track.velocity)
        (x, y), age = track.last, max(0.0, now - track.seen)
        return x + vx * age, y + vy * age, vx, vy, self._p.people_distance
