"""The shape of a blob: an elliptic front between two silhouette edges, and a head on top.

Along the line of sight the front of an elliptic body is ``centre + slope u - bulge sqrt(1 - u^2)``, where u
runs from -1 at one silhouette edge to 1 at the other, whichever way the body is turned. That is linear in its
three unknowns; the first is where the body's axis is, the third distinguishes a body from flat furniture.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.skills.people.user_tracker.parameters import DetectorParameters

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

Camera = tuple[float, float, float]
"""x, y and height of a camera in the robot frame, metres."""

BINS = 14
PROFILE_EDGE = 0.94
"""Profile beyond this share of the half width is left out: mixed pixels."""
WIDE_SHARE = 0.65
FRONT_SIGMA = 0.012
BULGE_SIGMA = 0.05
SLOPE_SIGMA = 0.6
LAYER = 0.1
"""Metres of height per layer of :func:`shape_spread`."""
LAYER_POINTS = 15
BESIDE, BEHIND = 0.05, 0.15
"""Metres beside the silhouette and behind the axis that still count as body."""
USUAL_HALF_THICKNESS = ((0.11, 0.255), (0.25, 0.13))
"""Half width -> half thickness of an adult with hanging arms, metres: from the side, and from the front."""
USUAL_WEIGHT = 0.6
"""Weight of the usual thickness against the fitted one."""
HALF_HEAD = 0.1
"""Metres from the face to the axis of the head."""
SET_BACK = 0.05
"""Metres between the fronts of head and chest that distinguish a head from the end of a post."""


@dataclass(frozen=True, slots=True)
class Front:
    """The front of a blob, fitted.

    Attributes:
        x: The axis of the body, metres, robot frame.
        y: The axis of the body, metres, robot frame.
        bearing: Direction from the camera to the axis, radians, robot frame.
        distance: Horizontal distance from the camera to the axis, metres.
        half_width: Half the distance between the silhouette edges, metres.
        bulge: How far the middle stands out before the edges, metres; below zero for a hollow.
        slope: How far the front is turned, metres over the half width, divided by it.
        residual: Root mean square distance of the profile from the fitted front, metres.
        inner: Shape (n,), which of the points lie well inside the silhouette of the chest.
    """

    x: float
    y: float
    bearing: float
    distance: float
    half_width: float
    bulge: float
    slope: float
    residual: float
    inner: NDArray[np.bool_]


def fit_front(
    points: F64,
    rows: I64,
    camera: Camera,
    cut: tuple[bool, bool],
    chest_top: float,
    parameters: DetectorParameters,
) -> Front | None:
    """Fit an elliptic front to the chest of a blob.

    Args:
        points: Shape (n, 3), metres, robot frame, in the order of the picture (row by row).
        rows: Shape (n,), the row of each point.
        camera: Where the camera is, metres, robot frame.
        cut: Whether the edge of the picture hides the right or the left silhouette edge; not both.
        chest_top: Height below which points belong to the chest and not to the head, metres.
        parameters: The usual sizes.

    Returns:
        The front; None when there are too few points.
    """
    chest = points[:, 2] < chest_top
    if int(chest.sum()) < parameters.minimum_points:
        chest = np.ones(len(points), bool)
    middle_x, middle_y = np.median(points[chest, :2], axis=0)
    bearing = math.atan2(middle_y - camera[1], middle_x - camera[0])
    along, lateral = _seen_along(points, bearing, camera)
    mid, half, wide_rows = _silhouette(lateral[chest], rows[chest], cut, parameters)
    chest &= np.isin(rows, wide_rows)
    u = (lateral - mid) / half
    usable = chest & (np.abs(u) < PROFILE_EDGE)
    if int(usable.sum()) < parameters.minimum_points // 2:
        return None
    centre, slope, bulge, residual = _fit_profile(u[usable], along[usable], half, parameters.usual_bulge)
    usual = float(np.percentile(along[usable], 3.0)) + _usual_half_thickness(half)
    centre += USUAL_WEIGHT * (usual - centre)
    c, s = math.cos(bearing), math.sin(bearing)
    return Front(
        x=camera[0] + c * centre - s * mid,
        y=camera[1] + s * centre + c * mid,
        bearing=bearing + math.atan2(mid, centre),
        distance=math.hypot(centre, mid),
        half_width=half,
        bulge=bulge,
        slope=slope / half,
        residual=residual,
        inner=chest & (np.abs(u) < 0.7),
    )


def _silhouette(
    lateral: F64, rows: I64, cut: tuple[bool, bool], parameters: DetectorParameters
) -> tuple[float, float, I64]:
    """Middle and half width between the edges (the median over the wide rows), and the wide rows.

    A head above a cut chest, or a gap below an arm, makes narrow rows; they would spoil the front.
    """
    starts = np.flatnonzero(np.diff(rows, prepend=-1))
    right, left = np.minimum.reduceat(lateral, starts), np.maximum.reduceat(lateral, starts)
    width = left - right
    wide = width >= WIDE_SHARE * np.percentile(width, 80.0)
    right_edge, left_edge = float(np.median(right[wide])), float(np.median(left[wide]))
    half = max(0.5 * (left_edge - right_edge), 1e-3)
    middle = 0.5 * (left_edge + right_edge)
    if cut[0] or cut[1]:
        half = max(half, parameters.usual_half_width)
        middle = left_edge - half if cut[0] else right_edge + half
    return middle, half, rows[starts][wide]


def _usual_half_thickness(half_width: float) -> float:
    """How far the axis is behind the nearest point: a narrow body is seen from the side, arm first."""
    return float(np.interp(half_width, *USUAL_HALF_THICKNESS))


def _fit_profile(u: F64, along: F64, half: float, usual_bulge: float) -> tuple[float, float, float, float]:
    """Centre, slope, bulge and residual of the front; the last two columns are drawn to what is usual."""
    index = np.minimum(((u + 1.0) * (0.5 * BINS)).astype(np.int64), BINS - 1)
    count = np.bincount(index, minlength=BINS)
    filled = count >= 3
    u_mean = np.bincount(index, u, BINS)[filled] / count[filled]
    d_mean = np.bincount(index, along, BINS)[filled] / count[filled]
    reference = float(np.mean(d_mean)) if len(d_mean) else 0.0
    basis = np.column_stack([np.ones_like(u_mean), u_mean, -np.sqrt(1.0 - u_mean**2)])
    prior = np.diag([0.0, 1.0 / (SLOPE_SIGMA * half), 1.0 / BULGE_SIGMA])
    system = np.vstack([basis / FRONT_SIGMA, prior])
    wanted = np.concatenate([(d_mean - reference) / FRONT_SIGMA, [0.0, 0.0, usual_bulge / BULGE_SIGMA]])
    solution = np.linalg.lstsq(system, wanted, rcond=None)[0]
    error = basis @ solution + reference - d_mean
    residual = float(np.sqrt(np.mean(error**2))) if len(error) else math.inf
    return float(solution[0]) + reference, float(solution[1]), float(solution[2]), residual


def find_head(
    points: F64, front: Front, camera: Camera, parameters: DetectorParameters
) -> tuple[float, float] | None:
    """The head on top of a blob: small, and above the middle of the body.

    Args:
        points: Shape (n, 3), metres, robot frame; the top is not cut by the edge of the picture.
        front: The fitted front.
        camera: Where the camera is, metres, robot frame.
        parameters: The usual sizes.

    Returns:
        x and y of the head's axis, metres, robot frame; None when the top is not a head.
    """
    top = float(np.percentile(points[:, 2], 99.5))
    is_head = points[:, 2] > top - parameters.head_height
    if int(is_head.sum()) < 8 or is_head.all():
        return None
    along, lateral = _seen_along(points, front.bearing, camera)
    low, high = np.percentile(lateral[is_head], [2.0, 98.0])
    width = float(high - low)
    face, chest = np.percentile(along[is_head], 10.0), np.percentile(along[~is_head], 10.0)
    small = width <= parameters.maximum_head_share * 2.0 * front.half_width or abs(face - chest) >= SET_BACK
    fits = parameters.minimum_head_width <= width <= parameters.maximum_head_width
    if not (small and fits and abs(0.5 * (low + high)) <= front.half_width):
        return None
    c, s = math.cos(front.bearing), math.sin(front.bearing)
    axis, middle = float(face) + HALF_HEAD, float(0.5 * (low + high))
    return camera[0] + c * axis - s * middle, camera[1] + s * axis + c * middle


def shape_spread(points: F64, front: Front, camera: Camera, lowest: float) -> float:
    """How much the outline changes from low to high: hardly for a post, much for legs, hips, chest and arms.

    Layers that the edge of the picture cuts aslant are left out.

    Args:
        points: Shape (n, 3), metres, robot frame: everything near the axis of the body; what is behind the
            body or beside it is left out here.
        front: The fitted front.
        camera: Where the camera is, metres, robot frame.
        lowest: Lower points are left out, metres.

    Returns:
        The larger of two differences between height layers, metres: in the width, and in how far the front
        is away. 0 with fewer than two layers.
    """
    along, lateral = _seen_along(points, front.bearing, camera)
    own = (np.abs(lateral) < front.half_width + BESIDE) & (along < front.distance + BEHIND)
    along, lateral, height = along[own], lateral[own], points[own, 2]
    if len(along) < LAYER_POINTS:
        return 0.0
    # What the picture shows of the nearest point it shows of all others too.
    near = float(np.percentile(along, 1.0))
    steepness = (height - camera[2]) / along
    low, high = (camera[2] + near * float(edge) for edge in (steepness.min(), steepness.max()))
    layer = np.floor((height - lowest) / LAYER).astype(np.int64)
    widths, fronts = [], []
    for index in range(max(0, math.ceil((low - lowest) / LAYER)), math.floor((high - lowest) / LAYER)):
        here = layer == index
        if int(here.sum()) >= LAYER_POINTS:
            widths.append(float(np.ptp(np.percentile(lateral[here], [3.0, 97.0]))))
            fronts.append(float(np.percentile(along[here], 15.0)))
    return max(float(np.ptp(widths)), float(np.ptp(fronts))) if len(widths) > 1 else 0.0


def _seen_along(points: F64, bearing: float, camera: Camera) -> tuple[F64, F64]:
    """Distance of points along a line of sight, and to the left of it."""
    c, s = math.cos(bearing), math.sin(bearing)
    relative = points[:, :2] - np.array(camera[:2])
    return relative @ (c, s), relative @ (-s, c)
