"""The part of a scan that is kept for a map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.beam_ends import beam_ends, ends_at
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.mapping.parameters import SlamParameters


@dataclass(frozen=True, slots=True)
class KeptScan:
    """A scan, as a map is drawn from it. Everything in the base frame, metres.

    Attributes:
        stamp: When it was taken, seconds.
        start: Shape (2,), float32: where the beams start.
        points: Shape (n, 2), float32: where those end that met something, in the order of the beams.
        clear: Shape (m, 2), float32: the ends of what is free along those that met nothing.
    """

    stamp: float
    start: NDArray[np.float32]
    points: NDArray[np.float32]
    clear: NDArray[np.float32]


def keep_scan(scan: LaserScan, laser_in_base: Transform3, parameters: SlamParameters) -> KeptScan:
    """Take what is kept of a scan.

    Args:
        scan: The laser's own scan.
        laser_in_base: The laser's frame in base_footprint.
        parameters: Say which beams count.
    """
    p = parameters
    empty = scan.empty()
    clear = np.full(np.count_nonzero(empty), min(p.no_return_clears, scan.range_max))
    return KeptScan(
        stamp=scan.middle_stamp,
        start=laser_in_base.translation[:2].astype(np.float32),
        points=beam_ends(scan, laser_in_base, p.laser_min_range, p.laser_max_range).astype(np.float32),
        clear=ends_at(scan, laser_in_base, empty, clear).astype(np.float32),
    )
