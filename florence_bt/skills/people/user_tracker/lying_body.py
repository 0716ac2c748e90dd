"""The place of somebody who lies: from all pictures of them, as they do not move.

From nearby, where only a part of them is in the picture, the network takes the middle of that for theirs: it
is a quarter of a metre off along the body, and more; in a bed also in pictures of the whole, towards the
blanket. Several pictures show both ends: the middle is between them, a little nearer to the head of who lies
under a blanket. When no picture shows where one end is, the middle is at least half an adult from the other.

Somebody on the floor hides a part of themselves: legs lie behind a trunk, and what the picture shows is not
all. There the floor tells more: a body lies over all places that show it, and over none that shows the floor.
Every middle and every length that a body may have is held against both, and against what the network says.
"""

from __future__ import annotations

import math
import statistics
from collections import Counter, deque

import numpy as np
from numpy.typing import NDArray

from florence_bt.skills.people.user_tracker.detector import Detection

_WHOLE_SIGMA, _CUT_SIGMA = 0.07, 0.3
"""Standard deviation of the middle in a picture of the whole body, and of a part of it, metres."""
_MOVED_M = 0.5
"""A person seen so far away from where they lay lies somewhere else now, or is somebody else, unless what is
seen is a part of the same body."""
_KNOWN_SHARE = 0.5
"""Share of an outline at a known place of somebody who lies from which it is they, whatever its middle."""
_MOST, _KEPT_S = 20, 600.0
"""So many bodies are remembered, and one for so long after it was seen last: they may lie otherwise then, and
the odometry has drifted. Chosen."""
_CELL_M, _SIGHTINGS = 0.05, 2
"""A place of this size belongs to a body that so many pictures show there."""
_HEIGHTS = 9
"""So many of the last pictures tell how high they lie."""
_STRAY_PERCENT = 1.0
"""Of the places at each end of a body, so many may be something else."""
_SHORTEST_M, _LONGEST_M, _WIDEST_M = 0.7, 2.1, 0.8
"""Lengths and width of what can be somebody who lies. Chosen."""
_CLEAR_CELLS = 3
"""Cells beyond an end that is shown, in which a body that ends there does not go on."""
_HALF_M = 0.85
"""Half of an adult."""
_END_M, _WIDE_M, _TO_HEAD_M = 0.2, 0.5, 0.15
"""An end of a body that is so wide over this length is that of a blanket: it goes on beyond the feet, as the
head does beyond what is seen of it on a pillow."""

FLOOR_HEIGHT = 0.5
"""Metres; a person on the floor is nowhere higher than this; on a bed or a sofa they are."""
_CHILDREN = 0.25
"""Share of children among people, at most: those are shorter than the adults of ``_LENGTHS_M``."""
_LENGTHS_M = np.arange(0.9, 2.05, 0.1)
_LENGTH_ODDS = np.where(_LENGTHS_M < 1.45, _CHILDREN / 6, (1.0 - _CHILDREN) / 6)
_MIDDLES_M = np.arange(-1.5, 1.51, _CELL_M)
_REACH_CELLS = 60
"""Lengths of a body, their probabilities, and places of its middle along what is seen; and the distance to
each side of what is seen in which the floor counts."""
_MISSED, _FLOOR_WITHIN = 1.5, 0.8
"""By so much the logarithm of the probability drops for every 5 cm of the body that would not be covered, and
for every 5 cm of floor that would: single pictures may be wrong. Chosen; twice as much changes little."""
_VOTE_SIGMA = 0.5
"""Standard deviation, along the body, of the middle that the network tells of a part of it, metres."""
_BESIDE_M = 0.08
"""The floor so near to the line through the middle is under a body, also between two legs, metres."""

Cell = tuple[int, int]


class LyingBody:
    """A lying body, as pictures have shown it.

    Attributes:
        seen: When it was seen last, seconds.
    """

    def __init__(self) -> None:
        self.seen = 0.0
        self._weight = 0.0
        self._mean = 0.0, 0.0
        self._inside: Counter[Cell] = Counter()
        self._floor: Counter[Cell] = Counter()
        self._clear: set[Cell] = set()
        self._heights: deque[float] = deque(maxlen=_HEIGHTS)

    @property
    def place(self) -> tuple[float, float] | None:
        """The middle, metres, in the frame of the detections; None before the first."""
        if self._weight == 0.0:
            return None
        return (self._middle_on_floor() if self._on_the_floor else self._middle_of_body()) or self._mean

    @property
    def _on_the_floor(self) -> bool:
        return bool(self._heights) and statistics.median(self._heights) < FLOOR_HEIGHT

    def take(self, detection: Detection) -> None:
        """Take what a picture shows of them."""
        outline = detection.outline
        is_cut = outline is not None and bool(outline.goes_on.any())
        weight = (_CUT_SIGMA if is_cut else _WHOLE_SIGMA) ** -2
        self._weight += weight
        part, (x, y) = weight / self._weight, self._mean
        self._mean = x + part * (detection.x - x), y + part * (detection.y - y)
        if detection.height:
            self._heights.append(detection.height)
        if outline is not None:
            inside, cut = (_cells(outline.points[part]) for part in (~outline.goes_on, outline.goes_on))
            self._inside.update(inside | cut)
            self._floor.update(_cells(outline.floor))
            self._clear |= {
                cell for cell in inside if all(math.dist(cell, other) > _CLEAR_CELLS for other in cut)
            }

    def shows(self, detection: Detection) -> bool:
        """Tell whether a picture shows this body where it is known to be, or with its middle near."""
        if self.place is not None and math.dist(self.place, (detection.x, detection.y)) <= _MOVED_M:
            return True
        if detection.outline is None:
            return False
        cells = _cells(detection.outline.points)
        known = [
            any((column + i, row + j) in self._inside for i in (-1, 0, 1) for j in (-1, 0, 1))
            for column, row in cells
        ]
        if sum(known) > _KNOWN_SHARE * len(known):
            return True
        return (
            self._on_the_floor and 0.0 < detection.height < FLOOR_HEIGHT and _is_one_body(cells | self._shown)
        )

    @property
    def _shown(self) -> set[Cell]:
        """Return where pictures show the body, and not more of them the floor."""
        return {cell for cell, count in self._inside.items() if count >= max(_SIGHTINGS, self._floor[cell])}

    def _middle_on_floor(self) -> tuple[float, float] | None:
        """Return the mean of all middles that it may have, by their probability; None without a body."""
        shown = self._shown
        if len(shown) < 2:
            return None
        body = _places(shown)
        centre = body.mean(axis=0)
        axes = np.linalg.svd(body - centre, full_matrices=False)[2]
        along, across = ((body - centre) @ axes.T).T
        voted, beside = (np.array(self._mean) - centre) @ axes.T
        floor = [
            cell for cell, count in self._floor.items() if count >= max(_SIGHTINGS, self._inside[cell] + 1)
        ]
        floor_along, floor_across = ((_places(floor) - centre) @ axes.T).T
        left, right = sorted((float(np.median(across)), float(beside)))
        under = (floor_across > left - _BESIDE_M) & (floor_across < right + _BESIDE_M)
        body_until, floor_until = _cells_until(along), _cells_until(floor_along[under])

        half = _LENGTHS_M[None, :] / 2.0
        first, last = _MIDDLES_M[:, None] - half, _MIDDLES_M[:, None] + half
        missed = body_until[-1] - _between(body_until, first - _CELL_M, last + _CELL_M)
        within = _between(floor_until, first + _CELL_M, last - _CELL_M)
        doubt = _MISSED * missed + _FLOOR_WITHIN * within
        doubt += ((_MIDDLES_M - voted)[:, None] / _VOTE_SIGMA) ** 2 / 2.0
        odds = np.exp(doubt.min() - doubt) * _LENGTH_ODDS
        middle = float((odds.sum(axis=1) * _MIDDLES_M).sum() / odds.sum())
        x, y = (centre + np.array([middle, beside]) @ axes).tolist()
        return x, y

    def _middle_of_body(self) -> tuple[float, float] | None:
        """Return the network's middle, moved along the body by its known ends; None without any."""
        cells = [cell for cell, count in self._inside.items() if count >= _SIGHTINGS]
        if len(cells) < 2:
            return None
        body = _places(cells)
        middle = body.mean(axis=0)
        axes = np.linalg.svd(body - middle, full_matrices=False)[2]

        cells_along, cells_across = ((body - middle) @ axes.T).T
        low, high = np.percentile(cells_along, [_STRAY_PERCENT, 100.0 - _STRAY_PERCENT])
        if not _SHORTEST_M <= high - low <= _LONGEST_M:
            return None
        clear = (_places(self._clear) - middle) @ axes[0]
        low_is_open = not (clear < low + _CELL_M).any()
        high_is_open = not (clear > high - _CELL_M).any()
        low_is_wide, high_is_wide = (
            np.ptp(cells_across[end]) > _WIDE_M
            for end in (cells_along < low + _END_M, cells_along > high - _END_M)
        )
        if low_is_wide != high_is_wide:
            to_head = _TO_HEAD_M if low_is_wide else -_TO_HEAD_M
            low, high = low + to_head, high + to_head
        along, across = (np.array(self._mean) - middle) @ axes.T
        if low_is_open != high_is_open:
            along = min(along, high - _HALF_M) if low_is_open else max(along, low + _HALF_M)
        elif not low_is_open:
            along = (low + high) / 2
        x, y = (middle + np.array([along, across]) @ axes).tolist()
        return x, y


class LyingBodies:
    """Remembers where people lie, whoever they are: of a body that is cut the network may see two middles."""

    def __init__(self) -> None:
        self._places: list[LyingBody] = []

    def near(self, detection: Detection, now: float) -> LyingBody:
        """Return the body of somebody who was seen lying and may be meant, or a new one; seconds."""
        self._places = [each for each in self._places if now - each.seen <= _KEPT_S]
        body = next((each for each in self._places if each.shows(detection)), None)
        if body is None:
            body = LyingBody()
            self._places = [*self._places[1 - _MOST :], body]
        body.seen = now
        return body


def _cells(points: NDArray[np.float32]) -> set[Cell]:
    return {(column, row) for column, row in np.floor(points / _CELL_M).astype(int).tolist()}


def _is_one_body(cells: set[Cell]) -> bool:
    """Tell whether all of these places may show one person on the floor: legs here, a trunk there."""
    if len(cells) < 2:
        return False
    places = _places(cells)
    places -= places.mean(axis=0)
    turned = places @ np.linalg.svd(places, full_matrices=False)[2].T
    low, high = np.percentile(turned, [_STRAY_PERCENT, 100.0 - _STRAY_PERCENT], axis=0)
    long, wide = high - low
    return bool(long <= _LONGEST_M and wide <= _WIDEST_M)


def _cells_until(along: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return how many cells of a line have one of these places, up to each cell; metres."""
    filled = np.zeros(2 * _REACH_CELLS, np.int64)
    cells = np.floor(along / _CELL_M).astype(int) + _REACH_CELLS
    filled[cells[(cells >= 0) & (cells < len(filled))]] = 1
    return np.concatenate([[0], np.cumsum(filled)])


def _between(
    until: NDArray[np.int64], first: NDArray[np.float64], last: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Return how many cells of a line are filled from one place to another one, metres."""
    start, end = (
        np.clip(np.rint(place / _CELL_M).astype(int) + _REACH_CELLS, 0, 2 * _REACH_CELLS)
        for place in (first, last)
    )
    return until[np.maximum(start, end)] - until[start]


def _places(cells: set[Cell] | list[Cell]) -> NDArray[np.float64]:
    """Return the middles of cells, shape (n, 2), metres."""
    return (np.array(sorted(cells), float).reshape(-1, 2) + 0.5) * _CELL_M
