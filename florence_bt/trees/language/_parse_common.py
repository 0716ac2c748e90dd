"""What the parsers of all kinds of nodes need: the modifiers of every node, and the nodes below."""

from __future__ import annotations

import abc
from collections.abc import Callable
from typing import Any

from florence_bt.trees.language._reader import Reader
from florence_bt.trees.language.model import Literal, Node, Reasons, Value
from florence_bt.trees.language.source import Listing, Source, Table, Text


class Parsing(abc.ABC):
    """The state of a parser of nodes.

    Args:
        reader: Collects the findings.
    """

    def __init__(self, reader: Reader) -> None:
        self.reader = reader

    @abc.abstractmethod
    def node(self, source: Source) -> Node | None:
        """Parse one node with everything below it; None (noted) when it is broken."""

    def common(self, key: Text, table: Table) -> dict[str, Any]:
        """The fields that every node has."""
        fields: dict[str, Any] = {"position": key.position}
        for modifier, source in table.entries:
            match modifier.text:
                case "name":
                    fields["name"] = self.reader.text(source, "name")
                case "because":
                    fields["reasons"] = self._reasons(source)
                case "finally":
                    fields["cleanup"] = self.node(source)
                case "when" | "unless":
                    fields[modifier.text] = self.reader.expression(source, modifier.text)
                case "while":
                    fields["holds"] = self.reader.expression(source, "while")
        return fields

    def child(self, key: Text, table: Table, modifier: str = "do") -> Node | None:
        """The node under a modifier; None (noted) when there is none."""
        source = table.get(modifier)
        if source is None:
            problem = f"{key.text} needs a node under `{modifier}`"
            self.reader.problem(key.position, problem, [f"{modifier}: {{a node}}"])
            return None
        return self.node(source)

    def text(self, source: Source, what: str) -> Value | None:
        """A text, with keys or without."""
        if isinstance(source, Table):
            self.reader.problem(source.position, f"{what} must be a text")
            return None
        if isinstance(source, Listing):
            self.reader.problem(source.position, f"{what} must be a text, not a list", ["a single text"])
            return None
        value = self.reader.value(source, what)
        return Literal(value.text, True, value.position) if isinstance(value, Literal) else value

    def _reasons(self, source: Source) -> Reasons | None:
        if not isinstance(source, Table):
            always = self.text(source, "because")
            return Reasons(always, {}, source.position) if always is not None else None
        by_code, places = {}, {}
        for key, item in source.entries:
            code = self.reader.identifier(key, "a code in because")
            text = self.text(item, f"because {key.text}")
            if code is not None and text is not None:
                by_code[code.text], places[code.text] = text, code.position
        return Reasons(None, by_code, source.position, places)


Maker = Callable[[Parsing, Text, Source, Table], Node | None]
"""Makes a node from its kind key, the value of that key, and the whole table."""
