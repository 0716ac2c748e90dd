"""A node as it is written, with what every kind reads of it: its value, modifiers, and the nodes below."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlScalar, YamlSequence
from florence_bt.trees.kinds.condition import Condition
from florence_bt.trees.kinds.wait_until import time_meant
from florence_bt.trees.kinds.words import NEVER_INPUTS
from florence_bt.trees.language import _suggestions as suggestions
from florence_bt.trees.language import model
from florence_bt.trees.language.reader import Reader, without_dollar

Fields = dict[str, Any]
"""The fields that every node of the model has."""


class NodeReader(Reader):
    """Reads what all nodes have in common."""

    @abstractmethod
    def node(self, source: YamlNode) -> model.Node | None:
        """Parse one node with everything below it."""

    def fields(self, key: YamlScalar, mapping: YamlMapping) -> Fields:
        """Read the modifiers that any node may have.

        Args:
            key: The kind key.
            mapping: The whole node.
        """
        fields: Fields = {"position": key.position}
        for modifier, source in mapping.entries:
            match modifier.text:
                case "name":
                    fields["name"] = self.text(source, "name")
                case "code":
                    fields["code"] = self.identifier(source, "code")
                case "because":
                    fields["reasons"] = self._reasons(source)
                case "finally":
                    fields["cleanup"] = self.node(source)
                case "when":
                    fields["when"] = self.expression(source, "when")
                case "while":
                    fields["holds"] = self.expression(source, "while")
        return fields

    def _reasons(self, source: YamlNode) -> model.Reasons | None:
        if not isinstance(source, YamlMapping):
            always = self.template(source, "because")
            return model.Reasons(always, {}, source.position) if always is not None else None
        by_code, positions = {}, {}
        for key, item in source.entries:
            code = self.identifier(key, "a code in because")
            text = self.template(item, f"because {key.text}")
            if code is not None and text is not None:
                by_code[code.text], positions[code.text] = text, code.position
        return model.Reasons(None, by_code, source.position, positions)

    def question(self, source: YamlNode, what: str) -> model.Node | None:
        """Read a node that is asked; an expression is the condition of that text."""
        if isinstance(source, YamlMapping):
            return self.node(source)
        if isinstance(source, YamlScalar) and (time := time_meant(source.text)) is not None:
            valid = [f'"{time}"' if what == "wait_until" else f'{{wait_until: "{time}"}}']
            self.error(source.position, f"{what}: {source.text!r} is no time of day", valid)
            return None
        condition = self.expression(source, what, or_node=True)
        return Condition(condition=condition, position=source.position) if condition else None

    def template(self, source: YamlNode, what: str) -> model.Value | None:
        """Read a text, with keys or without."""
        if isinstance(source, YamlMapping):
            self.error(source.position, f"{what} must be text")
            return None
        if isinstance(source, YamlSequence):
            self.error(source.position, f"{what} must be text, not a list", ["a single value"])
            return None
        value = self.value(source, what)
        return model.Literal(value.text, True, value.position) if isinstance(value, model.Literal) else value


@dataclass(frozen=True)
class Form:
    """A node of some kind, as it is written.

    Attributes:
        reader: Reads its parts, and takes the findings.
        key: The kind key.
        value: What stands behind the kind key.
        mapping: The whole node.
    """

    reader: NodeReader
    key: YamlScalar
    value: YamlNode
    mapping: YamlMapping

    @cached_property
    def fields(self) -> Fields:
        """The fields that every node has."""
        return self.reader.fields(self.key, self.mapping)

    def get(self, modifier: str) -> YamlNode | None:
        """Return what stands behind a modifier, None where it is not written."""
        return self.mapping.get(modifier)

    def child(self, modifier: str = "do") -> model.Node | None:
        """Read the node under a modifier, which must be there."""
        source = self.get(modifier)
        if source is None:
            message = f"{self.key.text} needs a node under `{modifier}`"
            self.reader.error(self.key.position, message, [f"{modifier}: {{a node}}"])
            return None
        return self.reader.node(source)

    def optional_child(self, modifier: str) -> model.Node | None:
        """Read the node under a modifier, None where it is not written."""
        source = self.get(modifier)
        return self.reader.node(source) if source is not None else None

    def children(self) -> tuple[model.Node, ...]:
        """Read the list of nodes behind the kind key."""
        if not isinstance(self.value, YamlSequence) or not self.value.items:
            valid = suggestions.for_children(self.key, self.value)
            self.reader.error(self.value.position, f"{self.key.text} needs a list of nodes", valid)
            return ()
        return tuple(node for item in self.value.items if (node := self.reader.node(item)) is not None)

    def optional_name(self, modifier: str) -> model.Literal | None:
        """Read the name behind a modifier, None where it is not written."""
        source = self.get(modifier)
        return self.reader.identifier(source, modifier) if source is not None else None

    def optional_key(self, modifier: str) -> model.Literal | None:
        """Read the key behind a modifier, with its dollar or without; None where it is not written."""
        source = self.get(modifier)
        return self.reader.identifier(without_dollar(source), modifier) if source is not None else None

    def codes(self, modifier: str) -> tuple[model.Literal, ...]:
        """Read the codes behind a modifier; none where it is not written."""
        source = self.get(modifier)
        return self.reader.identifiers(source, f"a code in {modifier}") if source is not None else ()

    def memory(self) -> bool:
        """Read whether the node has memory; it has where nothing is written."""
        source = self.get("memory")
        return source is None or self.reader.choice(source, "memory", ("true", "false")) != "false"

    def without_modifiers(self) -> YamlNode:
        """Return what stands behind the kind key, without modifiers that are indented too far."""
        if not isinstance(self.value, YamlMapping):
            return self.value
        for name, _ in self.value.entries:
            if name.text in NEVER_INPUTS:
                message = f"{name.text!r} stands among the inputs of {self.key.text}"
                valid = [f"{name.text} indented like {self.key.text}"]
                self.reader.error(name.position, message, valid)
        entries = tuple(entry for entry in self.value.entries if entry[0].text not in NEVER_INPUTS)
        return YamlMapping(entries, self.value.position)
