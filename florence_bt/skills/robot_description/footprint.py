"""The outline of the robot on the floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from florence_bt.core.errors import ConfigError
from florence_bt.core.polygons import Polygon, distance_to, edges

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

FLORENCE_FOOTPRINT = (-0.16, -0.16, -0.16, 0.16, 0.19, 0.16, 0.24, 0.0, 0.19, -0.16)
"""x, y of each corner in metres (document, section 3.3.2)."""


@dataclass(frozen=True, slots=True)
class Footprint:
    """A polygon around the robot, in the frame of base_footprint.

    Attributes:
        corners: x, y of each corner, in order, metres.
        inscribed_radius: Distance from the origin to the nearest edge.
        circumscribed_radius: Distance from the origin to the farthest corner.
    """

    corners: Polygon
    inscribed_radius: float
    circumscribed_radius: float

    @staticmethod
    def from_corners(corners: Sequence[tuple[float, float]], padding: float = 0.0) -> Footprint:
        """Make a footprint, moved outwards by a padding.

        Args:
            corners: At least three corners, in order; the origin lies inside.
            padding: Added to both coordinates in the direction of their sign (zero counts as above zero).

        Raises:
            ConfigError: Too few corners, or the origin is not inside.

        Source:
            REFERENCE 7.4, padding rule.
        """
        if len(corners) < 3:
            raise ConfigError(
                f"a footprint of {len(corners)} corners has no area",
                valid=["three or more corners"],
                parameters=["footprint"],
            )
        padded = tuple(
            (x + math.copysign(padding, x or 0.0), y + math.copysign(padding, y or 0.0)) for x, y in corners
        )
        sides = [x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in edges(padded)]
        if not (all(side > 0.0 for side in sides) or all(side < 0.0 for side in sides)):
            raise ConfigError(
                "the footprint does not go around the origin of base_footprint once, without dents",
                valid=[f"footprint: {list(FLORENCE_FOOTPRINT)}"],
                parameters=["footprint"],
            )
        inner = distance_to(padded, 0.0, 0.0)
        return Footprint(padded, inner, max(math.hypot(x, y) for x, y in padded))

    def outline(self, spacing: float) -> NDArray[np.float64]:
        """Return points along all edges, at most ``spacing`` metres apart, shape (n, 2); only to be read."""
        return _outline(self.corners, spacing)

    def corner_array(self) -> NDArray[np.float64]:
        """Return the corners, shape (n, 2)."""
        import numpy as np

        return np.array(self.corners)


@lru_cache(maxsize=16)
def _outline(corners: Polygon, spacing: float) -> NDArray[np.float64]:
    import numpy as np

    points = []
    for (x0, y0), (x1, y1) in edges(corners):
        count = max(1, math.ceil(math.hypot(x1 - x0, y1 - y0) / spacing))
        points += [(x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count) for k in range(count)]
    return np.array(points)


def corners_from_flat(numbers: Sequence[float]) -> Polygon:
    """Return corners from x, y, x, y, ... as a parameter holds them.

    Raises:
        ConfigError: An odd count of numbers, or one that is not finite.
    """
    if len(numbers) % 2 or not all(math.isfinite(number) for number in numbers):
        raise ConfigError(
            f"the footprint {list(numbers)} is not a list of x, y, x, y, ...",
            valid=[f"{list(FLORENCE_FOOTPRINT)}"],
            parameters=["footprint"],
        )
    return tuple(zip(numbers[::2], numbers[1::2], strict=True))
