"""The first call of a compiled function, of which the fork server spares its forks the long part."""

from __future__ import annotations

import numpy as np

from florence_bt.skills.filters.laser_filter._kernels import filter_ranges


def start_numba() -> None:
    """Call a compiled function: numba imports and links for it what every further one needs, in 0.4 s."""
    zero = np.float32(0.0)
    filter_ranges(np.zeros(1, np.float32), zero, zero, zero, zero, zero, False)
