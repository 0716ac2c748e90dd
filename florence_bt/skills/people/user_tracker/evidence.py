"""Verifiers: what else than the depth picture says who is a person.

The depth detector proposes; a source says of each proposal that it is a person, that it is nobody, or
nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from florence_bt.core.sensing import ColourImage, Posture


class Verdict(Enum):
    """The opinions of a source on a proposal."""

    PERSON = "person"
    NOBODY = "nobody"
    NONE = "none"
    """It cannot tell: too dark, too small, or somebody of a kind that it misses."""


@dataclass(frozen=True, slots=True)
class Region:
    """A part of a picture of any size; columns and rows as shares of all, 0 to 1.

    Attributes:
        left: The first column.
        top: The first row.
        right: Where the columns end.
        bottom: Where the rows end.
    """

    left: float
    top: float
    right: float
    bottom: float

    def share_of_columns(self, other: Region) -> float:
        """Return how much of this region, 0 to 1, is in columns of another one."""
        common = min(self.right, other.right) - max(self.left, other.left)
        return max(0.0, common) / (self.right - self.left)


@dataclass(frozen=True, slots=True)
class Candidate:
    """A candidate for a person.

    Attributes:
        number: Of the track.
        region: Where the picture shows them.
        posture: What they do.
    """

    number: int
    region: Region
    posture: Posture


class Verifier(Protocol):
    """Judges who of the proposed candidates is a person."""

    def verdict(self, picture: ColourImage, candidate: Candidate) -> Verdict:
        """Tell what a picture says of a candidate; may take some ten milliseconds."""


def verdicts(
    source: Verifier, picture: ColourImage, candidates: Sequence[Candidate]
) -> list[tuple[int, Verdict]]:
    """Return numbers of candidates, with what a source says of them."""
    return [(each.number, source.verdict(picture, each)) for each in candidates]
