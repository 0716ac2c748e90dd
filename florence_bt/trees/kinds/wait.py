"""``wait``: a pause."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.plain_yaml import YamlScalar
from florence_bt.trees.language import value_schemas
from florence_bt.trees.language.model import Node, Value, show
from florence_bt.trees.language.node_kind import NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

PAUSE = Port(Kind.DURATION, "", minimum=0.0)
"""The value of ``wait`` and ``timeout``."""
_TIME_TO_WAIT_FOR = re.compile(r"(?:until|till|at) ((?:[01]?\d|2[0-3]):[0-5]\d)")
"""A time of day where a duration is wanted: ``until 22:00``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wait(Node):
    """Runs for a time, and succeeds.

    Attributes:
        duration: How long.
    """

    kind: ClassVar = NodeKind(
        word="wait",
        about="pauses",
        symbol="⏸",
        value=value_schemas.PAUSE,
        example="- wait: 5 s",
        others=("sleep", "pause"),
    )
    takes_time: ClassVar = True

    duration: Value

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the duration."""
        value, reader = form.value, form.reader
        time = _TIME_TO_WAIT_FOR.fullmatch(value.text) if isinstance(value, YamlScalar) else None
        if isinstance(value, YamlScalar) and time is not None:
            message = f"wait: {value.text!r} is a time of day"
            reader.error(value.position, message, [f"wait_until: {time[1]}"])
            return None
        duration, fields = reader.value(value, "wait"), form.fields
        return cls(duration=duration, **fields) if duration is not None else None

    @property
    def default_title(self) -> str:
        """Such as ``wait 1 s``."""
        return f"wait {show(self.duration)}"

    @property
    def reads(self) -> tuple[Value, ...]:
        """The duration."""
        return (self.duration,)

    def check(self, checks: NodeChecks) -> None:
        """Check the duration."""
        checks.value(self.duration, PAUSE, "wait")

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: with success, if the duration can be read."""
        return NodeOutcomes(True, known.of_value(self.duration, PAUSE))

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the pause."""
        from florence_bt.behaviours import pacing

        seconds = builder.value(self.duration, Kind.DURATION)
        behaviour = pacing.Wait(name, builder.context, seconds, builder.spot())
        return builder.titled(self, behaviour, seconds, Kind.DURATION)
