"""``set``: writes keys; ``add`` is short for sums of keys."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import YamlMapping, YamlScalar
from florence_bt.trees.kinds.assignments import Assignments, has_entries
from florence_bt.trees.language.expressions.parser import parse_expression
from florence_bt.trees.language.expressions.syntax import Binary, Expression, Key, print_term
from florence_bt.trees.language.model import Literal, Node, Value, show
from florence_bt.trees.language.node_kind import KnownKinds, NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.value_schemas import ASSIGNMENTS
from florence_bt.trees.language.values import term_of
from florence_bt.trees.language.vocabulary import IDENTIFIER

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

_ASSIGNMENT = re.compile(r"\$?(?P<key>[a-z][a-z0-9_]*)\s*[:=]\s*(?P<value>[^=].*)")
"""An assignment by people who know a programming language: ``tries = 3``."""
_BARE_NAME = re.compile(r"(?<![$\w\"'.])([a-z_][a-z0-9_]*)(?!\w*\()")
"""The name of a key without its dollar."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Set(Assignments):
    """Writes keys."""

    kind: ClassVar = NodeKind(
        word="set",
        about="writes keys",
        symbol="=",
        value=ASSIGNMENTS,
        example="- set: {found: true}",
        names_keys=True,
    )
    verb: ClassVar = "set"
    sign: ClassVar = "="

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the keys and values."""
        value, reader = form.value, form.reader
        fields, empty = form.fields, isinstance(value, YamlScalar) and value.empty
        if isinstance(value, YamlScalar) and not empty and (match := _ASSIGNMENT.fullmatch(value.text)):
            valid = [f"set: {{{match['key']}: {_as_value(match['value'])}}}"]
            reader.error(value.position, "set must be a mapping (key: value)", valid)
            return cls(values=(), **fields)
        values = reader.values(value, "set")
        if empty or (isinstance(value, YamlMapping) and not value.entries):
            reader.error(value.position, "set needs keys and values", ["set: {key: value}"])
        return cls(values=values, **fields)

    # ---- keys and values ------------------------------------------------------------------------------

    @property
    def reads(self) -> tuple[Value, ...]:
        """Give the values that the keys get."""
        return tuple(value for _, value in self.values)

    def writes(self, known: KnownKinds) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the keys."""
        yield from ((key, known.of(value)) for key, value in self.values)

    def literals_of_keys(self) -> Iterator[tuple[Literal, str]]:
        """Yield what is written out."""
        yield from ((value, key.text) for key, value in self.values if isinstance(value, Literal))

    def check(self, checks: NodeChecks) -> None:
        """Check that each key can hold what it is given."""
        for key, value in self.values:
            checks.value(value, checks.declared_keys.get(key.text), key.text)

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: with failure where a value cannot be read, or a key cannot hold it."""
        codes = NO_CODES
        for key, value in self.values:
            checked = key.text in known.declared_keys and not isinstance(value, Literal)
            codes |= known.of_value(value) | ({"bad_output"} if checked else NO_CODES)
        return NodeOutcomes(True, codes)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the leaf."""
        from florence_bt.behaviours import leaves

        ports = ((key.text, value, builder.declared_keys.get(key.text)) for key, value in self.values)
        values = {key: builder.value(value, port.kind if port else None) for key, value, port in ports}
        return leaves.SetKey(name, builder.context, values)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Add(Set):
    """Writes sums of keys and what is added to them: ``add: {n: 1}`` is ``set: {n: "${$n + 1}"}``."""

    kind: ClassVar = NodeKind(
        word="add",
        about="adds to numbers and quantities",
        symbol="+",
        value=ASSIGNMENTS,
        example="- add: {rounds: 1}",
        names_keys=True,
    )
    verb: ClassVar = "add to"

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the keys, each with what is added to it."""
        value, reader = form.value, form.reader
        if not has_entries(value):
            written = value.text.removeprefix("$") if isinstance(value, YamlScalar) else ""
            meant = written if IDENTIFIER.fullmatch(written) else "key"
            reader.error(value.position, "add needs keys and values", [f"add: {{{meant}: 1}}"])
            return cls(values=(), **form.fields)
        sums = []
        for name, given in reader.values(value, "add"):
            if (term := term_of(given)) is not None:
                total = Binary("+", Key(name.text, name.position), term, given.position)
                sums.append((name, Expression(print_term(total), total, given.position)))
                continue
            message = f"add: {show(given)!r} is no number and no quantity"
            valid = [f"append: {{{name.text}: {show(given)}}}, to a text or a list"]
            reader.error(given.position, message, valid)
        return cls(values=tuple(sums), **form.fields)


def _as_value(text: str) -> str:
    """Write a value as ``set`` takes it; a sum of other languages, ``n + 1``, with its dollars and braces."""
    sum_ = _BARE_NAME.sub(r"$\1", text)
    try:
        term = parse_expression(sum_).term
    except ConfigError:
        return text
    return f'"${{{sum_}}}"' if isinstance(term, Binary) else text
