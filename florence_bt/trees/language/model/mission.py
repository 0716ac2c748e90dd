"""A mission file as a whole, and what its nodes read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from florence_bt.core.declaration import Port
from florence_bt.trees.language.findings import Finding
from florence_bt.trees.language.model.composites import Switch
from florence_bt.trees.language.model.decorators import Cooldown, Delay, Repeat, Retry, Timeout
from florence_bt.trees.language.model.leaves import Call, Fail, Set, Use, Wait
from florence_bt.trees.language.model.node import Node, walk
from florence_bt.trees.language.model.values import Value
from florence_bt.trees.language.source import Position


def default_of(name: str) -> str:
    """Under which name the position of the default of an input or a key is kept; no key is called so."""
    return f"{name}: default"


@dataclass(frozen=True, slots=True)
class Mission:
    """A mission file.

    Attributes:
        name: The name, equal to the file's stem.
        description: What it does, for people.
        file: The file.
        inputs: What a caller gives, in SI units.
        outputs: What it leaves in keys of these names when it succeeds.
        keys: ``keys``: the keys that are declared, with their types; a default is the value at the start.
        on_restart: ``abort``, ``restart`` or ``resume``: what follows when the executor died on it.
        tree: The root node; None when the file is too broken to have one.
        positions: Where the inputs, outputs and keys are declared, by name, and their defaults, by
            :func:`default_of` their name.
        findings: What was wrong with the file's form.
        lost: Where the form is wrong: the keys that nodes would write, broken nodes included.
        version: Stands for the text of the file: equal versions are equal texts.
    """

    name: str
    description: str
    file: Path
    inputs: Mapping[str, Port] = field(default_factory=dict)
    outputs: Mapping[str, Port] = field(default_factory=dict)
    keys: Mapping[str, Port] = field(default_factory=dict)
    on_restart: str = "abort"
    tree: Node | None = None
    positions: Mapping[str, Position] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    lost: frozenset[str] = frozenset()
    version: str = ""

    def required_inputs(self) -> tuple[str, ...]:
        """The inputs that a caller must give."""
        return tuple(name for name, port in self.inputs.items() if port.required)

    def nodes(self) -> Iterator[Node]:
        """Every node from the root down, clean-ups included."""
        if self.tree is not None:
            yield from walk(self.tree)


def values_of(node: Node) -> Iterator[Value]:
    """The values that a node itself reads when it begins, without its conditions and its own words."""
    match node:
        case Use(inputs=inputs) | Call(inputs=inputs):
            yield from (value for _, value in inputs)
        case Set(values=values):
            yield from (value for _, value in values)
        case Retry(attempts=value) | Repeat(rounds=value) | Switch(value=value) | Fail(reason=value):
            yield value
        case Timeout(duration=value) | Wait(duration=value) | Delay(duration=value):
            yield value
        case Cooldown(duration=value):
            yield value
