"""The hot loop of drawing a map. Plain arrays in and out."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

_NEAREST_M, _FARTHEST_M = 0.25, 5.0
"""From so near to so far a scan tells what a gap is."""
_ON_M, _BEHIND_M = 0.07, 0.15
"""A beam that ends so near to a gap ends at it, and one that ends so far behind it goes through."""
_SQUARE, _SQUARER = math.tan(math.radians(8.0)), math.tan(math.radians(6.0))
"""Glass is seen where beams meet it within 8 degrees of a right angle; within 6 it must be."""
_NOT_SHOWN = 2
"""A beam that is not folded at something weighs as much as so many that are, where a mirror may end."""
_ITSELF_M, _ITSELF, _SIZE_M, _ASKEW = 0.05, 0.03, 0.025, 0.012
"""How far from where a mirror would show the laser a beam may end that is to show it, metres, and the metres
more for each metre before the gap; half of the laser's width, and how far the heading may be off, radians."""
_PAST_BEAMS, _ELSEWHERE_M = 2, 0.1
"""A gap that lets so many beams past where a mirror would show the laser does not show it; scans from so near
to each other say it once."""
_GRAZING = 1.0
"""Beams that meet a gap flatter than at 45 degrees may have passed beside it."""


@njit(cache=True)
def draw_beams(
    hits: NDArray[np.uint16],
    passes: NDArray[np.uint16],
    marks: NDArray[np.int32],
    mark: int,
    start_u: float,
    start_v: float,
    ends: NDArray[np.float64],
    met: NDArray[np.bool_],
    longest: float,
) -> None:
    """Count, for each cell, that a scan has seen a surface there, or has looked through it; once a scan.

    A cell where one beam ended is not counted as free because another one grazed it.

    Args:
        hits: Shape (rows, columns), scans with a beam that ended in the cell.
        passes: Shape (rows, columns), scans with beams that went on through it.
        marks: Shape (rows, columns): which scan counted the cell last.
        mark: The number of this scan, above those of earlier ones.
        start_u: Where the beams start, in columns.
        start_v: In rows.
        ends: Shape (n, 2), columns and rows where they end.
        met: Shape (n,), whether something is there.
        longest: They count up to here, cells.
    """
    rows, columns = hits.shape
    for k in range(len(ends)):
        u, v = ends[k, 0], ends[k, 1]
        column, row = math.floor(u), math.floor(v)
        if not met[k] or math.hypot(u - start_u, v - start_v) > longest:
            continue
        if 0 <= row < rows and 0 <= column < columns and marks[row, column] != mark:
            marks[row, column] = mark
            hits[row, column] += 1
    for k in range(len(ends)):
        along_u, along_v = ends[k, 0] - start_u, ends[k, 1] - start_v
        length = math.hypot(along_u, along_v)
        # The last cell before a surface may be half of it.
        reach = min(longest, length - 1.0 if met[k] else length)
        steps = math.ceil(2.0 * reach)
        for step in range(steps):
            share = 0.5 * step / length
            column, row = math.floor(start_u + share * along_u), math.floor(start_v + share * along_v)
            if 0 <= row < rows and 0 <= column < columns and marks[row, column] != mark:
                marks[row, column] = mark
                passes[row, column] += 1


@njit(cache=True)
def look_through(
    cells: NDArray[np.int8],
    origin: tuple[float, float],
    resolution: float,
    gap: tuple[float, float, float],
    side: int,
    starts: NDArray[np.float64],
    ends: NDArray[np.float64],
    first: NDArray[np.int64],
) -> tuple[int, int, int, int, int, float, float, int, float, float]:
    """Tell what beams say that met a gap: whether they were folded there, or ended, or went through.

    Args:
        cells: Shape (rows, columns) of the map; 0 free, 100 occupied, below 0 not known.
        origin: Of cell [0, 0], metres along the gap and across.
        resolution: Metres per cell.
        gap: Where it lies across, where it begins and ends along, metres.
        side: 1 where it is looked at from greater values across, else -1.
        starts: Shape (n, 2): where the beams of each scan start, metres along and across.
        ends: Shape (m, 2): where they end.
        first: Shape (n + 1,): the first beam of each scan.

    Returns:
        The beams that end behind it and, folded, at something, or on free floor, or where nothing is known;
        from how many places the laser itself was seen, as a mirror shows it that is met squarely, and from
        how many something past where it would be; the parts of the gap that have ended a beam that met it
        squarely, or let it through; the beams that came through it from behind; from where to where along it
        they are folded (:func:`_best_stretch`).
    """
    rows, columns = cells.shape
    across, low, high = gap
    margin = resolution
    size = max(1, round((high - low) / resolution))
    stopped, passed = np.zeros(size, np.bool_), np.zeros(size, np.bool_)
    shows = np.zeros(size, np.int64)
    folded = not_folded = unknown = behind = itself = past = 0
    itself_u = itself_v = past_u = past_v = np.inf
    for scan in range(len(starts)):
        height = side * (starts[scan, 1] - across)
        u0 = starts[scan, 0]
        if abs(height) < _NEAREST_M or math.hypot(height, max(0.0, max(low - u0, u0 - high))) > _FARTHEST_M:
            continue
        if height < 0.0:
            for k in range(first[scan], first[scan + 1]):
                beyond = side * (ends[k, 1] - across)
                if beyond > _BEHIND_M:
                    u = u0 + (ends[k, 0] - u0) * height / (height - beyond)
                    behind += low + margin < u < high - margin
            continue
        shown = looked = 0
        square = _SIZE_M / (2.0 * height) + _ASKEW if low + margin < u0 < high - margin else 0.0
        about = _ITSELF_M + _ITSELF * height
        for k in range(first[scan], first[scan + 1]):
            depth = side * (across - ends[k, 1])
            if depth < -_ON_M:
                continue
            u = u0 + (ends[k, 0] - u0) * height / (height + depth)
            if not low < u < high:
                continue
            slope = abs(ends[k, 0] - u0) / (height + depth)
            place = min(size - 1, int((u - low) / resolution))
            if slope < square and depth > height - about:
                if depth < height + about:
                    shown += 1
                    continue
                looked += 1
            if slope < _SQUARE:
                if depth <= _ON_M:
                    stopped[place] = True
                elif slope < _SQUARER:
                    passed[place] = True
            if depth < _BEHIND_M or slope > _GRAZING or not low + margin < u < high - margin:
                continue
            column = math.floor((ends[k, 0] - origin[0]) / resolution)
            row = math.floor((across + side * depth - origin[1]) / resolution)
            shows[place] -= _NOT_SHOWN
            if not (1 <= row < rows - 1 and 1 <= column < columns - 1):
                unknown += 1
                continue
            most = 0
            for v in range(row - 1, row + 2):
                for w in range(column - 1, column + 2):
                    most = max(most, cells[v, w])
            if most > 50:
                folded += 1
                shows[place] += 1 + _NOT_SHOWN
            elif cells[row, column] == 0:
                not_folded += 1
            else:
                unknown += 1
        if shown > 0 and not math.hypot(u0 - itself_u, height - itself_v) < _ELSEWHERE_M:
            itself, itself_u, itself_v = itself + 1, u0, height
        elif (
            shown == 0
            and looked >= _PAST_BEAMS
            and not math.hypot(u0 - past_u, height - past_v) < _ELSEWHERE_M
        ):
            past, past_u, past_v = past + 1, u0, height
    start, end = _best_stretch(shows)
    stretch = low + start * resolution, low + end * resolution
    parts = stopped.mean(), passed.mean()
    counts = folded, not_folded, unknown, itself, past
    return *counts, parts[0], parts[1], behind, stretch[0], stretch[1]


@njit(cache=True)
def _best_stretch(values: NDArray[np.int64]) -> tuple[int, int]:
    """Return the beginning and the end of the stretch with the largest sum (Kadane, in Bentley 1984)."""
    best = total = start = 0
    found = 0, 0
    for place in range(len(values)):
        total += values[place]
        if total > best:
            best, found = total, (start, place + 1)
        if total <= 0:
            total, start = 0, place + 1
    return found
