"""People in a depth picture: the truth of those pixels that the network for people answers for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.sensors._camera_kernels import cast_image
from florence_bt.simulation.sensors.scene import Lens, RayScene, Shapes

GRID = (60, 80)
"""Rows and columns of the network's answers."""


@dataclass(frozen=True, slots=True)
class PeopleView:
    """The people in a picture.

    Attributes:
        robot: Where it was taken: base_footprint in the map frame.
        camera: Where the camera was, map frame, metres.
        shows: Given a name: which of the answers' pixels are measured and show that person, shape (60, 80).
        whole: Given a name: how many would if nothing were in front of them.
    """

    robot: Pose2
    camera: tuple[float, float]
    shows: Callable[[str], NDArray[np.bool_]]
    whole: Callable[[str], int]


def people_view(
    scene: RayScene,
    robot: Pose2,
    place: Transform3,
    lens: Lens,
    picture: tuple[NDArray[np.float32], NDArray[np.int16]],
    measured: tuple[float, float],
) -> PeopleView:
    """Return the people in a picture.

    Args:
        scene: What was there.
        robot: Where it was taken.
        place: The camera in the map frame.
        lens: Of the picture.
        picture: Its depths and the rows of the scene, each of the size of the picture.
        measured: The smallest and the largest depth that is measured, metres.
    """
    depth, rows = picture
    step = depth.shape[0] // GRID[0]
    seen, depth = rows[::step, ::step], depth[::step, ::step]
    is_measured = (depth >= measured[0]) & (depth <= measured[1])
    names = np.array([*scene.names, ""])

    def shows(name: str) -> NDArray[np.bool_]:
        return (names == name)[seen] & is_measured

    def whole(name: str) -> int:
        mine = np.flatnonzero(names[:-1] == name)
        alone = Shapes._make(values[mine] for values in scene.shapes)
        depths, owners = np.empty(GRID, np.float32), np.empty(GRID, np.int16)
        smaller = Lens(*(value / step for value in lens))
        rotation = np.ascontiguousarray(place.rotation)
        cast_image(alone, place.translation, rotation, smaller, measured[1], depths, owners)
        return int(((depths >= measured[0]) & (depths <= measured[1])).sum())

    x, y, _ = place.translation.tolist()
    return PeopleView(robot, (x, y), shows, whole)
