"""The skills of this installation: what they take, give and fail with, and what serves them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from florence_bt.app.mission_files.mission_list import takes
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.skills.served import BINDINGS
from florence_bt.trees.checks.report import report_text
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary

_INDENT = " " * 4
NOBODY = "nothing serves it"
ELSEWHERE = "a Python package serves it"


def list_skills(
    names: Sequence[str] = (),
    folders: Sequence[Path] = (),
    live: Callable[[MissionLibrary], Mapping[str, str]] | None = None,
) -> tuple[str, str]:
    """List skills.

    Args:
        names: Those to tell everything about; a line for each skill when empty.
        folders: More mission folders, with their files of skills.
        live: Gives for the skills to list what is there now of their servers, as text.

    Returns:
        The list, and what is wrong with files and packages that should have been on it.

    Raises:
        ConfigError: A folder does not exist, or there is no skill of a name.
    """
    library = MissionLibrary.load(folders)
    known = collect_declarations()
    declarations = {**library.declarations, **known}
    for name in names:
        if name not in declarations:
            raise ConfigError(f"there is no skill {name!r}", valid=closest_first(name, declarations))
    servers = _servers(declarations, library)
    now = live(library) if live is not None else {}
    servers |= now
    shown = [declarations[name] for name in names or now or sorted(declarations) if name in declarations]
    lines = [
        line for each in shown for line in (_whole(each, servers) if names else _brief(each, servers, live))
    ]
    return "\n".join(lines), report_text([*library.findings, *known.findings])


def _servers(declarations: Mapping[str, SkillDeclaration], library: MissionLibrary) -> dict[str, str]:
    """Map each skill to what serves it, as text."""
    own = {
        served.skill: f"{served.interface.split('/')[1]} {served.name} ({served.interface})"
        if served.interface
        else "the mission server itself"
        for served in BINDINGS
    }
    files = {
        name: f"{mapping.way} {mapping.name} ({mapping.interface})"
        for name, mapping in library.mappings.items()
    }
    lacking = {name: NOBODY if name in library.declarations else ELSEWHERE for name in declarations}
    return {**lacking, **files, **own}


def _brief(skill: SkillDeclaration, servers: Mapping[str, str], live: object | None) -> Iterator[str]:
    server = servers[skill.name]
    mark = f" [{server}]" if live is not None or server == NOBODY else ""
    yield f"{skill.name:<22} {skill.summary.rstrip('.')}{mark}"


def _whole(skill: SkillDeclaration, servers: Mapping[str, str]) -> Iterator[str]:
    yield f"{skill.name}: {skill.summary}"
    for name, port in skill.inputs.items():
        yield f"{_INDENT}{name}: {takes(port)}" + (f" -- {port.description}" if port.description else "")
    for name, port in skill.outputs.items():
        yield f"{_INDENT}-> {name}: {port.kind.value}" + (
            f" -- {port.description}" if port.description else ""
        )
    for code, meaning in skill.failures.items():
        yield f"{_INDENT}fails with {code}: {meaning}"
    for group in skill.groups:
        yield f"{_INDENT}{group.name} stands for {', '.join(sorted(group.codes & skill.failures.keys()))}"
    if skill.resources:
        yield f"{_INDENT}needs {', '.join(sorted(skill.resources))} for itself"
    ends = "answers at once" if skill.instant else f"ended after {skill.deadline_s:g} s"
    yield f"{_INDENT}{ends}; served by: {servers[skill.name]}"
