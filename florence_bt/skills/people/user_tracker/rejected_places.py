"""Places where somebody was seen from far away, and from nearby something else stands: a plant, a coat stand.

From far away it would be taken for a person again and again, and each time the robot would drive there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from florence_bt.core.geometry import Pose2
from florence_bt.skills.people.user_tracker.camera_view import CameraView
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.parameters import TrackerParameters

_BEARING = math.radians(20.0)
"""So far from its axis the camera sees the whole of what stands nearby."""
_SURER = 0.03
"""Confidence above the thing's highest with which somebody is no thing. A coat stand 3.2 and 3.8 m away in
the simulation: 0.83 at most; who stands at its place: 0.91 and 0.83 on average."""


@dataclass(slots=True)
class _Place:
    """A place where somebody was seen.

    Attributes:
        x: In the frame of the tracker, metres.
        y: The same.
        until: When it is forgotten, seconds.
        surest: The greatest confidence of what was seen there.
        misses: How many pictures from nearby in a row have shown something else there ...
        missed_from: ... and from how far away, metres.
    """

    x: float
    y: float
    until: float
    surest: float
    misses: int = 0
    missed_from: float = 0.0


class RejectedPlaces:
    """Remembers them for a while.

    Args:
        parameters: Those that begin with ``reject``.
    """

    def __init__(self, parameters: TrackerParameters) -> None:
        self._params = parameters
        self._places: list[_Place] = []

    def seen(self, now: float, x: float, y: float, confidence: float) -> None:
        """Note that somebody is seen at a place, and stands there."""
        place = self._at(x, y)
        if place is None:
            self._places.append(_Place(x, y, now + self._params.reject_s, confidence))
            return
        place.x, place.y, place.until = x, y, now + self._params.reject_s
        place.misses, place.missed_from = 0, 0.0
        place.surest = max(place.surest, confidence)

    def looked(self, now: float, view: CameraView, found: Sequence[Detection]) -> None:
        """Take what a picture shows of the places where somebody was seen."""
        self._places = [place for place in self._places if now < place.until]
        for place in self._places:
            if place.misses < self._params.reject_pictures and self._is_well_in_view(place, view.camera):
                away = math.dist((place.x, place.y), (view.camera.x, view.camera.y))
                self._judge(place, now, away, view, found)

    def _judge(
        self, place: _Place, now: float, away: float, view: CameraView, found: Sequence[Detection]
    ) -> None:
        near = [each for each in found if self._is_at(place, each.x, each.y)]
        if near or not view.shows(place.x, place.y):
            place.misses, place.missed_from = 0, 0.0
        else:
            place.misses, place.missed_from = place.misses + 1, max(place.missed_from, away)
            place.until = now + self._params.reject_s

    def forget(self, x: float, y: float) -> None:
        """Forget the place where somebody stood who walked away."""
        self._places = [place for place in self._places if not self._is_at(place, x, y)]

    def rejects(self, sight: Detection, confidence: float) -> bool:
        """Tell whether who is seen somewhere is the thing that stands there.

        Args:
            sight: Where they were seen last.
            confidence: How sure the pictures that show them are on average. Surer than any picture of the
                thing was, it is somebody who stands at its place now.
        """
        place = self._at(sight.x, sight.y)
        if place is None or place.misses < self._params.reject_pictures:
            return False
        return sight.distance > place.missed_from and confidence <= place.surest + _SURER

    def _at(self, x: float, y: float) -> _Place | None:
        return next((place for place in self._places if self._is_at(place, x, y)), None)

    def _is_at(self, place: _Place, x: float, y: float) -> bool:
        return math.dist((place.x, place.y), (x, y)) <= self._params.reject_radius

    def _is_well_in_view(self, place: _Place, camera: Pose2) -> bool:
        x, y = camera.inverse().apply(place.x, place.y)
        near, far = self._params.reject_nearest, self._params.reject_farthest
        return near <= math.hypot(x, y) <= far and abs(math.atan2(y, x)) <= _BEARING
