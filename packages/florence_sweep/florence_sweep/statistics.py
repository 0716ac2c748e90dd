"""The statistics of shares: how sure one is, and whether two differ."""

from __future__ import annotations

import math

_95 = 1.959963984540054
"""The quantile of the normal distribution with 2.5 % above it."""


def wilson(hits: int, of: int) -> tuple[float, float]:
    """Return the interval in which a share lies with 95 %.

    Args:
        hits: How often it was so.
        of: How often it was tried; 0 says nothing.

    Source:
        Wilson, Probable inference, the law of succession, and statistical inference, 1927.
    """
    if of == 0:
        return 0.0, 1.0
    share, z2 = hits / of, _95**2
    middle = (share + z2 / (2 * of)) / (1 + z2 / of)
    half = _95 / (1 + z2 / of) * math.sqrt(share * (1 - share) / of + z2 / (4 * of**2))
    return max(0.0, middle - half), min(1.0, middle + half)


def mcnemar(gained: int, lost: int) -> float:
    """Return how likely pairs that differ are parted at least so unevenly by chance (exact, two-sided).

    Args:
        gained: Pairs in which only the second was so.
        lost: Pairs in which only the first was so.

    Source:
        McNemar, Note on the sampling error of the difference between correlated proportions, 1947.
    """
    pairs, least = gained + lost, min(gained, lost)
    tail = sum(math.comb(pairs, k) for k in range(least + 1))
    return min(1.0, 2.0 * tail / 2**pairs)
