"""The missions of this installation, what they take and what they give; and the one that a user means."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from florence_bt.core.declaration import Port
from florence_bt.core.errors import ConfigError
from florence_bt.trees.checks.report import report_text
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.quantities import format_value

_INDENT = " " * 19


def list_missions(folders: Sequence[Path] = ()) -> tuple[str, str]:
    """List the missions of this installation.

    Args:
        folders: More mission folders.

    Returns:
        The list, and what is wrong with files and packages that should have been on it.

    Raises:
        ConfigError: A folder does not exist.
    """
    library = MissionLibrary.load(folders)
    lines = [line for mission in library.missions() for line in _lines(mission)]
    return "\n".join(lines), report_text([*library.findings, *collect_declarations().findings])


def mission_name(given: str, library: MissionLibrary) -> str:
    """Return the name of a mission that is given by its name or its file.

    The file joins the library, and so do the missions beside it that it calls.

    Raises:
        ConfigError: There is no such file.
    """
    file = Path(given)
    if file.suffix in (".yaml", ".yml"):
        if not file.exists():
            raise ConfigError(f"there is no file {given!r}", valid=["a mission file", *library.names()])
        mission = library.add_file(file)
        if mission is not None:
            library.add_neighbours([mission])
        return file.stem
    return given


def _lines(mission: Mission) -> Iterator[str]:
    yield f"{mission.name:<16} {mission.description}"
    for name, port in mission.inputs.items():
        yield f"{_INDENT}{name}: {takes(port)}"
    for name, port in mission.outputs.items():
        yield f"{_INDENT}-> {name}: {port.kind.value}"


def takes(port: Port) -> str:
    """Return the type, default and limits of an input for people."""
    default = "(required)" if port.required else "= " + (format_value(port.default, port.kind) or '""')
    limits = [
        f"{word} {format_value(limit, port.kind)}"
        for word, limit in (("from", port.minimum), ("to", port.maximum))
        if limit is not None
    ]
    limits += [f"one of {', '.join(port.choices)}"] if port.choices else []
    return " ".join([port.kind.value, default, *([f"({' '.join(limits)})"] if limits else [])])
