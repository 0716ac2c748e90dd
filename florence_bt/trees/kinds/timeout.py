"""``timeout``: stopped when it takes too long."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind
from florence_bt.trees.kinds.modifiers import DO
from florence_bt.trees.kinds.wait import PAUSE
from florence_bt.trees.language import value_schemas
from florence_bt.trees.language.model import Node, Value, Wrapper, show
from florence_bt.trees.language.node_kind import NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes, skipped_with

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Timeout(Wrapper):
    """Stops the node below when it takes too long, and fails then.

    Attributes:
        duration: How long it may take.
    """

    kind: ClassVar = NodeKind(
        word="timeout",
        about="stops a node that takes longer",
        symbol="⏱",
        value=value_schemas.PAUSE,
        example="- timeout: 1 min\n  do:\n    wait: 10 s",
        argument="30 s",
        modifiers=(DO,),
        needed=("do",),
        failures={"timed_out": "a time-out or a deadline passed"},
    )

    duration: Value

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the duration."""
        fields, child = form.fields, form.child()
        duration = form.reader.value(form.value, "timeout")
        return cls(child=child, duration=duration, **fields) if child and duration else None

    @property
    def default_title(self) -> str:
        """Such as ``within 30 s``."""
        return f"within {show(self.duration)}"

    @property
    def reads(self) -> tuple[Value, ...]:
        """The duration."""
        return (self.duration,)

    def check(self, checks: NodeChecks) -> None:
        """Check the duration."""
        checks.value(self.duration, PAUSE, "timeout")

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as the node below, or by the time-out."""
        child = known.of(self.child, skip_fails=self.skip_fails_below(skip_fails))
        codes = child.codes | known.of_value(self.duration, PAUSE) | {"timed_out"}
        return skipped_with(child, NodeOutcomes(child.can_succeed, codes), skip_fails)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the time-out."""
        from florence_bt.behaviours import pacing

        child = builder.child(self, skipped_fails)
        duration = builder.value(self.duration, Kind.DURATION)
        behaviour = pacing.Timeout(name, child, builder.context, duration, builder.spot())
        return builder.titled(self, behaviour, duration, Kind.DURATION)
