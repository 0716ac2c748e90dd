"""Draws the map of the kept scans, and draws it anew where the past was corrected or a pane was found."""

from __future__ import annotations

import math
from collections.abc import Sequence

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.mapping.grid_builder import GridBuilder
from florence_bt.skills.navigation.mapping.kept_scan import KeptScan
from florence_bt.skills.navigation.mapping.panes import Pane, find_panes
from florence_bt.skills.navigation.mapping.parameters import SlamParameters
from florence_bt.skills.navigation.mapping.wall_direction import wall_direction

_NEAR_M, _SEEN_M = 4.0, 6.5
"""With each newer map panes are looked for so near to the robot, by the map and the scans of so far around;
all of them when the past was corrected."""
_TURN_EVERY = 20
"""Kept scans from one look at how the walls run to the next."""
_SAME_M = 0.15
"""A pane that was found again so near is drawn where it was."""


class MapDrawer:
    """Draws the map twice: as the laser saw it, where panes are looked for, and with nothing behind them.

    Attributes:
        panes: Mirrors and panes of glass on the map.
    """

    def __init__(self, parameters: SlamParameters) -> None:
        self._p = parameters
        self._seen = self._cut = _Drawing(parameters, ())
        self._revision = self._looked = self._touches = self._turned = 0
        self._angle = 0.0
        self.panes: tuple[Pane, ...] = ()

    def draw(
        self, scans: Sequence[KeptScan], poses: Sequence[Pose2], revision: int, touches: Sequence[Pose2]
    ) -> OccupancyGrid:
        """Draw the map.

        Args:
            scans: All kept scans, more than last time or as many.
            poses: base_footprint at each of them, map frame.
            revision: Differs from last time when the poses of older scans do.
            touches: base_footprint where the bumper met something, turned towards that.

        Raises:
            ConfigError: It would become too large.
        """
        corrected, self._revision = revision != self._revision, revision
        if corrected:
            self._seen = _Drawing(self._p, ())
        grid = self._seen.draw(scans, poses)
        if not self._p.find_panes:
            return grid
        panes = self.panes
        if corrected or (len(scans), len(touches)) != (self._looked, self._touches):
            self._looked, self._touches = len(scans), len(touches)
            if corrected or len(scans) >= self._turned:
                self._angle, self._turned = -wall_direction(grid), len(scans) + _TURN_EVERY
            panes = self._find(grid, scans, poses, touches, poses[-1] if scans and not corrected else None)
        if corrected or set(panes) != set(self.panes):
            self.panes = panes
            self._cut = _Drawing(self._p, panes)
        return self._cut.draw(scans, poses) if panes else grid

    def _find(
        self,
        grid: OccupancyGrid,
        scans: Sequence[KeptScan],
        poses: Sequence[Pose2],
        touches: Sequence[Pose2],
        here: Pose2 | None,
    ) -> tuple[Pane, ...]:
        """Find the panes that are near to the robot, and keep the others; all anew without a place."""
        if here is None:
            return self._known(find_panes(grid, self._angle, scans, poses, touches, self.panes))
        around = [number for number, pose in enumerate(poses) if here.distance_to(pose) <= _SEEN_M]
        found = find_panes(
            _window(grid, here, _SEEN_M),
            self._angle,
            [scans[number] for number in around],
            [poses[number] for number in around],
            [touch for touch in touches if here.distance_to(touch) <= _SEEN_M],
            self.panes,
        )
        place = here.x, here.y
        far = [each for each in self.panes if math.dist(each.middle, place) > _NEAR_M]
        near = [each for each in self._known(found) if math.dist(each.middle, place) <= _NEAR_M]
        return (*far, *near)

    def _known(self, found: Sequence[Pane]) -> tuple[Pane, ...]:
        """Return panes as they were drawn before, and the new ones."""
        places = {
            pane: next((each for each in self.panes if each.is_near(pane, _SAME_M)), pane) for pane in found
        }
        return tuple(dict.fromkeys(places.values()))


def _window(grid: OccupancyGrid, here: Pose2, reach: float) -> OccupancyGrid:
    """Return the part of a map so far around a place, metres."""
    row, column = grid.cell_of(here.x, here.y)
    cells = round(reach / grid.resolution)
    low_row, low_column = max(0, row - cells), max(0, column - cells)
    part = grid.cells[low_row : max(0, row + cells + 1), low_column : max(0, column + cells + 1)]
    x, y = (
        start + low * grid.resolution
        for start, low in ((grid.origin.x, low_column), (grid.origin.y, low_row))
    )
    return OccupancyGrid(grid.resolution, Pose2(x, y), part)


class _Drawing:
    """The scans that were drawn so far, with what is behind panes or without."""

    def __init__(self, parameters: SlamParameters, panes: tuple[Pane, ...]) -> None:
        self._builder = GridBuilder(parameters.resolution, parameters.map_range, panes)
        self._drawn = 0

    def draw(self, scans: Sequence[KeptScan], poses: Sequence[Pose2]) -> OccupancyGrid:
        """Draw what was not drawn yet, and return the map."""
        for number in range(self._drawn, len(scans)):
            self._builder.add(scans[number], poses[number])
        self._drawn = len(scans)
        return self._builder.grid()
