"""Draws the map of the kept scans, and draws it anew where the past was corrected or a pane was found."""

from __future__ import annotations

from collections.abc import Sequence

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.mapping.grid_builder import GridBuilder
from florence_bt.skills.navigation.mapping.kept_scan import KeptScan
from florence_bt.skills.navigation.mapping.panes import Pane, find_panes
from florence_bt.skills.navigation.mapping.parameters import SlamParameters

_LOOK_EVERY = 5
"""Kept scans from one look for panes to the next."""
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
        self._revision = self._looked = self._touches = 0
        self.panes: tuple[Pane, ...] = ()

    def draw(
        self, scans: Sequence[KeptScan], poses: Sequence[Pose2], revision: int, touches: Sequence[Pose2]
    ) -> OccupancyGrid:
        """Draw the map.

        Args:
            scans: All kept scans, more than last time or as many.
            poses: base_footprint at each of them, map frame.
            revision: Differs from last time when the poses of older scans do.
            touches: base_footprint where the bumper met something.

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
        if corrected or len(scans) - self._looked >= _LOOK_EVERY or len(touches) != self._touches:
            self._looked, self._touches = len(scans), len(touches)
            panes = tuple(self._known(each) for each in find_panes(grid, scans, poses, touches, panes))
        if corrected or panes != self.panes:
            self.panes = panes
            self._cut = _Drawing(self._p, panes)
        return self._cut.draw(scans, poses) if panes else grid

    def _known(self, pane: Pane) -> Pane:
        """Return the pane as it was drawn before, or the new one."""
        return next((each for each in self.panes if each.is_near(pane, _SAME_M)), pane)


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
