"""``for_each``: once for each item of a list."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind
from florence_bt.core.plain_yaml import YamlMapping, YamlScalar
from florence_bt.trees.kinds.modifiers import CODE, DO
from florence_bt.trees.language.model import ListItems, Literal, Node, Value, Wrapper, show
from florence_bt.trees.language.node_kind import KnownKinds, Modifier, NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.quantities import with_article
from florence_bt.trees.language.value_schemas import NAME, REFERENCE, WANTED_CODES

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

NONE_WORKED = "none_worked"
"""The code of a ``for_each`` with ``first_success: true`` that names none."""
_LOOP = re.compile(r"\$?(?P<item>[a-z][a-z0-9_]*) in (?P<items>.+)")
"""A loop of other languages: ``room in $rooms``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ForEach(Wrapper):
    """Does the node below for one item of a list after the other.

    Attributes:
        items: The list.
        item_key: ``as``: the key that receives the item.
        index_key: ``index``: the key that receives the number of the item, counted from 0, or None.
        goes_on_over: ``go_on_over``: the codes of failures after which the next item follows.
        first_success: Whether the first item that succeeds ends it (``first_success``).
    """

    kind: ClassVar = NodeKind(
        word="for_each",
        about="runs a node once for each item of a list",
        symbol="↻",
        value={"anyOf": [{"type": "array"}, REFERENCE]},
        example="- for_each: [kitchen, hall]\n  as: room\n  do:\n    run: goto_room\n    with: {room: $room}",
        argument="$rooms",
        modifiers=(
            DO,
            Modifier("as", "the key that receives the item", NAME, names_key=True),
            Modifier(
                "index",
                "the key that receives the number of the item, counted from 0",
                NAME,
                names_key=True,
            ),
            Modifier(
                "go_on_over",
                "failures with these codes, or of these groups of codes, do not end the loop",
                WANTED_CODES,
                never_input=True,
            ),
            Modifier(
                "first_success",
                "true: the first item that succeeds ends the loop, any failure leads to the next one",
                {"type": "boolean", "default": False, "errorMessage": "true or false"},
                never_input=True,
            ),
            CODE,
        ),
        needed=("do", "as"),
        failures={NONE_WORKED: "a `for_each` with `first_success: true` has no item that succeeds"},
        others=("for", "foreach", "for_all", "each", "map"),
    )
    decides_by_values: ClassVar = True
    skipped_with_child: ClassVar = False

    items: Value
    item_key: Literal
    index_key: Literal | None = None
    goes_on_over: tuple[Literal, ...] = ()
    first_success: bool = False

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the list, the key for its items, and when the loop ends."""
        fields, child, reader = form.fields, form.child(), form.reader
        items = reader.value(form.value, "for_each")
        if form.get("as") is None:
            loop = _LOOP.fullmatch(form.value.text) if isinstance(form.value, YamlScalar) else None
            valid = [f"for_each: {loop['items']}", f"as: {loop['item']}"] if loop else ["as: room"]
            reader.error(form.key.position, "for_each needs a key for the item under `as`", valid)
            return None
        item_key = form.optional_key("as")
        if child is None or items is None or item_key is None:
            return None
        return cls(
            child=child,
            items=items,
            item_key=item_key,
            index_key=form.optional_key("index"),
            goes_on_over=form.codes("go_on_over"),
            first_success=reader.flag(form.get("first_success"), "first_success"),
            **fields,
        )

    @classmethod
    def has_own_failure(cls, mapping: YamlMapping) -> bool:
        """Tell whether it has a failure of its own, which its ``code`` may be about."""
        first = mapping.get("first_success")
        return isinstance(first, YamlScalar) and first.text == "true"

    @property
    def default_title(self) -> str:
        """Such as ``for each $rooms``."""
        return f"for each {show(self.items)}"

    @property
    def details(self) -> tuple[str, ...]:
        """The keys, and when the loop ends."""
        return (
            f"as ${self.item_key.text}",
            *((f"index -> ${self.index_key.text}",) if self.index_key is not None else ()),
            *(
                (f"goes on over {', '.join(code.text for code in self.goes_on_over)}",)
                if self.goes_on_over
                else ()
            ),
            *(("the first success ends it",) if self.first_success else ()),
        )

    # ---- keys and values ------------------------------------------------------------------------------

    @property
    def reads(self) -> tuple[Value, ...]:
        """The list."""
        return (self.items,)

    def writes(self, known: KnownKinds) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the keys of the item and of its number."""
        listed = known.of(self.items)
        yield self.item_key, listed.item if listed is not None else None
        if self.index_key is not None:
            yield self.index_key, Kind.INTEGER

    def own_keys(self, part: Node) -> frozenset[str]:
        """Return the keys of the item and of its number, for the node below."""
        if part is not self.child:
            return frozenset()
        return frozenset(key.text for key in (self.item_key, self.index_key) if key is not None)

    def literals_of_keys(self) -> Iterator[tuple[Literal, str]]:
        """Yield the items that are written out."""
        items = self.items.items if isinstance(self.items, ListItems) else ()
        yield from ((item, self.item_key.text) for item in items if isinstance(item, Literal))

    def check(self, checks: NodeChecks) -> None:
        """Check that the list is one."""
        items, kind = self.items, checks.kind_of(self.items)
        if isinstance(items, ListItems) or kind is None or kind.item is not None:
            checks.value(items, None, "for_each")
            return
        valid = [f"[{show(items)}]", "an input or a key with type: list of text"]
        if isinstance(items, Literal) and items.text in checks.kinds:
            valid.insert(0, f"${items.text}")
        message = f"for_each needs a list, but {show(items)!r} is {with_article(kind)}"
        checks.findings.error(items.position, message, valid)

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def skip_fails_below(self, above: bool) -> bool:
        """Tell that an item which is skipped is none that has succeeded, where the first success counts."""
        return self.first_success

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how the loop can end: as an item does, or, where the first success ends it, without one."""
        child = known.of(self.child, skip_fails=self.first_success)
        over = known.codes_named(self.goes_on_over)
        written = isinstance(self.items, ListItems)
        left = known.of_value(self.items) | (NO_CODES if written else {"bad_input"})
        if self.first_success:
            left |= child.codes - over if over else NO_CODES
            return NodeOutcomes(child.can_succeed, left | {self.own_failure(NONE_WORKED)})
        goes_on = child.can_succeed or not over.isdisjoint(child.codes)
        empty = not isinstance(self.items, ListItems) or not self.items.items
        return NodeOutcomes(goes_on or empty, left | (child.codes - over))

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the loop, with keys of its own for what is below."""
        from florence_bt.behaviours import looping

        inside = builder.inside(self, self.child)
        child = inside.node(self.child, skipped_fails=self.first_success)
        builder.keep_watched()
        every = self.first_success and not self.goes_on_over
        return looping.ForEach(
            name,
            child,
            builder.context,
            builder.value(self.items, None),
            self.item_key.text,
            self.index_key.text if self.index_key is not None else None,
            goes_on_over=None if every else builder.codes(self.goes_on_over),
            first_success=self.first_success,
            code=self.own_failure(NONE_WORKED),
            own=inside.context.keys,
        )
