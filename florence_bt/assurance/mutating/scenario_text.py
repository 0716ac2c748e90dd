"""The text of a scenario file to which scenarios are added."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from florence_bt.assurance.mutating.draft import Draft
from florence_bt.assurance.mutating.source_text import Piece, SourceText
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.loader import BUILT_IN
from florence_bt.trees.language.model import Mission

MARK = "# Small changes of the mission that none of the scenarios above notices (florence mutate)."
"""What stands above scenarios that were added."""


@dataclass(frozen=True, slots=True)
class ScenarioText:
    """A scenario file.

    Attributes:
        file: The file; it need not be there yet.
        head: What stands above its scenarios, which they share.
        text: All of it.
        indent: How far its scenarios are indented.
        names: The names of its scenarios.
    """

    file: Path
    head: str
    text: str
    indent: str
    names: frozenset[str]

    @classmethod
    def of(cls, file: Path, mission: Mission) -> ScenarioText:
        """Read a scenario file, or begin one for a mission.

        Raises:
            ConfigError: Nothing can be added at its end.
        """
        if not file.exists():
            folder = mission.file.resolve().parent
            relative = os.path.relpath(folder, file.resolve().parent)
            head, text = (_new_head(mission, str(each)) for each in (folder, relative))
            return cls(file, head, text, "  ", frozenset())
        text = file.read_text(encoding="utf-8")
        root = SourceText(text).root
        key, scenarios = root.entries[-1]
        if key.text != "scenarios" or scenarios.flow or not scenarios.items:
            raise ConfigError(
                "scenarios can only be added to a file that ends with the list of them",
                file=file,
                line=key.line,
                valid=["scenarios: as the last key, with an item in each line"],
            )
        names = frozenset(
            name.text or "" for each in scenarios.items if (name := each.get("name")) is not None
        )
        line = text.rfind("\n", 0, scenarios.start) + 1
        indent = text[line : scenarios.start]
        return cls(file, _absolute(text[:line], root, file), text, indent, names)

    def alone(self, draft: Draft, folder: Path) -> Path:
        """Write a scenario by itself, with what all share, into a folder; return the file."""
        file = folder / self.file.name
        file.write_text(self.head + draft.text(self.indent), encoding="utf-8")
        return file

    def with_added(self, drafts: Iterable[Draft]) -> str:
        """Return the text with some more scenarios, below a mark."""
        parts = [self.text.rstrip("\n") + "\n"]
        if self.names and MARK not in self.text:
            parts.append(f"\n{self.indent}{MARK}\n")
        parts += [("\n" if self.names else "") + each.text(self.indent) for each in drafts]
        return "".join(parts)


def _new_head(mission: Mission, folder: str) -> str:
    """Return the head of a new file, which names the folder of a mission that does not come with Florence."""
    folders = [f'missions: ["{folder}"]'] if mission.file.parent != BUILT_IN else []
    return "\n".join([f"mission: {mission.name}", *folders, "scenarios:", ""])


def _absolute(head: str, root: Piece, file: Path) -> str:
    """Name folders and missions in full, so that the head can stand in another folder."""
    folders = root.get("missions")
    mission = root.get("mission")
    found = list(folders.items or (folders,)) if folders is not None else []
    if mission is not None and (mission.text or "").endswith((".yaml", ".yml")):
        found.append(mission)
    for each in sorted(found, key=lambda piece: -piece.start):
        full = (file.resolve().parent / (each.text or "")).resolve()
        head = head[: each.start] + f'"{full}"' + head[each.end :]
    return head
