"""A room for a scanner that runs alone: four walls and a pillar."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.simulation.emulators._scip_device import ScannerModel

AHEAD_M, BEHIND_M, LEFT_M, RIGHT_M = 3.0, 1.0, 2.0, 1.5
PILLAR_X_M, PILLAR_Y_M, PILLAR_RADIUS_M = 1.5, 0.5, 0.15


class ScipRoom:
    """Distances from a scanner that stands still in a room, the same in every turn unless there is noise."""

    def __init__(self, model: ScannerModel, seed: int | None = None, noise_mm: float = 10.0) -> None:
        """Work the distances out.

        Args:
            model: The scanner.
            seed: Start of the noise; None for none.
            noise_mm: Standard deviation of a distance.
        """
        steps = np.arange(model.outermost_step + 1, dtype=np.float64)
        angles: NDArray[np.float64] = (steps - model.number("AFRT")) * (2.0 * math.pi / model.number("ARES"))
        metres = np.minimum(_walls(angles), _pillar(angles))
        self._distances = np.minimum(1000.0 * metres, model.number("DMAX"))
        self._minimum = model.number("DMIN")
        self._random = None if seed is None else np.random.default_rng(seed)
        self._noise_mm = noise_mm

    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        """The distances of the steps first..last, shape (last - first + 1,), millimetres."""
        wanted = self._distances[first_step : last_step + 1]
        if self._random is not None:
            wanted = wanted + self._random.normal(0.0, self._noise_mm, len(wanted))
        return np.maximum(np.rint(wanted), self._minimum).astype(np.int32)


def _walls(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y = np.cos(angles), np.sin(angles)
    with np.errstate(divide="ignore"):
        along = np.where(x > 0.0, AHEAD_M / np.abs(x), BEHIND_M / np.abs(x))
        across = np.where(y > 0.0, LEFT_M / np.abs(y), RIGHT_M / np.abs(y))
    return np.minimum(along, across)


def _pillar(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    along = PILLAR_X_M * np.cos(angles) + PILLAR_Y_M * np.sin(angles)
    aside = -PILLAR_X_M * np.sin(angles) + PILLAR_Y_M * np.cos(angles)
    depth = PILLAR_RADIUS_M**2 - aside**2
    hit = (depth >= 0.0) & (along > 0.0)
    return np.where(hit, along - np.sqrt(np.maximum(depth, 0.0)), np.inf)
