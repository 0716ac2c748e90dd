"""What is tried in the rig."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TrialRequest:
    """A mission to try, and the circumstances.

    Attributes:
        name: The mission.
        text: Its text, which counts instead of what its file says.
        folders: Folders of missions.
        inputs: Its inputs, as texts.
        person: Who is at home, as ``--person`` takes it; empty for somebody in a random room.
        seed: Start of every random generator.
        speed: Simulated seconds per wall second to aim at; 0 for as fast as possible.
    """

    name: str
    text: str
    folders: tuple[str, ...] = ()
    inputs: Mapping[str, str] | None = None
    person: str = ""
    seed: int = 0
    speed: float = 0.0
