"""People in a depth picture: tall blobs in a plan view from above that are shaped like a body.

Wrong positives send the robot to the wrong place, so every test is strict: the width, a rounded front, a head
where the picture is high enough to show it (else an outline that changes from low to high), no gaps on the
way up, and free edges on both sides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import ColourImage, DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker._body import Camera, Front, find_head, fit_front, shape_spread
from florence_bt.skills.people.user_tracker._plan_view_kernels import project_to_plan
from florence_bt.skills.people.user_tracker._visibility import (
    Borders,
    filled_layers,
    hidden_edges,
    touched_borders,
)
from florence_bt.skills.people.user_tracker.appearance import Histogram, colour_histogram
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.parameters import DetectorParameters

ABOVE_PEOPLE = 0.3
"""Metres above the tallest person that are looked at too: what reaches up there is not a person."""

BODY_RADIUS = 0.4
"""Metres around the axis that hold a body with its arms."""


@dataclass(frozen=True, slots=True)
class Detection:
    """A person in one picture.

    Attributes:
        x: The axis of the body in metres, in the robot frame (or the frame of :meth:`moved_by`).
        y: As x.
        distance: Horizontal distance from the camera in metres.
        width: Width of the body in metres.
        top: Height of the highest point seen, metres.
        histogram: Colours of the chest, or None.
    """

    x: float
    y: float
    distance: float
    width: float
    top: float
    histogram: Histogram | None = None

    def moved_by(self, robot: Pose2) -> Detection:
        """The same in the frame in which the robot has this pose."""
        x, y = robot.apply(self.x, self.y)
        return replace(self, x=x, y=y)


@dataclass(frozen=True, slots=True)
class _Blob:
    """The tall pixels of one blob: row and column of each, and the points, shape (n, 3)."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    points: NDArray[np.float64]


def detect_people(
    depth: DepthImage,
    optical_in_base: Transform3,
    colour: ColourImage | None = None,
    parameters: DetectorParameters | None = None,
    *,
    known: KnownObstacles | None = None,
    robot: Pose2 | None = None,
) -> list[Detection]:
    """Find the people in a depth picture.

    Args:
        depth: The picture.
        optical_in_base: Takes points of the optical frame to the robot frame (base_footprint).
        colour: The colour picture of about the same moment, for the histograms.
        parameters: What a person looks like; the defaults when None.
        known: The map; together with ``robot`` it takes walls and mapped furniture out of the picture, which
            also separates people from what they stand beside.
        robot: The robot frame in the map frame.

    Returns:
        The people, nearest first, in the robot frame.
    """
    use = parameters or DetectorParameters()
    camera = _camera_place(optical_in_base)
    found: list[Detection] = []
    points, blobs = _tall_blobs(depth, optical_in_base, use, (known, robot) if known and robot else None)
    for blob in blobs:
        if known is not None and robot is not None:
            distance_to_map = known.distance_to(blob.points[:, 0], blob.points[:, 1], robot)
            if np.mean(distance_to_map < use.map_halo) > use.maximum_halo_share:
                continue
        front = _judge(blob, points, depth, optical_in_base, use)
        if front is None:
            continue
        histogram = None
        if colour is not None:
            shape = depth.depth.shape
            inner = front.inner
            histogram = colour_histogram(colour, blob.rows[inner], blob.columns[inner], (shape[0], shape[1]))
        top = float(np.max(blob.points[:, 2]))
        distance = math.hypot(front.x - camera[0], front.y - camera[1])
        found.append(Detection(front.x, front.y, distance, 2.0 * front.half_width, top, histogram))
    return sorted(found, key=lambda detection: detection.distance)


def _camera_place(optical_in_base: Transform3) -> Camera:
    x, y, z = optical_in_base.translation
    return float(x), float(y), float(z)


def _tall_blobs(
    depth: DepthImage,
    optical_in_base: Transform3,
    use: DetectorParameters,
    map_and_robot: tuple[KnownObstacles, Pose2] | None = None,
) -> tuple[NDArray[np.float32], list[_Blob]]:
    """All points, shape (h, w, 3), and the connected groups of tall ones that are small as a person."""
    reach = use.maximum_depth
    x0, y0 = optical_in_base.translation[0] - reach, optical_in_base.translation[1] - reach
    side = math.ceil(2.0 * reach / use.cell)
    camera = depth.camera
    points, cells, tall_count = project_to_plan(
        np.ascontiguousarray(depth.depth, np.float32),
        np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
        np.ascontiguousarray(optical_in_base.rotation, np.float64),
        np.ascontiguousarray(optical_in_base.translation, np.float64),
        np.array([use.minimum_height, use.maximum_height + ABOVE_PEOPLE, use.tall_height, reach, x0, y0]),
        use.cell,
        (side, side),
    )
    tall = (tall_count >= use.minimum_cell_points).astype(np.uint8)
    if map_and_robot is not None:
        known, robot = map_and_robot
        row, column = np.nonzero(tall)
        x, y = x0 + (column + 0.5) * use.cell, y0 + (row + 0.5) * use.cell
        tall[row, column] = known.distance_to(x, y, robot) > use.map_margin
    number, labels, stats, _ = cv2.connectedComponentsWithStats(tall, connectivity=8)
    largest = (use.maximum_width + use.maximum_thickness) / use.cell
    small = [
        label
        for label in range(1, number)
        if stats[label, cv2.CC_STAT_WIDTH] <= largest and stats[label, cv2.CC_STAT_HEIGHT] <= largest
    ]
    flat = np.append(labels.ravel(), 0)
    label_of_pixel = flat[cells]
    label_of_pixel[~(points[..., 2] >= use.tall_height)] = 0
    blobs = []
    for label in small:
        rows, columns = np.nonzero(label_of_pixel == label)
        if len(rows) >= use.minimum_points:
            blobs.append(_Blob(rows, columns, points[rows, columns].astype(np.float64)))
    return points, blobs


def _judge(
    blob: _Blob,
    points: NDArray[np.float32],
    depth: DepthImage,
    optical_in_base: Transform3,
    use: DetectorParameters,
) -> Front | None:
    """The front of the body when the blob is a person, else None."""
    top = float(np.percentile(blob.points[:, 2], 99.5))
    borders = touched_borders(blob.rows, blob.columns, depth.camera)
    cut = (borders.right, borders.left)
    if not _has_a_sensible_top(top, borders, use) or any(hidden_edges(depth.depth, blob.rows, blob.columns)):
        return None
    camera = _camera_place(optical_in_base)
    chest_top = use.chest_top if borders.top else min(use.chest_top, top - 1.5 * use.head_height)
    front = fit_front(blob.points, blob.rows, camera, cut, chest_top, use)
    if front is None or not _is_round(blob, front, camera, use):
        return None
    if any(cut) and (
        front.distance > use.cut_distance or not use.minimum_cut_bulge <= front.bulge <= use.maximum_cut_bulge
    ):
        return None
    if borders.top:
        near = _points_near(points, blob, front)
        if shape_spread(near, front, camera, use.minimum_height) < use.minimum_shape_spread:
            return None
    else:
        head = find_head(blob.points, front, camera, use)
        if head is None:
            return None
        # Two independent estimates of the same axis.
        front = replace(front, x=0.5 * (front.x + head[0]), y=0.5 * (front.y + head[1]))
    filled = filled_layers(depth, optical_in_base, front, (use.seat_height, top - 0.05))
    return front if filled >= use.minimum_continuity else None


def _has_a_sensible_top(top: float, borders: Borders, use: DetectorParameters) -> bool:
    """Whether the height of a blob may be that of a person, given what cuts it off."""
    if borders.left or borders.right:
        # A person near enough to be cut by one side reaches the upper edge as well.
        return (
            borders.top
            and not (borders.left and borders.right)
            and use.minimum_cut_top <= top <= use.maximum_height
        )
    return (use.minimum_clipped_top if borders.top else use.minimum_top) <= top <= use.maximum_height


def _points_near(points: NDArray[np.float32], blob: _Blob, front: Front) -> NDArray[np.float64]:
    """All points around the axis of a body, whatever their height, shape (n, 3)."""
    columns = points[:, int(blob.columns.min()) : int(blob.columns.max()) + 1]
    with np.errstate(invalid="ignore"):
        near = np.hypot(columns[..., 0] - front.x, columns[..., 1] - front.y) < BODY_RADIUS
    return columns[near].astype(np.float64)


def _is_round(blob: _Blob, front: Front, camera: Camera, use: DetectorParameters) -> bool:
    """Whether width, thickness and curvature of the front fit a body within the range."""
    along = (blob.points[:, :2] - np.array(camera[:2])) @ (math.cos(front.bearing), math.sin(front.bearing))
    near, far = np.percentile(along, [2.0, 98.0])
    return bool(
        use.minimum_width <= 2.0 * front.half_width <= use.maximum_width
        and far - near <= use.maximum_thickness
        and front.distance <= use.maximum_distance
        and use.minimum_bulge <= front.bulge <= use.maximum_bulge
        and abs(front.slope) <= use.maximum_slope
        and front.residual <= use.maximum_residual + use.residual_growth * front.distance**2
    )
