"""``retry``: again after a failure."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind
from florence_bt.trees.kinds.modifiers import DO
from florence_bt.trees.kinds.rounds import COUNT, ROUNDS, read_rounds
from florence_bt.trees.language.model import Literal, Node, Value, Wrapper, show
from florence_bt.trees.language.node_kind import KnownKinds, Modifier, NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes, skipped_with
from florence_bt.trees.language.value_schemas import NAME, NODE, WANTED_CODES

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Retry(Wrapper):
    """Starts the node below again when it fails.

    Attributes:
        attempts: How often at most; None: without end.
        on: The codes and groups of codes that are worth another attempt; none: every code.
        attempt_key: The key that receives the number of the attempt, or None.
        between: What is done before each further attempt, or None.
    """

    kind: ClassVar = NodeKind(
        word="retry",
        about="starts a node again when it fails, up to a number of attempts",
        symbol="↻",
        value=ROUNDS,
        example="- retry: 3\n  do:\n    wait: 1 s",
        argument="3",
        modifiers=(
            DO,
            Modifier(
                "on",
                "only failures with these codes, or of these groups of codes, are worth another attempt",
                WANTED_CODES,
            ),
            Modifier("attempt", "the key that receives the number of the attempt", NAME, names_key=True),
            Modifier(
                "between",
                "a node that runs before each further attempt, such as a pause",
                NODE,
                never_input=True,
            ),
        ),
        needed=("do",),
        others=("retry_until_successful",),
    )

    attempts: Value | None
    on: tuple[Literal, ...] = ()
    attempt_key: Literal | None = None
    between: Node | None = None

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the number of attempts, which failures are worth another one, and what is done before it."""
        fields, child = form.fields, form.child()
        attempts, readable = read_rounds(form)
        on, attempt_key = form.codes("on"), form.optional_name("attempt")
        between = form.optional_child("between")
        if child is None or not readable:
            return None
        return cls(child=child, attempts=attempts, on=on, attempt_key=attempt_key, between=between, **fields)

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child, and what is done between two attempts."""
        return (self.child, self.between) if self.between is not None else (self.child,)

    @property
    def default_title(self) -> str:
        """Such as ``retry up to 8 times``."""
        return f"retry up to {show(self.attempts)} times" if self.attempts is not None else "retry forever"

    @property
    def edges(self) -> tuple[str, ...]:
        """Name the part that is done between two attempts."""
        return ("", "between")[: len(self.parts)]

    @property
    def details(self) -> tuple[str, ...]:
        """The codes, and the key of the attempt."""
        return (
            *((f"on {', '.join(code.text for code in self.on)}",) if self.on else ()),
            *((f"attempt -> ${self.attempt_key.text}",) if self.attempt_key is not None else ()),
        )

    # ---- keys and values ------------------------------------------------------------------------------

    @property
    def reads(self) -> tuple[Value, ...]:
        """The number of attempts."""
        return (self.attempts,) if self.attempts is not None else ()

    def writes(self, known: KnownKinds) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the key of the attempt."""
        if self.attempt_key is not None:
            yield self.attempt_key, Kind.INTEGER

    def own_keys(self, part: Node) -> frozenset[str]:
        """Return the key of the attempt, for all but the clean-up."""
        own = self.attempt_key is not None and part is not self.cleanup
        return frozenset((self.attempt_key.text,)) if own and self.attempt_key is not None else frozenset()

    def check(self, checks: NodeChecks) -> None:
        """Check the number of attempts."""
        if self.attempts is not None:
            checks.value(self.attempts, COUNT, "retry")

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how the last attempt can end; without end only a failure that is worth no other ends it."""
        child = known.of(self.child, skip_fails=self.skip_fails_below(skip_fails))
        codes = child.codes
        if self.attempts is not None:
            codes |= known.of_value(self.attempts, COUNT)
        else:
            codes = codes - known.codes_named(self.on) if self.on else NO_CODES
        if self.between is not None:
            codes |= known.of(self.between, skip_fails=False).codes
        return skipped_with(child, NodeOutcomes(child.can_succeed, codes), skip_fails)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the loop, with a key of its own for what is below."""
        from florence_bt.behaviours import looping
        from florence_bt.behaviours.annotations import numbered

        inside = builder.inside(self, self.child)
        child = inside.node(self.child, skipped_fails=self.skip_fails_below(skipped_fails))
        builder.keep_watched()
        attempts = builder.value(self.attempts, Kind.INTEGER) if self.attempts is not None else math.inf
        pause = inside.node(self.between, skipped_fails=False) if self.between is not None else None
        key = self.attempt_key.text if self.attempt_key is not None else None
        own, on = inside.context.keys, builder.codes(self.on)
        behaviour = looping.Retry(name, child, builder.context, attempts, on, key, pause, own)
        numbered(behaviour.children)
        return builder.titled(self, behaviour, attempts, Kind.INTEGER)
