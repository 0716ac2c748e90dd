"""What the picture says about a blob's surroundings: borders, nearer things in front of it, gaps in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import CameraModel, DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker._body import Front

I64 = NDArray[np.int64]

BORDER_SHARE = 0.015
"""The outer part of a picture, of its width, in which a blob counts as cut."""
LOOK_BESIDE_PX = 8
NEARER = 0.2
"""Metres by which something beside the blob must be nearer to hide its edge."""
LAYER = 0.1
"""Metres of height per layer."""
BODY_NEAR, BODY_FAR = 0.35, 0.3
"""Metres before and behind the axis of the body that count as body."""


@dataclass(frozen=True, slots=True)
class Borders:
    """Which borders of the picture a blob touches."""

    left: bool
    right: bool
    top: bool


def touched_borders(rows: I64, columns: I64, camera: CameraModel) -> Borders:
    """Which borders of the picture the pixels of a blob touch.

    Args:
        rows: Shape (n,).
        columns: Shape (n,).
        camera: For the size of the picture.
    """
    margin = max(1, round(BORDER_SHARE * camera.width))
    few = max(3, len(rows) // 200)
    return Borders(
        left=int((columns < margin).sum()) > few,
        right=int((columns >= camera.width - margin).sum()) > few,
        top=int((rows < margin).sum()) > 3,
    )


def hidden_edges(depth: NDArray[np.float32], rows: I64, columns: I64) -> tuple[bool, bool]:
    """Whether something nearer hides the right and the left edge of a blob.

    Args:
        depth: Shape (h, w), metres.
        rows: Shape (n,), row by row.
        columns: Shape (n,), rising in each row.

    Returns:
        (right, left) as seen from the camera.
    """
    starts = np.flatnonzero(np.diff(rows, prepend=-1))
    ends = np.append(starts[1:], len(rows)) - 1
    return (
        _something_nearer(depth, rows[ends], columns[ends], 1),
        _something_nearer(depth, rows[starts], columns[starts], -1),
    )


def _something_nearer(depth: NDArray[np.float32], rows: I64, columns: I64, step: int) -> bool:
    """Whether in most rows the first measurement beside the edge is clearly nearer than the edge."""
    at_edge = depth[rows, columns]
    beside = np.full(len(rows), np.nan, np.float32)
    for offset in range(LOOK_BESIDE_PX, 1, -1):
        column = columns + step * offset
        inside = (column >= 0) & (column < depth.shape[1])
        seen = np.where(inside, depth[rows, np.clip(column, 0, depth.shape[1] - 1)], np.nan)
        beside = np.where(np.isfinite(seen), seen, beside)
    return bool(np.sum(beside < at_edge - NEARER) > 0.5 * len(rows))


def filled_layers(
    depth: DepthImage, optical_in_base: Transform3, front: Front, heights: tuple[float, float]
) -> float:
    """The share of the visible height layers in which the body is there.

    A layer that something nearer hides, or without measurements, does not count.

    Args:
        depth: The picture.
        optical_in_base: Takes points of the optical frame to the robot frame.
        front: The fitted front of the body.
        heights: The lowest and the highest layer, metres.

    Returns:
        0 to 1; 0 when no layer is visible.
    """
    base_in_optical = optical_in_base.inverse()
    camera, picture = depth.camera, depth.depth
    levels = np.arange(heights[0], heights[1], LAYER)
    axis = np.column_stack([np.full_like(levels, front.x), np.full_like(levels, front.y), levels])
    in_optical = base_in_optical.apply(axis)
    body = visible = 0
    for x, y, z in in_optical:
        u, v = camera.cx + camera.fx * x / z, camera.cy + camera.fy * y / z
        half_u = max(2.0, 0.8 * camera.fx * front.half_width / z)
        half_v = max(1.0, 0.5 * camera.fy * LAYER / z)
        window = picture[_span(v, half_v, camera.height), _span(u, half_u, camera.width)]
        here, open_view = _classify(window, float(z))
        body += here
        visible += here or open_view
    return body / visible if visible else 0.0


def _span(centre: float, half: float, size: int) -> slice:
    return slice(max(0, math.floor(centre - half)), max(0, min(size, math.ceil(centre + half) + 1)))


def _classify(window: NDArray[np.float32], axis_depth: float) -> tuple[bool, bool]:
    """Whether the body is in a window of the picture, and whether one looks past it into the distance."""
    if window.size == 0:
        return False, False
    body = int(np.sum((window > axis_depth - BODY_NEAR) & (window < axis_depth + BODY_FAR)))
    behind = int(np.sum(window >= axis_depth + BODY_FAR))
    if body >= 0.2 * window.size:
        return True, False
    return False, behind >= 0.5 * window.size
