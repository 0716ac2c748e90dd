"""Names of other projects to names of the mission language, and back."""

from __future__ import annotations

import re
from collections.abc import Collection

from florence_bt.trees.kinds.words import RESERVED
from florence_bt.trees.language.vocabulary import IDENTIFIER

_HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
_OTHER = re.compile(r"[^a-z0-9]+")


def identifier(name: str, fallback: str = "x") -> str:
    """Write a name in lower case with underscores: ``ComputePathToPose`` -> ``compute_path_to_pose``.

    Args:
        name: Any text.
        fallback: Put before a name that does not begin with a letter.
    """
    if IDENTIFIER.fullmatch(name):
        return name
    words = _OTHER.sub("_", _HUMP.sub("_", name).lower()).strip("_")
    return words if IDENTIFIER.fullmatch(words) else f"{fallback}_{words}".strip("_")


def unique(name: str, taken: Collection[str]) -> str:
    """Return the name itself, or with a number when it is taken."""
    number, tried = 1, name
    while tried in taken:
        number += 1
        tried = f"{name}_{number}"
    return tried


class Names:
    """Gives every foreign name one name of the language, the same each time.

    Args:
        fallback: Put before names that do not begin with a letter.
        reserved: Names that cannot be given.
    """

    def __init__(self, fallback: str, reserved: Collection[str] = ()) -> None:
        self._fallback = fallback
        self._reserved = frozenset(reserved)
        self._given: dict[str, str] = {}
        self._taken: set[str] = set()

    def of(self, foreign: str) -> str:
        """Return the name for a foreign name."""
        if foreign not in self._given:
            name = identifier(foreign, self._fallback)
            if name in self._reserved:
                name = f"{self._fallback}_{name}"
            name = unique(name, self._taken)
            self._taken.add(name)
            self._given[foreign] = name
        return self._given[foreign]


def skill_names(taken: Collection[str]) -> Names:
    """Make names for new skills, which cannot be called like a kind of node or a skill that there is."""
    return Names("skill", RESERVED.union(taken))
