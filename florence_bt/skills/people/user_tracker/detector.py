"""People in a depth picture.

A network says which pixels show somebody and where the middle of that person is; where these votes meet is a
person. A person partly hidden or cut off by the edge of the image has fewer votes, at the same place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import ColourImage, DepthImage, Posture
from florence_bt.core.transforms import Transform3
from florence_bt.skills.people.user_tracker.appearance import Histogram, colour_histogram
from florence_bt.skills.people.user_tracker.evidence import Region
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.parameters import DetectorParameters
from florence_bt.skills.people.user_tracker.person_network import (
    INPUT_SIZE,
    POSTURES,
    STRIDE,
    NetworkOutput,
    Pixels,
    infer,
)

_CELL = 0.05
"""Metres; side of the cells in which votes are counted."""
_UPPER_BODY = 0.6
"""Metres from the top of the head to the seat, about."""
_ROBOT_TOP = 1.0
"""Metres above the floor; what is higher does not meet the robot."""
_EDGE = 0.03
"""Distance from a side of the picture, or its bottom, within which things may go on beyond; a share of its
size."""
_FEW_VOTES = 3
"""So many votes at an edge of the picture are no longer single points."""
_TALLEST_SEATED = 1.3
"""Metres above the floor; nobody who sits is seen higher, about: a seat of 0.45 m and 0.85 m to the top of
the head. Of 21 simulated people on stools 0.55 to 1.5 m away whose heads were above the picture the
network took 12 for standing and one for lying."""
_FLOOR_M, _NOBODY = 0.04, 0.2
"""Height above the floor, metres, and probability of a person; what is below both is the floor."""
_AROUND_M = 1.5
"""The floor so far around somebody who lies tells where they do not, metres."""
_TOP_PERCENT = 98.0
"""Of the points of a person, this many are lower than the height that is told: single points may be wrong."""


_NOWHERE = np.zeros((0, 2), np.float32)


Network = Callable[[DepthImage, Pixels], NetworkOutput]


def network_says(_: DepthImage, pixels: Pixels) -> NetworkOutput:
    """Ask the network that was trained."""
    return infer(pixels)


@dataclass(frozen=True, slots=True)
class Outline:
    """A body from above, n points of it.

    Attributes:
        points: Shape (n, 2), metres, in the frame of the detection.
        goes_on: Shape (n,), whether the body may go on there: beyond the picture, or in what votes for
            another middle (of a long body that is near, not all of it votes for one).
        floor: Shape (m, 2), metres, as ``points``: where the picture shows the floor near somebody who lies,
            and so not them.
    """

    points: NDArray[np.float32]
    goes_on: NDArray[np.bool_]
    floor: NDArray[np.float32] = field(default_factory=lambda: _NOWHERE)

    def moved_by(self, robot: Pose2) -> Outline:
        """Return the same in the frame in which the robot has this pose."""
        c, s = math.cos(robot.yaw), math.sin(robot.yaw)
        turn = np.array([[c, s], [-s, c]])
        points, floor = (each @ turn + (robot.x, robot.y) for each in (self.points, self.floor))
        return Outline(points.astype(np.float32), self.goes_on, floor.astype(np.float32))


@dataclass(frozen=True, slots=True)
class Detection:
    """A person in one picture.

    Attributes:
        x: The middle of the body in metres, in the robot frame (or the frame of :meth:`moved_by`).
        y: As x.
        distance: Horizontal distance from the camera in metres.
        confidence: How sure it is that this is a person, 0 to 1.
        posture: What the person does; unknown when the top of the picture cuts them where it decides.
        height: Height above the floor of the highest point that is seen of them, metres; 0 when not known, as
            where the top of the picture cuts them.
        histogram: Colours of the body, or None.
        region: Where the picture shows them, or None when not known.
        outline: What is seen of them up to the height of the robot; None when not known.
    """

    x: float
    y: float
    distance: float
    confidence: float = 1.0
    posture: Posture = "standing"
    height: float = 0.0
    histogram: Histogram | None = None
    region: Region | None = None
    outline: Outline | None = None

    def moved_by(self, robot: Pose2) -> Detection:
        """Return the same in the frame in which the robot has this pose."""
        x, y = robot.apply(self.x, self.y)
        outline = None if self.outline is None else self.outline.moved_by(robot)
        return replace(self, x=x, y=y, outline=outline)


def detect_people(
    depth: DepthImage,
    optical_in_base: Transform3,
    colour: ColourImage | Callable[[], ColourImage | None] | None = None,
    parameters: DetectorParameters | None = None,
    *,
    known: KnownObstacles | None = None,
    robot: Pose2 | None = None,
    network: Network = network_says,
) -> list[Detection]:
    """Find the people in a depth picture.

    Args:
        depth: The picture.
        optical_in_base: Takes points of the optical frame to the robot frame (base_footprint).
        colour: The colour picture of about the same moment, for the histograms; or what gives it, which is
            called when somebody is found.
        parameters: What counts; the defaults when None.
        known: The map; together with ``robot`` it lowers the confidence in what stands where the map has
            something already, or knows nothing.
        robot: The robot frame in the map frame.
        network: Tells of each part of the picture whether it shows a person.

    Returns:
        The people, nearest first, in the robot frame.
    """
    params = parameters or DetectorParameters()
    pixels = Pixels.of(depth, optical_in_base)
    votes = _votes(pixels, network(depth, pixels), params)
    found: list[Detection] = []
    for mine in _groups(votes, params):
        detection = _judge(votes, mine, optical_in_base, params, (known, robot) if known and robot else None)
        if detection is not None and callable(colour):
            colour = colour()
        if detection is not None and isinstance(colour, ColourImage):
            # A vote stands for STRIDE x STRIDE pixels.
            down, right = np.indices((STRIDE, STRIDE)).reshape(2, -1)
            rows = (votes.rows[mine, None] + down).ravel()
            columns = (votes.columns[mine, None] + right).ravel()
            height, width = pixels.depth.shape
            heights = np.repeat(votes.points[mine, 2], STRIDE**2)
            shown = colour_histogram(colour, rows, columns, (height, width), heights)
            detection = replace(detection, histogram=shown)
        if detection is not None:
            found.append(detection)
    return sorted(found, key=lambda detection: detection.distance)


@dataclass(frozen=True, slots=True)
class _Votes:
    """The pixels that show a person, n of them.

    Attributes:
        rows: Shape (n,), of the network's input.
        columns: Shape (n,), as rows.
        points: Shape (n, 3), metres, robot frame.
        middles: Shape (n, 2), where each says that the middle of the person is, metres, robot frame.
        probability: Shape (n,), that it shows a person.
        area: Shape (n,), what it covers, square metres.
        posture: Shape (n, 3), probabilities.
        floor: Shape (m, 2), where the picture shows the floor, metres, robot frame.
    """

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    points: NDArray[np.float32]
    middles: NDArray[np.float32]
    probability: NDArray[np.float32]
    area: NDArray[np.float32]
    posture: NDArray[np.float32]
    floor: NDArray[np.float32]


def _votes(pixels: Pixels, output: NetworkOutput, params: DetectorParameters) -> _Votes:
    depth = pixels.depth[::STRIDE, ::STRIDE]
    shows = (output.person >= params.minimum_probability) & np.isfinite(depth) & (depth > 0.0)
    rows, columns = np.nonzero(shows)
    at = (rows * STRIDE, columns * STRIDE)
    points, ray = pixels.points[at], pixels.rays[at]
    along, left = output.middle[shows].T
    middles = points[:, :2] + along[:, None] * ray + left[:, None] * np.stack([-ray[:, 1], ray[:, 0]], axis=1)
    seen = pixels.points[::STRIDE, ::STRIDE]
    is_floor = (np.abs(seen[..., 2]) < _FLOOR_M) & (output.person < _NOBODY)
    return _Votes(
        *at,
        points,
        middles,
        output.person[shows],
        STRIDE**2 * pixels.area[at],
        output.posture[shows],
        seen[is_floor][:, :2],
    )


def _groups(votes: _Votes, params: DetectorParameters) -> list[NDArray[np.int64]]:
    """Return the indices of the votes for each place where many meet."""
    if not len(votes.rows):
        return []
    low = votes.middles.min(axis=0) - params.merge_radius
    cells = np.floor((votes.middles - low) / _CELL).astype(np.int64)
    size = cells.max(axis=0) + math.ceil(params.merge_radius / _CELL) + 1
    counts = np.zeros((size[0], size[1]), np.float32)
    np.add.at(counts, (cells[:, 0], cells[:, 1]), votes.area * votes.probability)
    counts = cv2.GaussianBlur(counts, (0, 0), params.vote_spread / _CELL)
    reach = 2 * round(params.merge_radius / _CELL) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (reach, reach))
    peaks = np.argwhere((counts == cv2.dilate(counts, disc)) & (counts > 0.0))
    # Neighbours on a flat top are one peak.
    single = [peak for number, peak in enumerate(peaks) if not _near(peak, peaks[:number], reach / 2)]
    places = low + (np.array(single) + 0.5) * _CELL
    apart = np.linalg.norm(votes.middles[:, None] - places[None], axis=2)
    nearest = apart.argmin(axis=1)
    near = apart[np.arange(len(nearest)), nearest] <= params.merge_radius
    return [np.flatnonzero(near & (nearest == number)) for number in range(len(places))]


def _near(peak: NDArray[np.int64], others: NDArray[np.int64], cells: float) -> bool:
    return bool((np.linalg.norm(others - peak, axis=1) <= cells).any())


def _judge(
    votes: _Votes,
    mine: NDArray[np.int64],
    optical_in_base: Transform3,
    params: DetectorParameters,
    map_and_robot: tuple[KnownObstacles, Pose2] | None,
) -> Detection | None:
    """Return the person whom some votes are for, None when they are too few or too unsure."""
    area = float(votes.area[mine].sum())
    if len(mine) < params.minimum_pixels or area < params.minimum_area:
        return None
    weights = votes.area[mine] * votes.probability[mine]
    seems = POSTURES[int(np.average(votes.posture[mine], axis=0, weights=weights).argmax())]
    height = float(np.percentile(votes.points[mine, 2], _TOP_PERCENT))
    # Legs may be anywhere before a body; trunk and head are above its middle.
    upper = mine[votes.points[mine, 2] >= height - _UPPER_BODY]
    meant = mine if seems == "lying" else upper
    x, y = np.average(votes.middles[meant], axis=0, weights=votes.probability[meant]).tolist()
    confidence = float(votes.probability[mine].mean())
    if map_and_robot is not None:
        known, robot = map_and_robot
        points = votes.points[mine].astype(np.float64)
        on_map = known.distance_to(points[:, 0], points[:, 1], robot) < params.map_margin
        confidence -= params.map_penalty * float(on_map.mean())
        if known.depth_in_unknown(x, y, robot) > params.unknown_depth:
            confidence -= params.unknown_penalty
    camera = optical_in_base.translation
    distance = math.hypot(x - camera[0], y - camera[1])
    if confidence < params.minimum_confidence or distance > params.maximum_distance:
        return None
    posture, told_height = _shown(seems, height, cut=_is_cut_above(votes, mine))
    floor = _floor_around(votes, mine) if posture == "lying" else _NOWHERE
    return Detection(
        x,
        y,
        distance,
        confidence,
        posture,
        told_height,
        region=_region_of(votes, mine),
        outline=_outline_of(votes, mine, votes.points[mine, 2] <= _ROBOT_TOP, floor),
    )


def _is_cut_above(votes: _Votes, mine: NDArray[np.int64]) -> bool:
    """Tell whether the body may go on above the picture."""
    return int((votes.rows[mine] < _EDGE * INPUT_SIZE[1]).sum()) >= _FEW_VOTES


def _shown(seems: Posture, height: float, *, cut: bool) -> tuple[Posture, float]:
    """Return the posture and the height that a picture shows, which may cut the body above.

    What goes on above the picture does not lie: a bed is below the middle of a picture from a robot. And
    somebody who sits so near looks like somebody who stands.
    """
    if not cut:
        return seems, height
    is_told = seems == "sitting" or (seems == "standing" and height > _TALLEST_SEATED)
    return (seems if is_told else "unknown"), 0.0


def _outline_of(
    votes: _Votes, mine: NDArray[np.int64], shown: NDArray[np.bool_], floor: NDArray[np.float32]
) -> Outline:
    width, height = INPUT_SIZE
    others = np.zeros((height // STRIDE, width // STRIDE), np.uint8)
    others[votes.rows // STRIDE, votes.columns // STRIDE] = 1
    others[votes.rows[mine] // STRIDE, votes.columns[mine] // STRIDE] = 0
    beside_others = cv2.dilate(others, np.ones((3, 3), np.uint8)).astype(np.bool_)
    mine = mine[shown]
    columns, rows = votes.columns[mine], votes.rows[mine]
    at_edge = (columns < _EDGE * width) | (columns + STRIDE > (1.0 - _EDGE) * width)
    at_edge |= rows + STRIDE > (1.0 - _EDGE) * height
    goes_on = at_edge | beside_others[rows // STRIDE, columns // STRIDE]
    return Outline(votes.points[mine, :2], goes_on, floor)


def _floor_around(votes: _Votes, mine: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return where the picture shows the floor near somebody who lies, shape (m, 2), metres."""
    apart = votes.floor - votes.points[mine, :2].mean(axis=0)
    near: NDArray[np.float32] = votes.floor[np.hypot(apart[:, 0], apart[:, 1]) < _AROUND_M]
    return near


def _region_of(votes: _Votes, mine: NDArray[np.int64]) -> Region:
    """Return the part of the picture that holds all but a few of the votes."""
    few = 100.0 - _TOP_PERCENT
    left, right = np.percentile(votes.columns[mine], [few, _TOP_PERCENT]) / INPUT_SIZE[0]
    top, bottom = np.percentile(votes.rows[mine], [few, _TOP_PERCENT]) / INPUT_SIZE[1]
    return Region(
        float(left), float(top), float(right + STRIDE / INPUT_SIZE[0]), float(bottom + STRIDE / INPUT_SIZE[1])
    )
