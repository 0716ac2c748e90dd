"""Exploration of a growing map: frontiers, known free floor beside what nobody has seen yet.

Source: Yamauchi, A frontier-based approach for autonomous exploration, 1997.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from florence_bt.core.geometry import Point2, Pose2
from florence_bt.core.limits import CheckedParameters, NotNegative, Positive
from florence_bt.core.outcome import Result, failure, success
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL, Cells
from florence_bt.skills.navigation.navigate.costmap import Costmap
from florence_bt.skills.navigation.navigate.planner import ways_from
from florence_bt.skills.navigation.navigate.results import MAP_IS_FIXED, OUT_OF_REACH
from florence_bt.skills.robot_description.room import START_CLEARANCE_M

_PIECE_M = 1.0
"""A long frontier is looked at in pieces of about this length."""
_SAME_M = 0.5
"""A frontier so near to one that was looked at is the same one."""
_CLOSE_M = 0.4
"""From so far away the robot looks at a frontier best: it sees past its ends, and what it does not see stands
beyond its outline. What is so close behind the frontier is what it looks at."""
_MOST_CANDIDATES = 60
"""Places from which a piece of a frontier may be looked at that are tried, the best first."""
_NEAR_M = 1.0
"""A place within the inflation radius of an obstacle is as bad as one this much further from the frontier:
the camera may find more of it, and then there is no room to turn."""
_STOOD_M = 0.1
"""A robot that asks where to look next, and is no further from where it asked last, did not get away."""
_DOOR_M = 0.7
"""A frontier of this length may be a way to somewhere."""
_ROOM_M2 = 1.0
"""A smaller hole in the map holds no room, whatever its frontier: the inside of furniture. Chosen below the
smallest toilets, of 0.8 m by 1.3 m."""
_TURN_M_PER_RAD, _LENGTH_M, _LONGEST_M = 0.3, 0.5, 3.0
"""The metres of way that a turn is worth, that a metre of frontier is, and the length from which on a longer
frontier is not better. Chosen."""
_NEITHER = ndimage.generate_binary_structure(2, 1)
_TOUCHING = ndimage.generate_binary_structure(2, 2)


@dataclass(frozen=True, slots=True)
class ExplorationParameters(CheckedParameters):
    """The parameters of exploration.

    Attributes:
        map_grows: Whether the map is being made: then a newer one takes the place of an older one without an
            end of the goal, and there are frontiers to look at.
        frontier_length: Shorter frontiers are not looked at, in metres.
        frontier_area: Nor are those of a smaller hole in the map, in square metres.
        frontier_distance: From how far away at most the robot looks at one, in metres.
    """

    map_grows: bool = False
    frontier_length: NotNegative = 0.45
    frontier_area: NotNegative = 0.2
    frontier_distance: Positive = 1.5


@dataclass(frozen=True, slots=True)
class Frontier:
    """A piece of a frontier, and whence to look at it.

    Attributes:
        x: Its middle, map frame, metres.
        y: Metres.
        length: Metres.
        view: Where the robot is to stand, towards it; None when there is no such place that it gets to.
        way: Metres that it drives there, infinite when there is none.
        area: Square metres of the hole in the map behind it, infinite for what is beyond the map.
    """

    x: float
    y: float
    length: float
    view: Pose2 | None
    way: float
    area: float = math.inf

    @property
    def may_be_door(self) -> bool:
        """Tell whether it is as wide as a door, and what is behind it as large as a room."""
        return self.length >= _DOOR_M and self.area >= _ROOM_M2


def frontiers(
    costmap: Costmap,
    robot: Pose2,
    parameters: ExplorationParameters,
    costs: Cells | None = None,
    *,
    narrow: bool = True,
) -> Iterator[Frontier]:
    """Yield the pieces of all frontiers, and whence to look at them.

    Args:
        costmap: The global costmap: its map grows, and what the sensors have marked is in the way.
        robot: base_footprint in its frame.
        parameters: What counts.
        costs: Costs to use in place of the costmap's own (the static layer alone), same shape.
        narrow: Whether ways count on which the robot has no room to turn.
    """
    costs = costmap.master if costs is None else costs
    ways = _ways(costmap, costs, robot, INSCRIBED if narrow else costmap.harmless_below)
    sizes = _hole_sizes(costmap.unknown)
    unknown = sizes >= max(1, round(parameters.frontier_area / costmap.resolution**2))
    for cells, length in _pieces(costmap, costs, unknown, parameters.frontier_length):
        middle = cells[np.argmin(np.hypot(*(cells - cells.mean(axis=0)).T))]
        x, y = _places(costmap, middle[None])[0].tolist()
        behind = _behind(costmap, unknown, middle)
        view = _view(costmap, costs, ways, middle, behind, parameters.frontier_distance)
        way = math.inf if view is None else float(ways[view[1]])
        area = _largest_beside(sizes, cells) * costmap.resolution**2
        yield Frontier(x, y, length, view and view[0], way, area)


class Exploration:
    """Remembers at what the robot has looked already, or tried to.

    A frontier that is still there after it was looked at, or that could not be reached, is left aside until
    there is no other; then it has a second chance, as the map knows more ways by then. A drive on which the
    robot did not get away from where it stood tells nothing of the frontier: once it is away, it does not
    count.
    """

    def __init__(self, costmap: Costmap, parameters: ExplorationParameters) -> None:
        self._costmap, self._p = costmap, parameters
        self._looked: list[tuple[Point2, int]] = []
        self._sent_from: Pose2 | None = None
        self._tried: list[tuple[Point2, int]] = []
        self._view = Pose2()

    def stands(self, robot: Pose2) -> bool:
        """Tell whether the robot did not get away from where it was when it asked last."""
        return self._sent_from is not None and self._sent_from.distance_to(robot) < _STOOD_M

    def next_view(self, robot: Pose2, number: int) -> Result:
        """Run the skill ``get_frontier``.

        Args:
            robot: base_footprint in the map.
            number: 1 begins anew: nothing counts as looked at.

        Returns:
            With the output ``pose``; or ``nothing_left``, or ``out_of_reach`` where the map stays open.
        """
        if not self._p.map_grows:
            return failure("map_is_fixed", MAP_IS_FIXED)
        away = not self.stands(robot)
        if self._tried and (away or self._view.distance_to(robot) < _STOOD_M):
            place, _ = self._tried.pop()
            if away:
                self._tried.clear()
            self._looked.append((place, self._times(place) + 1))
        if away:
            self._sent_from = robot
        if number <= 1:
            self._looked.clear()
            self._tried.clear()
        # What the sensors have marked in a door may be gone by the time that the robot is there.
        # Where it has no room to turn it may not get out again: it goes there last, to what may be a door.
        seen, static = self._costmap.master, self._costmap.static_master()
        for costs, narrow in ((seen, False), (static, False), (seen, True), (static, True)):
            pieces = frontiers(self._costmap, robot, self._p, costs, narrow=narrow)
            found = [(self._times((each.x, each.y)), each) for each in pieces]
            open_ones = [
                each
                for each in found
                if each[0] < 2 and each[1].view is not None and (each[1].may_be_door or not narrow)
            ]
            if open_ones:
                break
        else:
            return _end([each for _, each in found])
        times, best = min(open_ones, key=lambda each: (each[0], _price(each[1], robot)))
        assert best.view is not None
        self._tried.append(((best.x, best.y), times + 1))
        self._view = best.view
        return success(pose=best.view)

    def _times(self, place: Point2) -> int:
        """Return how often the robot was sent to look at a place."""
        sent = (*self._looked, *self._tried)
        return max((times for other, times in sent if math.dist(place, other) < _SAME_M), default=0)


def _end(left: Sequence[Frontier]) -> Result:
    """Tell what the robot has not seen, when it can look at nothing more."""
    large = [each for each in left if each.may_be_door]
    if large:
        most = max(large, key=lambda each: each.length)
        where = f"the largest is {most.length:.1f} m wide, at ({most.x:.1f}, {most.y:.1f})"
        return failure("out_of_reach", f"{OUT_OF_REACH}: {_places_text(len(large))}; {where}")
    aside = f"; {_places_text(len(left))} cannot be seen better" if left else ""
    return failure("nothing_left", f"the robot has seen all that it can get to{aside}")


def _places_text(count: int) -> str:
    return "1 place" if count == 1 else f"{count} places"


def _price(frontier: Frontier, robot: Pose2) -> float:
    turn = abs(math.remainder(robot.bearing_to(frontier.x, frontier.y), math.tau))
    gain = _LENGTH_M * min(frontier.length, _LONGEST_M)
    return frontier.way + _TURN_M_PER_RAD * turn - gain


def _ways(costmap: Costmap, costs: Cells, robot: Pose2, below: int) -> NDArray[np.float64]:
    """Return the metres from the robot to each cell over floor of a cost below that, infinite elsewhere."""
    floor = costs < below
    start = costmap.cell_of(robot.x, robot.y)
    if start is None:
        return np.full(floor.shape, math.inf)
    # It may stand on what its laser has not seen yet, or too near to something.
    floor |= (costmap.distances_to(robot.x, robot.y) <= START_CLEARANCE_M) & (costs != LETHAL)
    return ways_from(start, floor, costmap.resolution)


def _pieces(
    costmap: Costmap, costs: Cells, unknown: NDArray[np.bool_], shortest: float
) -> Iterator[tuple[NDArray[np.int64], float]]:
    """Yield the cells (row, column) of each piece of a frontier, shape (n, 2), and its length in metres."""
    beside = ndimage.binary_dilation(unknown, _NEITHER)
    frontier = beside & ~costmap.unknown & (costs < LETHAL)
    labels, count = ndimage.label(frontier, _TOUCHING)
    least = shortest / costmap.resolution
    size = max(1, round(_PIECE_M / costmap.resolution))
    for number, window in enumerate(ndimage.find_objects(labels, count), 1):
        cells = np.argwhere(labels[window] == number) + [part.start for part in window]
        if len(cells) < least:
            continue
        _, piece = np.unique((cells - cells.min(axis=0)) // size, axis=0, return_inverse=True)
        for each in range(piece.max() + 1):
            part = cells[piece.ravel() == each]
            yield part, len(part) * costmap.resolution


def _hole_sizes(unknown: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return at each unknown cell how many its hole has, infinite for what reaches the border; else 0."""
    labels, count = ndimage.label(np.pad(unknown, 1, constant_values=True), _NEITHER)
    sizes = np.bincount(labels.ravel(), minlength=count + 1).astype(np.float64)
    sizes[labels[0, 0]] = math.inf
    sizes[0] = 0.0
    of_cells: NDArray[np.float64] = sizes[labels][1:-1, 1:-1]
    return of_cells


def _largest_beside(sizes: NDArray[np.float64], cells: NDArray[np.int64]) -> float:
    """Return the size of the largest hole beside some cells (row, column), shape (n, 2), in cells."""
    low, high = np.maximum(cells.min(axis=0) - 1, 0), cells.max(axis=0) + 2
    beside = ndimage.maximum_filter(sizes[low[0] : high[0], low[1] : high[1]], footprint=_NEITHER)
    return float(beside[tuple((cells - low).T)].max())


def _behind(costmap: Costmap, unknown: NDArray[np.bool_], middle: NDArray[np.int64]) -> Point2:
    """Return the middle of what is not known close to a cell of a frontier, metres."""
    reach = round(_CLOSE_M / costmap.resolution)
    low = np.maximum(middle - reach, 0)
    window = unknown[low[0] : middle[0] + reach + 1, low[1] : middle[1] + reach + 1]
    x, y = _places(costmap, np.argwhere(window) + low).mean(axis=0).tolist()
    return x, y


def _view(
    costmap: Costmap,
    costs: Cells,
    ways: NDArray[np.float64],
    middle: NDArray[np.int64],
    behind: Point2,
    reach_m: float,
) -> tuple[Pose2, tuple[int, int]] | None:
    """Return the best pose to look past a cell from, and its cell; None when there is none.

    The robot has room to turn there: from a tight corner it may not get out again.
    """
    reach = math.ceil(reach_m / costmap.resolution)
    low = np.maximum(middle - reach, 0)
    window = ways[low[0] : middle[0] + reach + 1, low[1] : middle[1] + reach + 1]
    cells = np.argwhere(np.isfinite(window)) + low
    away = np.hypot(*(cells - middle).T) * costmap.resolution
    roomy = costs[cells[:, 0], cells[:, 1]] < costmap.harmless_below
    cells, away = cells[roomy & (away <= reach_m)], away[roomy & (away <= reach_m)]
    badness = np.abs(away - _CLOSE_M) + _NEAR_M * (costs[cells[:, 0], cells[:, 1]] > 0)
    for cell in cells[np.argsort(badness, kind="stable")[:_MOST_CANDIDATES]]:
        x, y = _places(costmap, cell[None])[0].tolist()
        view = Pose2(x, y, math.atan2(behind[1] - y, behind[0] - x))
        if _sees(costs, cell, middle):
            return view, (int(cell[0]), int(cell[1]))
    return None


def _sees(costs: Cells, eye: NDArray[np.int64], there: NDArray[np.int64]) -> bool:
    """Tell whether nothing stands between two cells."""
    steps = 1 + 2 * int(np.abs(there - eye).max())
    between = np.rint(np.linspace(eye, there, steps)).astype(np.int64)
    return bool((costs[between[:, 0], between[:, 1]] != LETHAL).all())


def _places(costmap: Costmap, cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the middles of cells, x and y in metres; shape (n, 2)."""
    origin = np.array([costmap.origin_x, costmap.origin_y])
    places: NDArray[np.float64] = origin + (cells[:, ::-1] + 0.5) * costmap.resolution
    return places
