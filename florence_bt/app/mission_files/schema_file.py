"""``florence schema``: the JSON Schema of mission files for the skills and missions of this installation."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.schema import make_schema


def schema_text(folders: Sequence[Path] = (), hotspots: Path | None = None) -> str:
    """Write the schema as JSON.

    Args:
        folders: More mission folders, whose skills and missions an editor completes.
        hotspots: A hotspots file whose labels an editor completes; None allows any label.

    Raises:
        ConfigError: A folder or the file cannot be read.
    """
    labels = load_hotspots(hotspots).by_name() if hotspots is not None else {}
    library = MissionLibrary.load(folders)
    skills = {**library.declarations, **collect_declarations()}
    schema = make_schema(dict(sorted(skills.items())), library.missions(), labels)
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"
