"""Inputs and outputs of skills and of called missions, as they are written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from florence_bt.core.plain_yaml import YamlMapping, YamlNode
from florence_bt.trees.language.model import Literal, Value, show


def unread(source: YamlNode | None, inputs: Sequence[tuple[Literal, Value]]) -> tuple[str, ...]:
    """Return the names in a table whose values could not be read.

    Args:
        source: The table.
        inputs: What could be read of it.
    """
    read = {name.text for name, _ in inputs}
    entries = source.entries if isinstance(source, YamlMapping) else ()
    return tuple(name.text.split(":")[0] for name, _ in entries if name.text not in read)


def shown_ports(
    inputs: Sequence[tuple[Literal, Value]], outputs: Sequence[tuple[Literal, Literal]]
) -> Iterator[str]:
    """Yield inputs and outputs as they are drawn."""
    yield from (f"{name.text}: {show(value)}" for name, value in inputs)
    yield from (f"{output.text} -> ${key.text}" for output, key in outputs)
