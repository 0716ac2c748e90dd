"""The shapes that sensors can see, as plain arrays for ray casting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

PLANE, SPHERE, CYLINDER, BOX = 0, 1, 2, 3
"""Kinds of shapes. A plane is infinite, with its z axis up."""

Surface = Literal["plain", "glass", "mirror"]
SURFACES: dict[Surface, int] = {"plain": 0, "glass": 1, "mirror": 2}
"""Surfaces, by what light does at them: it comes back, goes through, or is reflected
(:mod:`_surface_kernels`)."""


class Shapes(NamedTuple):
    """Shapes by row. A tuple, because compiled functions take it as it is.

    Attributes:
        kind: Shape (n,), int8: ``PLANE``, ``SPHERE``, ``CYLINDER`` (about its z axis) or ``BOX``.
        position: Shape (n, 3), centres in the map frame, metres.
        rotation: Shape (n, 3, 3), from the shape's to the map frame.
        size: Shape (n, 3), metres: (radius, 0, 0), (radius, half height, 0) or half sides.
        reach: Shape (n,), radius of the sphere around the shape, metres; infinite for a plane.
        colour: Shape (n, 3), uint8, red green blue.
        surface: Shape (n,), int8, a value of ``SURFACES``.
    """

    kind: NDArray[np.int8]
    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    size: NDArray[np.float64]
    reach: NDArray[np.float64]
    colour: NDArray[np.uint8]
    surface: NDArray[np.int8]


class Lens(NamedTuple):
    """A pinhole camera: its focal length, and where its optical axis meets the image, in pixels."""

    focal: float
    cx: float
    cy: float


@dataclass(frozen=True, slots=True)
class RayScene:
    """The scene that rays meet: everything but the robot; people's rows change as they walk, all others stay.

    Attributes:
        shapes: What there is.
        names: What each row belongs to: a wall, a piece of furniture or a person.
    """

    shapes: Shapes
    names: Sequence[str]


def reach_of(kind: NDArray[np.int8], size: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the radius of the sphere around each shape, shape (n,), metres."""
    reach = np.linalg.norm(size, axis=1)
    reach[kind == PLANE] = np.inf
    return reach
