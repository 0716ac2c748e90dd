"""Skills that a file beside the missions declares, and that this installation lacks."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from florence_bt.trees.language import model
from florence_bt.trees.language.findings import WARNING, Finding
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission


def lacking_skills(mission: Mission, skills: Collection[str], library: MissionLibrary) -> Iterator[Finding]:
    """A warning for each skill that is declared but not there, at its first use.

    Args:
        mission: The mission.
        skills: The skills of this installation.
        library: What the files beside the missions declare.
    """
    seen: set[str] = set()
    for node in mission.nodes():
        if not isinstance(node, model.Use) or node.skill in seen or node.skill in skills:
            continue
        seen.add(node.skill)
        if node.skill in library.declarations:
            message = f"the skill {node.skill!r} is declared but not implemented on this robot (no_skill)"
            place = node.position
            yield Finding(str(mission.file), place.line, place.column, WARNING, message)
