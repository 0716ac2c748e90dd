"""Bugs of ten kinds for copies of shipped and example missions."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import yaml


class Planted(NamedTuple):
    """A bug.

    Attributes:
        kind: Which of the ten kinds.
        mission: The mission.
        old: What stands in its file.
        new: What stands there with the bug.
    """

    kind: str
    mission: str
    old: str
    new: str


PLANTED = tuple(
    Planted(**each)
    for each in yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text(encoding="utf-8"))
)
