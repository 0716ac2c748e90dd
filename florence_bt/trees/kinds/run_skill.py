"""A skill: every kind key that is no kind of node is the name of one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.core.plain_yaml import YamlMapping, YamlScalar
from florence_bt.trees.kinds.modifiers import OUT
from florence_bt.trees.kinds.ports import shown_ports, unread
from florence_bt.trees.language.model import Literal, Node, Value, references
from florence_bt.trees.language.node_kind import KnownKinds, Modifier, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import OWN_CODES, MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.value_schemas import literal

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

SHORTEST_S = 0.01
"""The shortest period of ``every``: as often as an executor of BehaviorTree.CPP usually ticks."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunSkill(Node):
    """Runs a skill.

    Attributes:
        skill: The name that was written; whether there is such a skill is for the checks.
        inputs: Input names and values.
        outputs: Output names and the keys that receive them.
        mapping_given: Whether the inputs were written as a table, or nothing was.
        unread: Names of inputs whose values could not be read, which is a finding there.
        written: What stands there in place of a table.
        every: How often it is asked again where it is watched as a condition, in seconds; None: not given.
    """

    kind: ClassVar = NodeKind(
        word="skill",
        about="runs a skill",
        symbol="",
        value={"type": ["object", "null"]},
        modifiers=(
            OUT,
            Modifier(
                "every",
                "how often a composite without memory asks this condition again, 1 s if not given",
                literal(Kind.DURATION),
                never_input=True,
            ),
        ),
    )

    skill: str
    inputs: tuple[tuple[Literal, Value], ...] = ()
    outputs: tuple[tuple[Literal, Literal], ...] = ()
    mapping_given: bool = True
    unread: tuple[str, ...] = ()
    written: str = ""
    every: float | None = None

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the inputs, the outputs and how often it is asked again."""
        key, reader = form.key, form.reader
        given = isinstance(form.value, YamlMapping)
        value = form.without_modifiers()
        inputs = reader.values(value, key.text) if given else ()
        return cls(
            skill=key.text,
            inputs=inputs,
            outputs=reader.keys(form.get("out")),
            mapping_given=given or (isinstance(value, YamlScalar) and value.empty),
            unread=unread(value, inputs),
            written=value.text if isinstance(value, YamlScalar) else "",
            every=_read_every(form),
            **form.fields,
        )

    @property
    def default_title(self) -> str:
        """Such as ``navigate to``."""
        return self.skill.replace("_", " ")

    @property
    def details(self) -> tuple[str, ...]:
        """The skill, if the title does not say it, its inputs and its outputs."""
        return (*((self.skill,) if self.name else ()), *shown_ports(self.inputs, self.outputs))

    # ---- keys and values ------------------------------------------------------------------------------

    @property
    def reads(self) -> tuple[Value, ...]:
        """The inputs."""
        return tuple(value for _, value in self.inputs)

    def writes(self, known: KnownKinds) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the keys that receive the outputs."""
        given = known.outputs(self) if self.outputs else {}
        yield from ((key, given.get(output.text)) for output, key in self.outputs)

    def is_condition(self, declaration: SkillDeclaration) -> bool:
        """Tell whether it is asked again where it is watched: it answers at once, or `every` says so."""
        return declaration.instant or self.every is not None

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as declared, and as any use of a skill can."""
        declaration = known.declarations.get(self.skill)
        declared = declaration.failures if declaration else ()
        given = [known.of_value(value) for _, value in self.inputs]
        return NodeOutcomes(True, frozenset({*declared, *COMMON_CODES, *OWN_CODES}).union(*given))

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the use of the skill: an action, or where it is watched a condition."""
        from florence_bt.behaviours import run_skill, watched_skill

        declaration = builder.declaration(self)
        problem = f"{self.skill} has no input"
        inputs = builder.inputs(self.inputs, declaration.inputs, problem)
        outputs = {output.text: key.text for output, key in self.outputs}
        spot = builder.spot()
        if spot is None:
            return run_skill.RunSkill(name, builder.context, self.skill, inputs, outputs)
        if not self.is_condition(declaration):
            return watched_skill.ConditionAction(name, builder.context, self.skill, inputs, outputs, spot)
        keys = {each.key for value in self.reads for each in references(value)}
        every = watched_skill.EVERY_S if self.every is None else self.every
        return watched_skill.WatchedSkill(
            name, builder.context, self.skill, inputs, outputs, spot, keys=keys, every=every
        )


def _read_every(form: Form) -> float | None:
    """Read ``every`` in seconds."""
    source = form.get("every")
    seconds = form.reader.duration(source, "every") if source is not None else None
    if source is None or seconds is None:
        return None
    if seconds < SHORTEST_S:
        form.reader.error(source.position, "every: at least 10 ms are needed", ["1 s", "100 ms"])
        return None
    return seconds
