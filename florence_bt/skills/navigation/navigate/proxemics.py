"""The cost of passing somebody: a Gaussian round each person, stretched to where they walk."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, Cells

_CUTOFF = 10.0
"""Smaller costs are left out, as in social_navigation_layers."""


def add_proxemics(
    master: Cells,
    frame: tuple[float, float, float],
    people: NDArray[np.float64],
    amplitude: float,
    covariance: float,
    factor: float,
) -> None:
    """Raise the costs of the cells round people, in place.

    Args:
        master: Shape (rows, columns). What the robot does not fit into, and unknown cells stay as they are.
        frame: origin_x, origin_y and resolution of the cells, metres.
        people: Shape (n, 4): x, y in metres, vx, vy in m/s.
        amplitude: The cost at the person.
        covariance: Of the Gaussian beside and behind the person, m^2.
        factor: How much greater it is before them, for each m/s.

    Source:
        Lu, Hershberger and Smart (2014), Layered Costmaps for Context-Sensitive Navigation;
        social_navigation_layers::ProxemicLayer.
    """
    if amplitude <= _CUTOFF:
        return
    origin_x, origin_y, resolution = frame
    for x, y, vx, vy in people:
        before = covariance * (1.0 + factor * math.hypot(vx, vy))
        reach = math.sqrt(2.0 * before * math.log(amplitude / _CUTOFF))
        left, right = _cells(x - origin_x, reach, resolution, master.shape[1])
        low, high = _cells(y - origin_y, reach, resolution, master.shape[0])
        dx = origin_x + (np.arange(left, right) + 0.5) * resolution - x
        dy = origin_y + (np.arange(low, high) + 0.5) * resolution - y
        heading = math.atan2(vy, vx)
        along = dx[None, :] * math.cos(heading) + dy[:, None] * math.sin(heading)
        across = dx[None, :] ** 2 + dy[:, None] ** 2 - along**2
        spread = np.where(along > 0.0, before, covariance)
        costs = amplitude * np.exp(-0.5 * (along**2 / spread + across / covariance))
        window = master[low:high, left:right]
        raised = (costs >= _CUTOFF) & (window < INSCRIBED)
        window[raised] = np.maximum(window[raised], costs[raised].astype(np.uint8))


def _cells(middle: float, reach: float, resolution: float, count: int) -> tuple[int, int]:
    """Return the first cell within reach along one axis, and the first one beyond."""
    first, last = math.floor((middle - reach) / resolution), math.ceil((middle + reach) / resolution)
    return min(max(0, first), count), min(max(0, last), count)
