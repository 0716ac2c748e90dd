"""Evidence of a mirror or a pane of glass in a gap between two surfaces: what was seen through it."""

from __future__ import annotations

from typing import NamedTuple

MIRROR_BEAMS = 60
"""A mirror shows the laser itself, and so many beams through it, folded, end at something."""
_NOT_FOLDED, _PAST = 0.03, 0.25
"""Of the beams, so few end on free floor, folded, or come from behind; and something further away than the
laser was seen from so few places, to one from which the laser was."""
_STOPPED, _PASSED = 0.5, 0.1
"""Of the cells of a pane of glass, so many have ended a beam that met them squarely, and so few let one
through."""
_DOUBT = 3.0
"""So much of that is allowed where a pane is known."""


class Evidence(NamedTuple):
    """The beams and places that tell of a gap; numba makes it.

    Attributes:
        folded: Beams whose folded end is at something of the map.
        not_folded: Beams whose folded end is on free floor.
        unknown: Beams whose folded end is where the map knows nothing.
        itself: From how many places the laser itself was seen, as far behind the gap as it was before it.
        past: From how many something behind that was seen.
        stopped: The part of the gap that has ended beams that met it squarely.
        passed: The part that has let such beams through.
        behind: Beams that came through it from behind.
        low: From where along the gap beams are folded: beside a mirror there may be a doorway, metres.
        high: To where.
    """

    folded: int
    not_folded: int
    unknown: int
    itself: int
    past: int
    stopped: float
    passed: float
    behind: int
    low: float
    high: float

    @property
    def surplus(self) -> float:
        """Beams that say that a mirror is there, above those that are needed."""
        return self.folded - self.not_folded / _NOT_FOLDED

    def is_mirror(self, *, known: bool) -> bool:
        """Tell whether a mirror is there; it takes more to say that it is none where it was ``known``."""
        doubt = _DOUBT if known else 1.0
        enough = self.folded >= max(MIRROR_BEAMS, self.unknown) and (self.itself > 0 or known)
        seldom = max(self.not_folded, self.behind) <= doubt * _NOT_FOLDED * self.folded
        return enough and seldom and self.past <= doubt * _PAST * self.itself

    def is_glass(self, *, known: bool) -> bool:
        """Tell whether a pane of glass is there; ``known`` as for a mirror."""
        doubt = _DOUBT if known else 1.0
        return self.stopped >= _STOPPED / doubt and self.passed <= doubt * _PASSED
