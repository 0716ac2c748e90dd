"""Where somebody was seen from far away, and from nearby something else stands: a plant, a coat stand.

From far away it would be taken for a person again and again, and each time the robot would drive there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.parameters import TrackerParameters
from florence_bt.skills.people.user_tracker.person_network import Pixels

_BEARING = math.radians(20.0)
"""So far from its axis the camera sees the whole of what stands nearby."""
_LOW, _HIGH = 0.3, 1.9
_REACH = 0.3
_PIXELS = 20
"""Heights above the floor and the reach around its middle of what stands at a place, metres; so many pixels
of the network's input show it."""


@dataclass(frozen=True, slots=True)
class CameraView:
    """From where a picture was taken, and what stands there.

    Attributes:
        camera: Place and heading of the camera in the frame of the tracker.
        shows: Whether something stands at a place (x, y) of this frame, and is seen.
    """

    camera: Pose2
    shows: Callable[[float, float], bool]


def view_of(depth: DepthImage, optical_in_base: Transform3, robot: Pose2) -> CameraView:
    """The view of a depth picture.

    Args:
        depth: The picture.
        optical_in_base: Takes points of the optical frame to the robot frame.
        robot: The robot in the frame of the tracker.
    """
    ahead = optical_in_base.rotation[:2, 2]
    place = optical_in_base.translation
    camera = robot @ Pose2(float(place[0]), float(place[1]), math.atan2(ahead[1], ahead[0]))

    def shows(x: float, y: float) -> bool:
        at = robot.inverse().apply(x, y)
        points = Pixels.of(depth, optical_in_base).points
        near = np.hypot(points[..., 0] - at[0], points[..., 1] - at[1]) < _REACH
        return int((near & (points[..., 2] > _LOW) & (points[..., 2] < _HIGH)).sum()) >= _PIXELS

    return CameraView(camera, shows)


@dataclass(slots=True)
class _Place:
    x: float
    y: float
    until: float
    misses: int = 0


class RejectedPlaces:
    """Remembers them for a while.

    Args:
        parameters: Those that begin with ``reject``.
    """

    def __init__(self, parameters: TrackerParameters) -> None:
        self._use = parameters
        self._places: list[_Place] = []

    def seen(self, now: float, x: float, y: float) -> None:
        """Somebody is seen at a place."""
        place = self._at(x, y)
        if place is None:
            self._places.append(_Place(x, y, now + self._use.reject_s))
        else:
            place.x, place.y, place.until, place.misses = x, y, now + self._use.reject_s, 0

    def looked(self, now: float, view: CameraView, found: Sequence[Detection]) -> None:
        """Take what a picture shows of the places where somebody was seen."""
        self._places = [place for place in self._places if now < place.until]
        radius = self._use.reject_radius
        for place in self._places:
            if place.misses < self._use.reject_pictures and self._is_near(place, view.camera):
                empty = all(math.dist((place.x, place.y), (each.x, each.y)) > radius for each in found)
                place.misses = place.misses + 1 if empty and view.shows(place.x, place.y) else 0

    def rejects(self, x: float, y: float, distance: float) -> bool:
        """Whether what is seen at a place, from a distance, is the thing that stands there."""
        place = self._at(x, y)
        rejected = place is not None and place.misses >= self._use.reject_pictures
        return rejected and distance > self._use.reject_farthest

    def _at(self, x: float, y: float) -> _Place | None:
        return next(
            (
                place
                for place in self._places
                if math.dist((place.x, place.y), (x, y)) <= self._use.reject_radius
            ),
            None,
        )

    def _is_near(self, place: _Place, camera: Pose2) -> bool:
        x, y = camera.inverse().apply(place.x, place.y)
        near, far = self._use.reject_nearest, self._use.reject_farthest
        return near <= math.hypot(x, y) <= far and abs(math.atan2(y, x)) <= _BEARING
