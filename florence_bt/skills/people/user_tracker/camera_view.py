"""The view of a place in a depth picture: something is there, it is free, or it is not in the picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker.person_network import Pixels

_LOW, _HIGH = 0.3, 1.9
_REACH = 0.3
_PIXELS = 20
"""Heights above the floor and the reach around its middle of what stands at a place, metres; so many pixels
of the network's input show it."""
_BODY_M = 0.15
"""Half the breadth of a body: so far to either side of its middle it is looked whether a place is free."""
UPRIGHT = (0.4, 1.1)
"""Heights above the floor between which whoever stands or sits would be seen, metres."""
_BEYOND_M = 0.2
"""Distance beyond the middle of a place at which things seen through it show that nobody is there."""
_FREE = 0.7
"""So large a part of the pixels that look at a place must look through it. Chosen: the back of an armchair
and somebody half beside the place take a part of them."""


@dataclass(frozen=True, slots=True)
class CameraView:
    """The view of a camera: from where a picture was taken, and what it says of a place.

    Attributes:
        camera: Place and heading of the camera in the frame of the tracker.
        shows: Whether something stands at a place (x, y) of this frame, and is seen.
        is_free: Whether a place (x, y) of this frame is in the picture, and between two heights above the
            floor, metres, nobody is there.
    """

    camera: Pose2
    shows: Callable[[float, float], bool]
    is_free: Callable[[float, float, tuple[float, float]], bool] = lambda x, y, heights: False

    def moved_by(self, frame: Pose2) -> CameraView:
        """Return the same view in the frame above; ``frame`` is the pose of its own frame there."""
        back = frame.inverse()
        return CameraView(
            frame @ self.camera,
            lambda x, y: self.shows(*back.apply(x, y)),
            lambda x, y, heights: self.is_free(*back.apply(x, y), heights),
        )


def view_of(depth: DepthImage, optical_in_base: Transform3, robot: Pose2) -> CameraView:
    """Return the view of a depth picture.

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

    def is_free(x: float, y: float, heights: tuple[float, float]) -> bool:
        at = robot.inverse().apply(x, y)
        away = math.hypot(at[0] - place[0], at[1] - place[1])
        towards = (at[0] - place[0]) / max(away, 1e-6), (at[1] - place[1]) / max(away, 1e-6)
        pixels = Pixels.of(depth, optical_in_base)
        x, y, z = pixels.along
        forward = x * towards[0] + y * towards[1]
        ahead = forward > 0.0
        to_place = away / np.where(ahead, forward, 1.0)
        beside = np.abs(y * towards[0] - x * towards[1]) * to_place
        height = place[2] + z * to_place
        looked_at = ahead & (beside < _BODY_M) & (height > heights[0]) & (height < heights[1])
        # Where nothing was measured nothing is seen: of who is too near, or in the sun.
        through = looked_at & (pixels.depth * forward > away + _BEYOND_M)
        return int(through.sum()) >= max(_PIXELS, _FREE * int(looked_at.sum()))

    return CameraView(camera, shows, is_free)
