"""Missions that a given file calls and that lie beside it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Call, Mission


def add_neighbours(missions: Iterable[Mission], library: MissionLibrary) -> None:
    """Let missions call those that lie beside their files."""
    waiting = list(missions)
    looked_for: set[tuple[Path, str]] = set()
    for mission in waiting:
        folder = mission.file.parent
        for node in mission.nodes():
            if not isinstance(node, Call) or node.mission.text in library:
                continue
            if (folder, node.mission.text) in looked_for:
                continue
            looked_for.add((folder, node.mission.text))
            file = folder / f"{node.mission.text}.yaml"
            neighbour = library.add_file(file) if file.is_file() else None
            if neighbour is not None:
                waiting.append(neighbour)
