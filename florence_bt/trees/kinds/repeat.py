"""``repeat``: again after a success."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind
from florence_bt.trees.kinds.modifiers import DO
from florence_bt.trees.kinds.rounds import COUNT, ROUNDS, read_rounds
from florence_bt.trees.language.model import Node, Value, Wrapper, show
from florence_bt.trees.language.node_kind import NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repeat(Wrapper):
    """Starts the node below again when it succeeds.

    Attributes:
        rounds: How often; None: forever.
    """

    kind: ClassVar = NodeKind(
        word="repeat",
        about="runs a node a number of times",
        symbol="↻",
        value=ROUNDS,
        example="- repeat: 3\n  do:\n    wait: 1 s",
        argument="3",
        modifiers=(DO,),
        needed=("do",),
        others=("loop",),
    )
    skipped_with_child: ClassVar = False

    rounds: Value | None

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the number of rounds."""
        fields, child = form.fields, form.child()
        rounds, readable = read_rounds(form)
        return cls(child=child, rounds=rounds, **fields) if child is not None and readable else None

    @property
    def default_title(self) -> str:
        """Such as ``repeat 3 times``."""
        return f"repeat {show(self.rounds)} times" if self.rounds is not None else "repeat forever"

    @property
    def reads(self) -> tuple[Value, ...]:
        """The number of rounds."""
        return (self.rounds,) if self.rounds is not None else ()

    def check(self, checks: NodeChecks) -> None:
        """Check the number of rounds."""
        if self.rounds is not None:
            checks.value(self.rounds, COUNT, "repeat")

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as the last round, and without end only with a failure."""
        child = known.of(self.child, skip_fails=self.skip_fails_below(skip_fails))
        if self.rounds is None:
            return NodeOutcomes(False, child.codes)
        return NodeOutcomes(child.can_succeed, child.codes | known.of_value(self.rounds, COUNT))

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the loop."""
        from florence_bt.behaviours import looping

        child = builder.child(self, skipped_fails)
        builder.keep_watched()
        rounds = builder.value(self.rounds, Kind.INTEGER) if self.rounds is not None else math.inf
        behaviour = looping.Repeat(name, child, builder.context, rounds)
        return builder.titled(self, behaviour, rounds, Kind.INTEGER)
