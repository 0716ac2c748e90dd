"""The part that ``set``, ``add`` and ``append`` share: keys, each with a value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from florence_bt.core.plain_yaml import YamlMapping, YamlNode
from florence_bt.trees.language.model import Literal, Node, Value, show


def has_entries(value: YamlNode) -> bool:
    """Tell whether keys and values are written, as all of these kinds need them."""
    return isinstance(value, YamlMapping) and bool(value.entries)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assignments(Node):
    """Writes keys.

    Attributes:
        values: The keys, each with what it is given, or what is added to it.
        verb: What it does to them, for the title.
        sign: What stands between a key and its value in a drawing.
    """

    decides_by_values: ClassVar = True
    verb: ClassVar[str]
    sign: ClassVar[str]

    values: tuple[tuple[Literal, Value], ...]

    @property
    def default_title(self) -> str:
        """Such as ``set goal`` or ``append to report``."""
        return f"{self.verb} {', '.join(key.text for key, _ in self.values)}"

    @property
    def details(self) -> tuple[str, ...]:
        """The keys and values."""
        return tuple(f"${key.text} {self.sign} {show(value)}" for key, value in self.values)
