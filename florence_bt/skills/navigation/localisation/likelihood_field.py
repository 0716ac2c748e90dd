"""The likelihood field: how far each place of the map is from the nearest surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from florence_bt.core.sensing import OccupancyGrid

OCCUPIED_FROM = 65
"""Map values from here on are surfaces (a map of kind "scale" has values between)."""


@dataclass(frozen=True, slots=True)
class LikelihoodField:
    """Distances to the nearest surface over the cells of a map.

    Attributes:
        resolution: Metres per cell.
        origin_x: Outer corner of cell [0, 0] in the map frame.
        origin_y: Outer corner of cell [0, 0] in the map frame.
        signed: Shape (rows, columns), float32, metres; above zero in front of a surface, below zero inside
            of what the map says is solid; cut at the greatest distance.
        normals: Shape (rows, columns, 2), float32: where the nearest surface looks, length 1; 0 where that is
            to both sides, in the middle of a wall, or farther than the greatest distance.
        max_distance: Where the distances are cut, in metres.
    """

    resolution: float
    origin_x: float
    origin_y: float
    signed: NDArray[np.float32]
    normals: NDArray[np.float32]
    max_distance: float

    @property
    def frame(self) -> tuple[float, float, float]:
        """origin_x, origin_y and resolution, for the kernels."""
        return self.origin_x, self.origin_y, self.resolution


def build_likelihood_field(
    grid: OccupancyGrid, max_distance: float, surface_offset: float = 0.5
) -> LikelihoodField:
    """Measure the distances of a map.

    Args:
        grid: The map.
        max_distance: Where to cut, in metres (likelihood_max_dist).
        surface_offset: How far the true surface lies in front of the centres of the occupied cells, in
            cells. 0.5 says that it is the border between free and occupied cells; a robot that sees walls
            from one side only would be off by this much.

    Returns:
        The field. Without any occupied cell every distance is the greatest.

    Source:
        REFERENCE 7.7; Thrun, Burgard, Fox: Probabilistic Robotics, section 6.4.
    """
    solid = grid.cells >= OCCUPIED_FROM
    if not solid.any():
        signed = np.full(grid.cells.shape, max_distance)
    else:
        outside = distance_transform_edt(~solid) - surface_offset
        inside = distance_transform_edt(solid) - (1.0 - surface_offset)
        signed = np.where(solid, -inside, outside) * grid.resolution
    signed = np.clip(signed, -max_distance, max_distance)
    return LikelihoodField(
        resolution=grid.resolution,
        origin_x=grid.origin.x,
        origin_y=grid.origin.y,
        signed=np.ascontiguousarray(signed, np.float32),
        normals=_directions(signed),
        max_distance=max_distance,
    )


def _directions(signed: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the directions in which distances grow, shape (rows, columns, 2): unit vectors x, y, or 0."""
    if min(signed.shape) < 2:
        return np.zeros((*signed.shape, 2), np.float32)
    along_y, along_x = np.gradient(signed)
    gradient = np.stack([along_x, along_y], axis=-1)
    length = np.linalg.norm(gradient, axis=-1, keepdims=True)
    return np.divide(gradient, length, out=np.zeros_like(gradient), where=length > 1e-9).astype(np.float32)
