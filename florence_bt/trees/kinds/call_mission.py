"""``run``: another mission, with keys of its own."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind
from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlScalar
from florence_bt.trees.kinds.modifiers import OUT
from florence_bt.trees.kinds.ports import shown_ports, unread
from florence_bt.trees.language.model import Literal, Node, Value
from florence_bt.trees.language.node_kind import KnownKinds, Modifier, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, SUCCEEDS, MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.value_schemas import A_KEY, NAME

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

_CALL = re.compile(r"(?P<name>[a-z][a-z0-9_]*)\s*\(.*|(?P<first>[a-z][a-z0-9]*_[a-z0-9_]*)\s.*", re.DOTALL)
"""A call as in a programming language, or an input behind the name of a mission."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CallMission(Node):
    """Runs another mission with keys of its own.

    Attributes:
        mission: Its name.
        inputs: Input names and values.
        outputs: Output names and the keys that receive them.
        unread: Names of inputs whose values could not be read, which is a finding there.
    """

    kind: ClassVar = NodeKind(
        word="run",
        about="runs another mission with keys of its own",
        symbol="▤",
        value=NAME,
        example="- run: go_home",
        modifiers=(
            Modifier(
                "with",
                "the inputs of the mission",
                {"type": ["object", "null"], **A_KEY, "additionalProperties": False},
                never_input=True,
            ),
            OUT,
        ),
        others=("call", "subtree", "do_mission"),
    )
    decides_by_values: ClassVar = True

    mission: Literal
    inputs: tuple[tuple[Literal, Value], ...] = ()
    outputs: tuple[tuple[Literal, Literal], ...] = ()
    unread: tuple[str, ...] = ()

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the name of the mission, its inputs and its outputs."""
        fields, reader, value = form.fields, form.reader, form.value
        if isinstance(value, YamlMapping):
            valid = ["run: goto_room", "with: {room: kitchen} indented like run"]
            reader.error(value.position, "run needs the name of a mission, not a mapping", valid)
            return None
        mission = reader.identifier(value, "run", _without_inputs(value))
        given = form.get("with")
        inputs, outputs = reader.values(given, "with"), reader.keys(form.get("out"))
        if mission is None:
            return None
        return cls(mission=mission, inputs=inputs, outputs=outputs, unread=unread(given, inputs), **fields)

    @property
    def default_title(self) -> str:
        """Such as ``run detect_user``."""
        return f"run {self.mission.text}"

    @property
    def details(self) -> tuple[str, ...]:
        """The inputs and outputs."""
        return tuple(shown_ports(self.inputs, self.outputs))

    # ---- keys and values ------------------------------------------------------------------------------

    @property
    def reads(self) -> tuple[Value, ...]:
        """The inputs."""
        return tuple(value for _, value in self.inputs)

    def writes(self, known: KnownKinds) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the keys that receive the outputs."""
        given = known.outputs(self) if self.outputs else {}
        yield from ((key, given.get(output.text)) for output, key in self.outputs)

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as the mission can, and with inputs or outputs that do not fit."""
        below = known.called(self.mission.text) or SUCCEEDS
        given = [known.of_value(value) for _, value in self.inputs]
        codes = below.codes.union(*given, ("missing_key", "bad_input") if self.inputs else ())
        return NodeOutcomes(below.can_succeed, codes | ({"bad_output"} if self.outputs else NO_CODES))

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the call, and the tree of the mission below it."""
        from florence_bt.behaviours import decorators

        call = builder.call(self)
        problem = f"{self.mission.text} has no input"
        return decorators.CallMission(
            name,
            call.tree,
            builder.context,
            call.keys,
            call.mission.inputs,
            builder.inputs(self.inputs, call.mission.inputs, problem),
            {output.text: key.text for output, key in self.outputs},
            watched=builder.spot() is not None,
        )


def _without_inputs(source: YamlNode) -> tuple[str, ...]:
    """Suggest what would have worked where the name of a mission has its inputs behind it."""
    match = _CALL.fullmatch(source.text.strip()) if isinstance(source, YamlScalar) else None
    if match is None:
        return ()
    return (f"run: {match['name'] or match['first']}", "with: {...} for the inputs, below it")
