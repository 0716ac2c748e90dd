"""Whether the robot is where it is believed to be; if the scans do not fit there, it is looked for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.localisation.pose_search import PoseSearch
from florence_bt.skills.navigation.localisation.scan_match import Match

_NEAR_M, _NEAR_RAD = 0.8, 0.35
_CONTRADICTED = 0.1
"""When fewer of the beams go through walls, what does not fit has met people or moved chairs."""
_LOST_AFTER = 12
"""After so many scans that fit badly, more than there are of others, the robot is lost."""
_EVERYWHERE_EVERY = 4
"""To look everywhere in a flat takes a tenth of a second, so not with every scan."""
_AS_GOOD = 0.1
"""A place is as likely as the best one when the part of the scan that fits there is smaller by no more."""
_FOUND_AFTER = 5
"""It is found when so many scans in a row fit: a single one fits in a wrong place, too."""


class Relocaliser:
    """Looks around where the robot is believed to be with each scan that does not fit there, and everywhere
    once it is lost.

    Attributes:
        lost: Whether the scans have not fitted for long. Nothing that needs the place may be done then.
    """

    def __init__(self, search: PoseSearch, parameters: LocaliserParameters) -> None:
        self._search = search
        self._p = parameters
        self._poor = 0
        self._fitting = 0
        self._scans_lost = 0
        self.lost = False

    def reset(self) -> None:
        """Somebody has said where the robot is."""
        self._poor, self.lost = 0, False

    def lose(self) -> None:
        """Nobody knows where the robot is."""
        self._fitting, self._scans_lost, self.lost = 0, 0, True

    def look(self, points: NDArray[np.float64], believed: Match) -> list[Match]:
        """Take a scan.

        Args:
            points: Shape (n, 2), beam ends in the base frame, metres.
            believed: How it fits where the robot is believed to be.

        Returns:
            Where the robot is rather, the best place first; none when it is where it is believed to be, or
            nothing better was found.
        """
        if self.lost:
            return self._look_everywhere(points, believed)
        fit = believed.near_fraction
        if fit >= self._p.relocalise_fit:
            self._poor = 0
            return []
        contradicted = self._search.contradicted_part(points, believed.pose)
        if contradicted < _CONTRADICTED:
            self._poor = max(0, self._poor - 1)
            return []
        found = self._search.around(points, believed.pose, _NEAR_M, _NEAR_RAD)
        better = found.near_fraction >= max(self._p.relocalise_fit, fit + self._p.relocalise_gain)
        if better and self._search.contradicted_part(points, found.pose) <= contradicted / 2.0:
            self._poor = 0
            return [found]
        self._poor = max(0, self._poor + (1 if fit < self._p.lost_fit else -1))
        if self._poor > _LOST_AFTER:
            self.lose()
        return []

    def _look_everywhere(self, points: NDArray[np.float64], believed: Match) -> list[Match]:
        fits = believed.near_fraction >= self._p.relocalise_fit
        self._fitting = self._fitting + 1 if fits else 0
        self._scans_lost += 1
        if self._fitting >= _FOUND_AFTER:
            self.reset()
            return []
        if self._fitting > 1 or self._scans_lost % _EVERYWHERE_EVERY != 1:
            return []
        found = self._search.everywhere(points)
        likely = [each for each in found if each.near_fraction >= found[0].near_fraction - _AS_GOOD]
        return likely if likely and likely[0].near_fraction >= self._p.relocalise_fit else []
