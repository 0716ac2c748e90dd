"""The picture of a drive: the map, the way of the robot, and where it recognised places."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.map_server.map_writer import trinary_pixels
from florence_bt.skills.navigation.mapping.pose_graph import Tie

_WAY, _LOOP, _START, _END = (190, 90, 20), (40, 160, 240), (60, 150, 40), (50, 40, 200)
"""Blue, green, red."""
_WIDTH, _LARGEST_SCALE = 1200, 4
"""A small map is drawn larger."""


def draw_drive(grid: OccupancyGrid, poses: Sequence[Pose2], ties: Sequence[Tie]) -> bytes:
    """Draw a map with the way of the robot.

    Args:
        grid: The map.
        poses: Of the base at the kept scans, in the map frame.
        ties: Those between scans that do not follow each other are recognised places.

    Returns:
        A PNG image.
    """
    import cv2

    rows, columns = grid.cells.shape
    scale = max(1, min(_LARGEST_SCALE, _WIDTH // columns))
    grey = np.flipud(trinary_pixels(grid.cells)).repeat(scale, axis=0).repeat(scale, axis=1)
    image = np.ascontiguousarray(np.repeat(grey[:, :, None], 3, axis=2))
    x, y = np.array([(pose.x, pose.y) for pose in poses]).T
    u = (x - grid.origin.x) / grid.resolution * scale
    v = rows * scale - 1 - (y - grid.origin.y) / grid.resolution * scale
    places: NDArray[np.int32] = np.rint(np.stack([u, v], axis=1)).astype(np.int32)
    for tie in ties:
        if tie.second - tie.first > 1:
            cv2.line(image, places[tie.first].tolist(), places[tie.second].tolist(), _LOOP, 1, cv2.LINE_AA)
    cv2.polylines(image, [places], False, _WAY, max(1, scale // 2), cv2.LINE_AA)
    for place, colour in ((places[0], _START), (places[-1], _END)):
        cv2.circle(image, place.tolist(), 2 + 2 * scale, colour, -1, cv2.LINE_AA)
    metre = scale / grid.resolution
    metres = next((each for each in (10, 5, 2, 1) if each * metre < columns * scale / 3), 1)
    left, low = 10, rows * scale - 10
    cv2.line(image, (left, low), (left + round(metres * metre), low), (0, 0, 0), 2)
    cv2.putText(
        image, f"{metres} m", (left, low - 6), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 1, cv2.LINE_AA
    )
    done, data = cv2.imencode(".png", image)
    assert done, "OpenCV writes every image of bytes"
    return data.tobytes()
