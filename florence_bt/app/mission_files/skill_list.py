"""The skills of this installation: what they take, give and fail with, and what serves them."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from florence_bt.app.mission_files.mission_list import takes
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.skills.served import BINDINGS
from florence_bt.trees.checks.report import report_text
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import ENDING, STOCK, templates_in
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
    templates = _templates(folders) if names else {}
    for name in names:
        if name not in declarations and name not in templates:
            valid = closest_first(name, (*declarations, *templates))
            raise ConfigError(f"there is no skill or template {name!r}", valid=valid)
    servers = _servers(declarations, library)
    now = live(library) if live is not None else {}
    servers |= now
    shown = [name for name in names or now or sorted(declarations) if name in (*declarations, *templates)]

    def tell(name: str) -> Iterator[str]:
        if name not in declarations:
            return _template(name, templates[name])
        skill = declarations[name]
        return _whole(skill, servers) if names else _brief(skill, servers, live)

    lines = [line for name in shown for line in tell(name)]
    return "\n".join(lines), report_text([*library.findings, *known.findings])


def _templates(folders: Sequence[Path]) -> dict[str, str]:
    """Return the templates that skills of some folders can be like, as they stand in their files."""
    files = [STOCK, *(file for folder in folders for file in sorted(folder.glob(f"[!.]*{ENDING}")))]
    found: dict[str, str] = {}
    for file in files:
        with suppress(ConfigError):  # a finding of the library
            found |= templates_in(file)
    return found


def _template(name: str, text: str) -> Iterator[str]:
    yield f"{name}: a template for skills of your own, which say what serves them:"
    yield f"{_INDENT}my_skill: {{like: {name}, summary: ..., {_way_of(text)}: NAME}}"
    yield "such a skill has of the template, unless it says otherwise:"
    yield from textwrap.indent(textwrap.dedent(text.partition("\n")[2]), _INDENT).splitlines()


def _way_of(text: str) -> str:
    """Return how skills like a template are served, by the type that it names and what it does with it."""
    interface = re.search(r"\btype: *\w+/(action|srv)/", text)
    if interface is not None:
        return "service" if interface[1] == "srv" else "action"
    return "publish" if "send:" in text else "condition" if "failures:" in text else "wait_for"


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
