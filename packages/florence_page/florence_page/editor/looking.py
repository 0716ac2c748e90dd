"""What the editor shows about a text: its findings, its outline and its inputs, as plain data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from florence_bt.app.mission_files.checking import CheckOptions, check_text
from florence_bt.core.plain_yaml import Position
from florence_bt.core.text_files import LINE_BREAK
from florence_bt.trees.drawings.diagram import Box, diagram_of
from florence_bt.trees.drawings.draw import SYMBOLS
from florence_bt.trees.language.findings import ERROR, Finding
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.quantities import format_value

MOST_ROWS = 2000
"""Nodes of an outline that are shown."""
_MOST_VALID = 5


def look_at(text: str, name: str, folders: Sequence[Path], hotspots: Path | None) -> dict[str, Any]:
    """Check a mission that is being written.

    Args:
        text: Its text.
        name: The name of its file, without the ending.
        folders: Folders of missions; it will lie in the last one.
        hotspots: The places of the home; None takes those that come with Florence, as ``florence check``.

    Returns:
        ``findings``: line, column, severity, message, valid (what would have worked), file (another one, else
        empty); ``fits``: whether it can run; ``outline``: its nodes; ``inputs``: what it takes.

    Raises:
        ConfigError: A folder or the hotspots cannot be read.
    """
    folder = folders[-1] if folders else Path()
    file = folder / f"{name}.yaml"
    options = CheckOptions(hotspots=hotspots, folders=tuple(folders), stdin_name=file)
    looked = check_text(text.encode("utf-8", errors="replace"), options)
    mission = looked.mission
    own = [finding for finding in looked.findings if finding.file == str(file)]
    others = [finding for finding in looked.findings if finding.file != str(file)]
    return {
        "findings": [_finding(each) for each in own]
        + [_finding(each, Path(each.file).name) for each in others],
        "fits": mission is not None and not any(each.severity == ERROR for each in own),
        "outline": outline(mission, LINE_BREAK.split(text)) if mission is not None else [],
        "inputs": inputs(mission) if mission is not None else [],
    }


def _finding(finding: Finding, file: str = "") -> dict[str, Any]:
    return {
        "line": finding.line,
        "column": finding.column,
        "severity": finding.severity,
        "message": finding.message,
        "valid": list(finding.valid[:_MOST_VALID]),
        "file": file,
    }


def outline(mission: Mission, lines: Sequence[str]) -> list[dict[str, Any]]:
    """List the nodes of a mission from the root down, each with its place in the text.

    Args:
        mission: The mission.
        lines: The lines of its file.

    Returns:
        For each node its depth, kind, sign, title, the word on its way from above, details, its line (of its
        kind key), and the first line of what belongs to it.
    """
    rows: list[dict[str, Any]] = []
    for box, depth in _with_depth(diagram_of(mission), 0):
        if len(rows) == MOST_ROWS:
            break
        place = box.position or Position()
        rows.append(
            {
                "depth": depth,
                "kind": box.kind,
                "sign": SYMBOLS[box.kind],
                "title": box.title,
                "edge": box.edge,
                "details": [*box.guards, *box.details, *(f"because {text}" for text in box.because)],
                "line": place.line,
                "first": first_line(lines, place),
            }
        )
    return rows


def _with_depth(box: Box, depth: int) -> Iterator[tuple[Box, int]]:
    yield box, depth
    for below in box.below:
        yield from _with_depth(below, depth + 1)


def first_line(lines: Sequence[str], place: Position) -> int:
    """Return the line where a block of keys begins, one of which is at a place."""
    first = line = place.line
    while line >= 1 and line <= len(lines):
        text = lines[line - 1]
        written = text.lstrip(" ")
        if not written or written.startswith("#"):
            line -= 1
            continue
        begins = len(text) - len(written) + 1
        inside = len(text) - len(text.lstrip("- ")) + 1
        if begins < place.column:
            return line if inside == place.column or line == place.line else first
        if begins == place.column:
            first = line
        line -= 1
    return first


def inputs(mission: Mission) -> list[dict[str, Any]]:
    """List what a mission takes, for a form: the fields of a ``MissionPort``."""
    return [
        {
            "name": name,
            "type": port.kind.value,
            "description": port.description,
            "required": port.required,
            "default_value": "" if port.required else format_value(port.default, port.kind) or "",
            "minimum": "" if port.minimum is None else format_value(port.minimum, port.kind),
            "maximum": "" if port.maximum is None else format_value(port.maximum, port.kind),
        }
        for name, port in mission.inputs.items()
    ]
