"""How large a mission may be with everything that it calls."""

from __future__ import annotations

from collections.abc import Iterator

from florence_bt.core.errors import ConfigError
from florence_bt.trees.language._facts import Facts
from florence_bt.trees.language.model import Mission

MAX_NODES = 50_000
"""How many nodes a mission has at most, those of the missions that it calls counted at every call."""
MAX_TREE_DEPTH = 150
"""How many nodes stand one above the other at most, those of called missions included."""


def too_large(mission: Mission, facts: Facts) -> Iterator[ConfigError]:
    """Why a mission is too large to run, with everything that it calls; nothing when it is not.

    Args:
        mission: The mission.
        facts: Its surroundings.
    """
    root = facts.of(mission).root
    if root is None or mission.tree is None:
        return
    problems: list[tuple[str, str]] = []
    if root.count > MAX_NODES:
        shown = str(root.count) if root.count < 10**9 else "more than a billion"
        message = (
            f"the mission has {shown} nodes with those of the missions that it calls; {MAX_NODES} can run"
        )
        problems.append((message, "repeat: instead of writing a call many times"))
    if root.depth > MAX_TREE_DEPTH:
        message = (
            f"{root.depth} nodes stand one above the other, with those of called missions; "
            f"{MAX_TREE_DEPTH} can run"
        )
        problems.append((message, "fewer missions that call each other"))
    place = mission.tree.position
    for message, valid in problems:
        yield ConfigError(message, file=mission.file, line=place.line, column=place.column, valid=[valid])
