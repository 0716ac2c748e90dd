"""Words of the mission language that are of no kind of node: modifiers of every node, sections, limits."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

GUARDS = ("when", "while")
"""Modifiers that say when a node may start and go on; their values are expressions."""

OUTSIDE = ("name", "when", "because", "finally")
"""Modifiers that are about a node together with what its `until`, `on_failure` and `ensure` do."""

ANYWHERE = ("name", *GUARDS, "interrupted_by", "until", "on_failure", "ensure", "because", "finally")
"""Modifiers that every node may have."""

BESIDE: dict[str, tuple[str, ...]] = {"code": ("while", "until", "ensure")}
"""Modifiers of some kinds -> other modifiers of a node that allow them too, whatever its kind."""

MISSION_KEYS = (
    *("mission", "description", "imported_from", "inputs", "outputs", "keys"),
    *("properties", "on_restart", "tree"),
)
INTERRUPTION_KEYS = ("if", "do")
"""Keys below ``interrupted_by``: what is asked, and what is done then."""
INPUT_KEYS = ("type", "default", "min", "max", "description")
KEY_KEYS = INPUT_KEYS
OUTPUT_KEYS = ("type", "description")
SKILL_INPUT_KEYS = (*INPUT_KEYS, "names", "choices")
SKILL_OUTPUT_KEYS = (*OUTPUT_KEYS, "default", "names", "choices")
LABELLED = ("room", "hotspot")
"""Things of a home that a text can name: ``names`` of an input or output of a skill."""
PROPERTY_WORDS = ("never", "after", "at_most", "always_before")
"""Words with which a property of a mission begins."""
BESIDE_PROPERTY: dict[str, tuple[str, ...]] = {"after": ("eventually", "within")}
"""Word of a property -> what stands beside it, ``because`` apart."""
PROPERTY_KEYS = (*PROPERTY_WORDS, *BESIDE_PROPERTY["after"], "because")
ON_RESTART = ("abort", "restart", "resume")

IDENTIFIER = re.compile(r"[a-z][a-z0-9_]*")
"""Names of missions, skills, inputs, outputs, keys and codes."""

MAX_QUICK_ROUNDS = 5000
"""Times that a tree may be ticked in a row although nothing outside it has happened: a loop of nodes that
take no time has no more rounds. Chosen: 2,000 quick rounds are somebody's loop, and 5,000 are over in
seconds."""
GUARD_FAILED = "guard_failed"
"""The code of a ``while`` that names none."""
FOREVER = "forever"
"""The word after ``repeat`` and ``retry`` in place of a number."""

OTHER_YAWS = ("theta", "phi", "th", "angle", "heading", "orientation")
"""Others' words for the heading of a pose."""


def by_spelling(spellings: Mapping[str, Iterable[str]]) -> dict[str, str]:
    """Invert a table from each word to what others call it."""
    return {other: word for word, others in spellings.items() for other in others}
