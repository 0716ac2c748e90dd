"""Custom nodes: nodes of other projects become skills; those that this installation lacks are declared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from florence_bt.core.declaration import REQUIRED, Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.trees.kinds.words import NEVER_INPUTS
from florence_bt.trees.language.quantities import read_value
from florence_btcpp.key_uses import Ports, pointer
from florence_btcpp.names import Names, skill_names
from florence_btcpp.node_models import PortModel
from florence_btcpp.values import neutral_value, read_number, read_truth
from florence_btcpp.xml_source import Element

DEADLINE_S = 300.0
"""Limit of a skill of which nothing is known."""
KindOf = Callable[[str, str], Kind | None]
"""Registration ID and port -> kind."""


@dataclass
class CustomNode:
    """A node that becomes a skill.

    Attributes:
        node: Its registration ID.
        name: The name of the skill.
        category: ``Action`` or ``Condition``.
        uses: The elements that use it.
        names: The names of its ports.
        directions: Port -> ``in``, ``out`` or ``inout``.
    """

    node: str
    name: str
    category: str
    uses: list[Element] = field(default_factory=list)
    names: Names = field(default_factory=lambda: Names("port", NEVER_INPUTS))
    directions: dict[str, str] = field(default_factory=dict)


class CustomNodes:
    """The skills of one import.

    Args:
        ports: The ports of all nodes.
        source: What the skills come from, for their summaries.
    """

    def __init__(self, ports: Ports, source: str) -> None:
        self._ports = ports
        self._source = source
        self._names = skill_names(ports.declarations)
        self._entries: dict[str, CustomNode] = {}

    def entry(self, node: str, element: Element) -> CustomNode:
        """Return the entry of a node; the element is one of its uses."""
        if node not in self._entries:
            model = self._ports.model(node)
            stated = element.tag if element.tag in ("Action", "Condition") else None
            category = (model.category if model else None) or stated or "Action"
            name = self._ports.skill_of.get(node) or self._names.of(node)
            self._entries[node] = CustomNode(node, name, category)
        self._entries[node].uses.append(element)
        return self._entries[node]

    def renamed(self) -> dict[str, str]:
        """Map each registration ID to the name of the skill, where the two differ."""
        return {entry.node: entry.name for entry in self._entries.values() if entry.node != entry.name}

    def declarations(self, kind_of: KindOf) -> list[SkillDeclaration]:
        """Declare the skills that this installation lacks.

        Args:
            kind_of: The kind of a port by all its uses, as far as it is known.
        """
        lacking = [entry for entry in self._entries.values() if self._ports.skill(entry.node) is None]
        return [self._declaration(entry, kind_of) for entry in sorted(lacking, key=lambda entry: entry.name)]

    def _declaration(self, entry: CustomNode, kind_of: KindOf) -> SkillDeclaration:
        model = self._ports.model(entry.node)
        ports = dict(model.ports) if model is not None and entry.node in self._ports.models else {}
        for port, direction in entry.directions.items():
            ports.setdefault(port, self._ports.port(entry.node, port) or PortModel(direction))
        inputs, outputs = {}, {}
        for port, about in ports.items():
            kind = kind_of(entry.node, port) or about.kind or Kind.TEXT
            described = about.description or (f"of type {about.type_name}" if about.type_name else "")
            if about.direction in ("in", "inout"):
                inputs[entry.names.of(port)] = Port(kind, described, self._default(entry, port, about, kind))
            if about.direction in ("out", "inout"):
                outputs[entry.names.of(port)] = Port(kind, described)
        about_it = model.description if model is not None and model.description else ""
        summary = about_it or f"The {entry.category.lower()} {entry.node} of {self._source}."
        instant = entry.category == "Condition"
        return SkillDeclaration(entry.name, summary, inputs, outputs, deadline_s=DEADLINE_S, instant=instant)

    def _default(self, entry: CustomNode, port: str, about: PortModel, kind: Kind) -> object:
        """Return the default of an input: the model's, or neutral when some uses leave it out."""
        if about.default is not None and pointer(about.default, port) is None:
            value = _read(about.default, kind)
            if value is not None:
                return value
        given_everywhere = all(port in use.attributes for use in entry.uses)
        needed = given_everywhere and about.default is None
        return REQUIRED if needed else neutral_value(kind)


def _read(text: str, kind: Kind) -> object:
    match kind:
        case Kind.TEXT:
            return text
        case Kind.BOOLEAN:
            return read_truth(text)
        case Kind.POSE:
            return None
        case Kind.INTEGER:
            number = read_number(text)
            return number if isinstance(number, int) else None
    number = read_number(text)
    if number is not None:
        return float(number)
    try:
        return read_value(text, kind)
    except ConfigError:
        return None
