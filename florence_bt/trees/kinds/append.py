"""``append``: adds to keys that hold a text or a list."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from florence_bt.core.declaration import Kind, Port
from florence_bt.trees.kinds.assignments import Assignments, has_entries
from florence_bt.trees.language.model import Literal, Node, Reference, Value, show
from florence_bt.trees.language.node_kind import KnownKinds, NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.quantities import NUMERIC_KINDS, with_article
from florence_bt.trees.language.value_schemas import ASSIGNMENTS

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Append(Assignments):
    """Adds to keys that hold a text or a list."""

    kind: ClassVar = NodeKind(
        word="append",
        about="adds to a text or a list",
        symbol="+",
        value=ASSIGNMENTS,
        example="- append: {rooms: $room}",
        names_keys=True,
    )
    verb: ClassVar = "append to"
    sign: ClassVar = "+"

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the keys, each with what is added to it."""
        value, reader = form.value, form.reader
        values, fields = reader.values(value, "append"), form.fields
        if not has_entries(value):
            reader.error(value.position, "append needs keys and values", ['append: {report: "text"}'])
        return cls(values=values, **fields)

    # ---- keys and values ------------------------------------------------------------------------------

    @property
    def reads(self) -> tuple[Value, ...]:
        """Give what the keys hold, and what is added."""
        held = (Reference(key.text, key.position) for key, _ in self.values)
        return (*held, *(value for _, value in self.values))

    def writes(self, known: KnownKinds) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the keys, whose kinds stay as they are."""
        yield from ((key, None) for key, _ in self.values)

    def check(self, checks: NodeChecks) -> None:
        """Check that the keys hold a text or a list, and what is added."""
        for key, value in self.values:
            kind = checks.kinds.get(key.text)
            if kind is not None and kind.item is not None:
                checks.value(value, Port(kind.item, ""), key.text)
            elif kind is Kind.TEXT:
                checks.text(value, key.text)
            else:
                what = with_article(kind) if kind is not None else "of no known kind"
                message = f"append: ${key.text} is {what}, and only a text or a list can be added to"
                valid = [f'keys: {{{key.text}: {{type: text, default: ""}}}}', f"set: {{{key.text}: ...}}"]
                if kind in NUMERIC_KINDS:
                    valid.insert(0, f"add: {{{key.text}: {show(value)}}}")
                checks.findings.error(key.position, message, valid)

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: with failure where a key has no value, or a value cannot be read."""
        missing = any(not known.always_there(key.text) for key, _ in self.values)
        codes = frozenset({"missing_key"}) if missing else NO_CODES
        return NodeOutcomes(True, codes.union(*(known.of_value(value) for _, value in self.values)))

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the leaf."""
        from florence_bt.behaviours import leaves

        added = {key.text: self._added(key, value, builder) for key, value in self.values}
        return leaves.AppendToKeys(name, builder.context, added)

    @staticmethod
    def _added(key: Literal, value: Value, builder: TreeBuilder) -> Any:
        """Return what is added to a list, or to a text."""
        kind = builder.key_kinds.get(key.text)
        if kind is not None and kind.item is not None:
            return builder.value(value, kind.item)
        return builder.text(value)
