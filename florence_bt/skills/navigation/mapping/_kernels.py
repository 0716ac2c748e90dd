"""The hot loops of drawing a map, and of looking through gaps in its walls. Plain arrays in."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from florence_bt.skills.navigation.mapping.pane_evidence import Evidence

_NEAREST_M, _FARTHEST_M = 0.25, 5.0
"""From so near to so far a scan tells what a gap is."""
_ON_M, _BEHIND_M = 0.07, 0.15
"""A beam that ends so near to a gap ends at it, and one that ends so far behind it goes through."""
_SQUARE, _SQUARER = math.tan(math.radians(8.0)), math.tan(math.radians(6.0))
"""Glass is seen where beams meet it within 8 degrees of a right angle; within 6 it must be."""
_NOT_SHOWN = 2
"""A beam that is not folded at something weighs as much as so many that are, where a mirror may end."""
_ITSELF_M, _ITSELF, _SIZE_M, _ASKEW = 0.05, 0.03, 0.025, 0.012
"""Distance from where a mirror would show the laser at which a beam may end that is to show it, metres, and
the metres more for each metre before the gap; half of the laser's width, and the error of the heading,
radians."""
_PAST_BEAMS, _ELSEWHERE_M = 2, 0.1
"""A gap that lets so many beams past where a mirror would show the laser does not show it; scans from so near
to each other say it once."""
_LASER, _PAST_LASER = 1, 2
"""A beam through a gap shows the laser, as a mirror would, or something further away."""
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
) -> Evidence:
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
    """
    across, low, high = gap
    inner = low + resolution, high - resolution
    size = max(1, round((high - low) / resolution))
    stopped, passed = np.zeros(size, np.bool_), np.zeros(size, np.bool_)
    shows = np.zeros(size, np.int64)
    folded = not_folded = unknown = behind = 0
    for scan in range(len(starts)):
        u0, height = starts[scan, 0], side * (starts[scan, 1] - across)
        if abs(height) < _NEAREST_M or math.hypot(height, max(0.0, max(low - u0, u0 - high))) > _FARTHEST_M:
            continue
        beams = ends[first[scan] : first[scan + 1]]
        if height < 0.0:
            behind += _count_from_behind(beams, u0, height, across, side, inner)
            continue
        for k in range(len(beams)):
            depth = side * (across - beams[k, 1])
            if depth < -_ON_M:
                continue
            u, slope = _crossing(beams[k, 0], u0, height, depth)
            if not low < u < high or _shows_laser(u0, height, depth, slope, inner) == _LASER:
                continue
            place = min(size - 1, int((u - low) / resolution))
            if slope < _SQUARE:
                if depth <= _ON_M:
                    stopped[place] = True
                elif slope < _SQUARER:
                    passed[place] = True
            if depth < _BEHIND_M or slope > _GRAZING or not inner[0] < u < inner[1]:
                continue
            column = math.floor((beams[k, 0] - origin[0]) / resolution)
            row = math.floor((across + side * depth - origin[1]) / resolution)
            shows[place] -= _NOT_SHOWN
            there = _cell_at(cells, row, column)
            if there > 0:
                folded += 1
                shows[place] += 1 + _NOT_SHOWN
            elif there == 0:
                not_folded += 1
            else:
                unknown += 1
    itself, past = _count_laser(gap, side, inner, starts, ends, first)
    start, end = _best_stretch(shows)
    return Evidence(
        folded,
        not_folded,
        unknown,
        itself,
        past,
        stopped.mean(),
        passed.mean(),
        behind,
        low + start * resolution,
        low + end * resolution,
    )


@njit(cache=True)
def _crossing(end_u: float, start_u: float, height: float, depth: float) -> tuple[float, float]:
    """Return where along a gap a beam meets it, and how far it runs along for each metre across.

    Args:
        end_u: Where the beam ends, metres along.
        start_u: Where it starts.
        height: Metres from its start to the gap.
        depth: Metres from there to its end.
    """
    u = start_u + (end_u - start_u) * height / (height + depth)
    return u, abs(end_u - start_u) / (height + depth)


@njit(cache=True)
def _count_from_behind(
    beams: NDArray[np.float64],
    start_u: float,
    height: float,
    across: float,
    side: int,
    inner: tuple[float, float],
) -> int:
    """Count the beams of a scan behind a gap (``height`` below zero) that came through it."""
    count = 0
    for k in range(len(beams)):
        beyond = side * (beams[k, 1] - across)
        if beyond > _BEHIND_M:
            u = start_u + (beams[k, 0] - start_u) * height / (height - beyond)
            count += inner[0] < u < inner[1]
    return count


@njit(cache=True)
def _cell_at(cells: NDArray[np.int8], row: int, column: int) -> int:
    """Return 1 where the map has something in a cell or beside it, 0 where it is free, else -1."""
    rows, columns = cells.shape
    if not (1 <= row < rows - 1 and 1 <= column < columns - 1):
        return -1
    for v in range(row - 1, row + 2):
        for u in range(column - 1, column + 2):
            if cells[v, u] > 50:
                return 1
    return 0 if cells[row, column] == 0 else -1


@njit(cache=True)
def _shows_laser(
    start_u: float, height: float, depth: float, slope: float, inner: tuple[float, float]
) -> int:
    """Tell whether a beam ends where a mirror in a gap would show the laser, or goes on past that.

    Args:
        start_u: Where it starts, metres along the gap; only a laser before the gap is shown.
        height: Metres from its start to the gap.
        depth: Metres from there to its end.
        slope: How far it runs along for each metre across; a mirror shows the laser where it is met squarely.
        inner: The gap without its edges, metres along.

    Returns:
        ``_LASER``, ``_PAST_LASER``, or 0 when it says nothing about that.
    """
    if not inner[0] < start_u < inner[1] or slope >= _SIZE_M / (2.0 * height) + _ASKEW:
        return 0
    about = _ITSELF_M + _ITSELF * height
    if depth <= height - about:
        return 0
    return _LASER if depth < height + about else _PAST_LASER


@njit(cache=True)
def _count_laser(
    gap: tuple[float, float, float],
    side: int,
    inner: tuple[float, float],
    starts: NDArray[np.float64],
    ends: NDArray[np.float64],
    first: NDArray[np.int64],
) -> tuple[int, int]:
    """Count the places from which a gap shows the laser, and those from which it shows something past it.

    Args:
        gap: As of :func:`look_through`; the others too.
        side: From where it is looked at.
        inner: The gap without its edges, metres along.
        starts: Where the beams of each scan start.
        ends: Where they end.
        first: The first beam of each scan.
    """
    across, low, high = gap
    itself = past = 0
    itself_u = itself_v = past_u = past_v = np.inf
    for scan in range(len(starts)):
        u0, height = starts[scan, 0], side * (starts[scan, 1] - across)
        if not (inner[0] < u0 < inner[1] and _NEAREST_M <= height <= _FARTHEST_M):
            continue
        shown = looked = 0
        for k in range(first[scan], first[scan + 1]):
            depth = side * (across - ends[k, 1])
            if depth < -_ON_M:
                continue
            u, slope = _crossing(ends[k, 0], u0, height, depth)
            if low < u < high:
                what = _shows_laser(u0, height, depth, slope, inner)
                shown += what == _LASER
                looked += what == _PAST_LASER
        if shown > 0:
            if not math.hypot(u0 - itself_u, height - itself_v) < _ELSEWHERE_M:
                itself, itself_u, itself_v = itself + 1, u0, height
        elif looked >= _PAST_BEAMS and not math.hypot(u0 - past_u, height - past_v) < _ELSEWHERE_M:
            past, past_u, past_v = past + 1, u0, height
    return itself, past


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
