"""The page ``docs/reference/skills.md``: every skill as missions see it, written from the declarations.

``python tools/skills_page.py docs/reference/skills.md`` writes it.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from pathlib import Path

from florence_bt.core.declaration import Port, SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.trees.language.code_groups import groups_of
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.declared_skills import STOCK, read_skills_file
from florence_bt.trees.language.message_mappings import MessageMapping
from florence_bt.trees.language.outcomes import OWN_CODES
from florence_bt.trees.language.quantities import format_value

_HEAD = """\
# Skills

What missions can ask of the robot. This page is written from the declarations of the skills
(the files `NAME.skills.yaml` in `florence_bt/skills`, and `florence_bt/trees/language/stock.skills.yaml`) by
`python tools/skills_page.py docs/reference/skills.md`.

Where a server is named, Florence need not have it itself: the skill is for robots that have one of that
name. [`like`](../manual/skills_without_code.md#a-skill-that-is-like-another-one) makes a skill for one of
another name.

A skill that *answers at once* can be a condition: a node without memory asks it again every second while a
later node runs, or as often as [`every`](missions.md#every-how-conditions-are-watched) says. One that also
*reports changes* is asked again when it reports one, and at no other time. Other skills are asked again only
with `every`.

Beside its own codes every skill can fail with:
"""
_SERVED = {"action": "action", "srv": "service", "msg": "topic"}


def skills_page() -> str:
    """Write the page in Markdown."""
    stock = read_skills_file(STOCK)
    declarations = dict(sorted({**stock.declarations, **own_declarations()}.items()))
    common = [f"- `{code}`: {meaning}" for code, meaning in {**COMMON_CODES, **OWN_CODES}.items()]
    parts = [_HEAD, *common]
    parts += ["", *_groups(declarations)]
    for name, declaration in declarations.items():
        parts += ["", *_skill(declaration, stock.mappings.get(name))]
    return "\n".join(parts) + "\n"


def _groups(declarations: Mapping[str, SkillDeclaration]) -> Iterator[str]:
    yield "One word can stand for several codes after `on`, in `on_failure` and in `because`:"
    yield ""
    yield "| group | codes | meaning |"
    yield "|---|---|---|"
    for group in groups_of(declarations).values():
        codes = ", ".join(f"`{code}`" for code in sorted(group.codes))
        yield f"| `{group.name}` | {codes} | {group.meaning} |"


def _skill(declaration: SkillDeclaration, mapping: MessageMapping | None) -> Iterator[str]:
    yield f"## {declaration.name}"
    yield ""
    yield declaration.summary.rstrip(".") + "."
    notes = [f"ended after {declaration.deadline_s:g} s"]
    if declaration.instant:
        notes.append(
            "answers at once and reports changes" if declaration.reports_changes else "answers at once"
        )
    if declaration.resources:
        notes.append("needs the " + " and the ".join(sorted(declaration.resources)) + " for itself")
    if mapping is not None:
        _, kind, _ = mapping.interface.split("/")
        notes.append(f"server: {_SERVED[kind]} `{mapping.name}`, `{mapping.interface}`")
    yield f"({'; '.join(notes)})"
    for title, ports in (("input", declaration.inputs), ("output", declaration.outputs)):
        if ports:
            yield ""
            yield from _ports(title, ports)
    if declaration.failures:
        yield ""
        yield "| code | meaning |"
        yield "|---|---|"
        yield from (f"| `{code}` | {meaning} |" for code, meaning in declaration.failures.items())


def _ports(title: str, ports: Mapping[str, Port]) -> Iterator[str]:
    if title == "output":
        yield "| output | type | |"
        yield "|---|---|---|"
        yield from (f"| `{name}` | {port.kind.value} | {port.description} |" for name, port in ports.items())
        return
    yield "| input | type | default | limits | |"
    yield "|---|---|---|---|---|"
    for name, port in ports.items():
        value = "" if port.required else format_value(port.default, port.kind)
        default = "required" if port.required else f"`{value}`" if value else "empty"
        yield f"| `{name}` | {port.kind.value} | {default} | {_limits(port)} | {port.description} |"


def _limits(port: Port) -> str:
    low = format_value(port.minimum, port.kind) if port.minimum is not None else None
    high = format_value(port.maximum, port.kind) if port.maximum is not None else None
    if low is not None and high is not None:
        return f"{low} to {high}"
    if low is not None:
        return f"at least {low}"
    return f"at most {high}" if high is not None else ""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Write the page of all skills.")
    parser.add_argument("page", type=Path, help="where to, e.g. docs/reference/skills.md")
    page = parser.parse_args().page
    page.write_text(skills_page(), encoding="utf-8")
