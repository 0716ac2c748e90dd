"""Groups of failure codes, as the skills declare them: one word of a mission for several codes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from florence_bt.core.declaration import CodeGroup, SkillDeclaration

ANY = "any"
"""Stands for every code where a failure is caught."""
Item = TypeVar("Item")


def groups_of(declarations: Mapping[str, SkillDeclaration]) -> dict[str, CodeGroup]:
    """Collect the groups of some skills, by name in alphabetical order."""
    groups: dict[str, CodeGroup] = {}
    for declared in (group for skill in declarations.values() for group in skill.groups):
        known = groups.get(declared.name, declared)
        meaning = known.meaning or declared.meaning
        groups[declared.name] = CodeGroup(declared.name, known.codes | declared.codes, meaning)
    return dict(sorted(groups.items()))


def codes_named(word: str, groups: Mapping[str, CodeGroup]) -> frozenset[str]:
    """Give the codes that a word stands for: a group's codes, and a code of that name."""
    group = groups.get(word)
    return frozenset({word}) | (group.codes if group is not None else frozenset())


def by_code(words: Iterable[tuple[str, Item]], groups: Mapping[str, CodeGroup]) -> dict[str, Item]:
    """Map each code to what is written for it. A code itself counts before a group that has it.

    Args:
        words: Codes and groups, each with what is written for it.
        groups: The groups by name.
    """
    words = list(words)
    found = {word: item for word, item in words if word not in groups}
    for word, item in words:
        for code in codes_named(word, groups):
            found.setdefault(code, item)
    return found
