"""Places from which a room can be seen: the hotspot first, then where most of what is hidden comes into view.

Pure functions of the map, so that the same room always has the same views.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from florence_bt.core.geometry import Pose2

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from florence_bt.core.sensing import OccupancyGrid

RANGE_M = 3.5
"""Distance up to which people are found well. Source: REFERENCE 12.2 says 4 m; docs/manual/people.md."""
BLIND_M = 0.6
"""A person nearer than this is not seen. Source: REFERENCE 12.2."""
FREE_M = 0.32
"""Free metres around a view: the circumscribed radius of the footprint (REFERENCE 7.4) and a cell."""
ROOMY_M = 0.6
"""With less free around it, a view is worth less, in proportion: a chair that was moved, or a bag, may stand
in a corner of which the map shows just enough, and the robot does not get in, or not out again."""
WORTH_M2 = 0.6
"""Floor that a view must show and no view before it does: about what one person covers."""
MAX_VIEWS = 3
"""Of 36 people who were met in trials 34 were seen at the first view or on the way there, 2 at the second,
and none at a later one; each takes about 25 s."""
STEP_M = 0.2
"""The room is judged at points so far apart, in a large room further."""
MOST_POINTS, MOST_CANDIDATES = 400, 60
"""Points of the room, and places to look from, at most: the caller waits no longer than some 0.1 s."""
VIEW_REACH_M = 10.0
"""Distance from the hotspot, in x or y, up to which a view is looked for."""
_RAY_STEP_M = 0.1
"""Step along a line of sight. Chosen."""
LOOKS, LOOK_STEP = 4, math.radians(45.0)
"""At a further view the robot looks so often, so far apart: where something is new there (``goto_user``)."""
PICTURE = math.radians(57.0)
"""Width of a picture. Source: REFERENCE 8 (Kinect)."""
ARC = (LOOKS - 1) * LOOK_STEP + PICTURE
"""Width of these looks together, half of it to either side of the view."""


def views(hotspot: Pose2, in_room: Callable[[float, float], bool], grid: OccupancyGrid) -> Iterator[Pose2]:
    """Yield the poses to look from, one after the other.

    Args:
        hotspot: The hotspot of the room, map frame; it is the first view.
        in_room: Whether a point, map frame, belongs to the room.
        grid: The map.

    Yields:
        Poses in the map frame that look towards what is new there, at most ``MAX_VIEWS``.
    """
    import numpy as np
    from scipy import ndimage

    from florence_bt.core.table_legs import with_tables

    yield hotspot
    open_floor = _open_floor(grid)
    # The camera looks between the legs of a table; the robot does not fit there.
    clearance = ndimage.distance_transform_edt(np.pad(_open_floor(with_tables(grid)), 1))[1:-1, 1:-1]
    clearance *= grid.resolution
    parts, _ = ndimage.label(clearance >= FREE_M, np.ones((3, 3)))
    points = _points_of_room(hotspot, in_room, grid)
    rows, columns = _cells_of(points, grid)
    points = points[open_floor[rows, columns]]
    area = len(points) * STEP_M**2
    points = _some(points, MOST_POINTS)
    rows, columns = _cells_of(points, grid)
    # A hotspot may stand nearer to something than a view may: the largest part of the room is meant then.
    count = np.bincount(parts[rows, columns], minlength=2)
    candidates = points[parts[rows, columns] == 1 + int(np.argmax(count[1:]))]
    candidates = _some(candidates, MOST_CANDIDATES)
    hidden = ~_seen(np.array([hotspot.x, hotspot.y]), points, open_floor, grid)
    shown = [_seen(candidate, points, open_floor, grid) for candidate in candidates]
    roomy = np.minimum(clearance[_cells_of(candidates, grid)] / ROOMY_M, 1.0)
    for _ in range(MAX_VIEWS - 1):
        looks = [
            _towards(x, y, points, each & hidden) for (x, y), each in zip(candidates, shown, strict=True)
        ]
        gains = np.array([new.sum() for _, new in looks])
        if not (gains * area >= WORTH_M2 * len(points)).any():
            return
        best = int(np.argmax(gains * roomy))
        yaw, new = looks[best]
        x, y = candidates[best].tolist()
        yield Pose2(x, y, yaw)
        hidden &= ~new


def _towards(
    x: float, y: float, points: NDArray[np.float64], new: NDArray[np.bool_]
) -> tuple[float, NDArray[np.bool_]]:
    """Return the direction of what is new from a place, and which of it the looks that way show."""
    import numpy as np

    if not new.any():
        return 0.0, new
    to_x, to_y = points[new].mean(axis=0).tolist()
    yaw = math.atan2(to_y - y, to_x - x)
    beside = np.arctan2(points[:, 1] - y, points[:, 0] - x) - yaw
    return yaw, new & (np.abs((beside + math.pi) % (2 * math.pi) - math.pi) <= ARC / 2)


def _open_floor(grid: OccupancyGrid) -> NDArray[np.bool_]:
    """Mark where the map shows free floor, in its shape."""
    from florence_bt.core.sensing import OCCUPIED

    open_floor: NDArray[np.bool_] = (grid.cells >= 0) & (grid.cells < OCCUPIED // 2)
    return open_floor


def _points_of_room(
    hotspot: Pose2, in_room: Callable[[float, float], bool], grid: OccupancyGrid
) -> NDArray[np.float64]:
    """Return points of the map that belong to the room and are not far from its hotspot, shape (n, 2)."""
    import numpy as np

    height, width = (size * grid.resolution for size in grid.cells.shape)
    xs = np.arange(grid.origin.x + STEP_M / 2, grid.origin.x + width, STEP_M)
    ys = np.arange(grid.origin.y + STEP_M / 2, grid.origin.y + height, STEP_M)
    near_x = xs[np.abs(xs - hotspot.x) <= VIEW_REACH_M].tolist()
    near_y = ys[np.abs(ys - hotspot.y) <= VIEW_REACH_M].tolist()
    return np.array([(x, y) for y in near_y for x in near_x if in_room(x, y)]).reshape(-1, 2)


def _some(points: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    """Return at most this many of the points, spread over all of them, and always the same ones."""
    import numpy as np

    return points[np.sort(np.random.default_rng(0).permutation(len(points))[:most])]


def _cells_of(
    points: NDArray[np.float64], grid: OccupancyGrid
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows and columns of points, shape (..., 2), each at most as far as the grid goes."""
    import numpy as np

    cells = np.floor((points - (grid.origin.x, grid.origin.y)) / grid.resolution).astype(np.int64)
    rows, columns = grid.cells.shape
    return np.clip(cells[..., 1], 0, rows - 1), np.clip(cells[..., 0], 0, columns - 1)


def _seen(
    eye: NDArray[np.float64],
    points: NDArray[np.float64],
    open_floor: NDArray[np.bool_],
    grid: OccupancyGrid,
) -> NDArray[np.bool_]:
    """Tell at which points a robot would see somebody, shape (n,); nobody can be where it stands."""
    import numpy as np

    away = points - eye
    far = np.hypot(away[:, 0], away[:, 1])
    along = np.arange(0.0, 1.0, _RAY_STEP_M / RANGE_M)
    free = open_floor[_cells_of(eye + away[:, None, :] * along[None, :, None], grid)].all(axis=1)
    return free & (far <= RANGE_M) & ((far >= BLIND_M) | (far <= FREE_M))
