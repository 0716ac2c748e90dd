"""``switch``: the branch whose case is equal to a value."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.plain_yaml import YamlMapping
from florence_bt.trees.language.model import Literal, Node, Reference, Value, show
from florence_bt.trees.language.node_kind import Modifier, NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes, codes_of
from florence_bt.trees.language.quantities import guess_value
from florence_bt.trees.language.value_schemas import NODE
from florence_bt.trees.language.values import literal_kind

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

_SEVERAL = re.compile(r"(\w+)(?:, ?| or | ?\| ?)(\w+)")
"""A case that is meant to stand for several values: ``yes, ja``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Switch(Node):
    """Does the node whose case is equal to a value.

    Attributes:
        value: What is looked at, once, at the start.
        cases: The values, each with its branch.
        default: What is done when no case fits; None: the node fails then.
    """

    kind: ClassVar = NodeKind(
        word="switch",
        about="runs the node whose case equals a value",
        symbol="◈",
        value={"$ref": "#/definitions/any"},
        example="- switch: $room\n  cases:\n    kitchen:\n      wait: 1 s",
        modifiers=(
            Modifier(
                "cases",
                "the values, each with the node to run for it",
                {"type": "object", "additionalProperties": NODE, "minProperties": 1},
                never_input=True,
            ),
            Modifier("default", "the node to run when no case fits", NODE),
        ),
        needed=("cases",),
        failures={"no_case": "no case of a `switch` fits"},
        others=("match",),
    )
    decides_by_values: ClassVar = True

    value: Value
    cases: tuple[tuple[Literal, Node], ...]
    default: Node | None = None

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the value and the cases."""
        reader, source = form.reader, form.get("cases")
        value = reader.value(form.value, "switch")
        entries = source.entries if isinstance(source, YamlMapping) else ()
        if not entries:
            position = source.position if source is not None else form.key.position
            reader.error(position, "switch needs cases", ["cases: {value: node, value: node}"])
        cases = tuple(
            (Literal(name.text, name.quoted, name.position), node)
            for name, item in entries
            if (node := reader.node(item)) is not None
        )
        default, fields = form.optional_child("default"), form.fields
        return cls(value=value, cases=cases, default=default, **fields) if value is not None else None

    @property
    def parts(self) -> tuple[Node, ...]:
        """The branches."""
        return (*(node for _, node in self.cases), *((self.default,) if self.default is not None else ()))

    @property
    def default_title(self) -> str:
        """Such as ``switch $mode``."""
        return f"switch {show(self.value)}"

    @property
    def edges(self) -> tuple[str, ...]:
        """The cases."""
        return (*(case.text for case, _ in self.cases), *(("default",) if self.default is not None else ()))

    # ---- keys and values ------------------------------------------------------------------------------

    @property
    def reads(self) -> tuple[Value, ...]:
        """The value."""
        return (self.value,)

    def literals_of_keys(self) -> Iterator[tuple[Literal, str]]:
        """Yield the cases, which are held against a key."""
        if isinstance(self.value, Reference):
            yield from ((case, self.value.key) for case, _ in self.cases)

    def check(self, checks: NodeChecks) -> None:
        """Check that the cases fit the value, and that each can be reached."""
        checks.value(self.value, None, "switch")
        kind = checks.kind_of(self.value)
        first: dict[tuple[bool, object], int] = {}
        for case, _ in self.cases:
            if kind is not None:
                checks.value(case, Port(kind, "", choices=checks.choices_of(self.value)), "case")
            literal = literal_kind(case, kind)
            value = (isinstance(literal, bool), literal)  # for Python 1 is True, and 0 is False
            if value in first:
                message = f"the case {case.text!r} is duplicated (first in line {first[value]})"
                checks.findings.error(case.position, message, ["another value", "one case"])
            first.setdefault(value, case.position.line)
            if case.text == "default" and not case.quoted and self.default is None:
                message = "'default' is a case like another here"
                valid = ["default: indented like cases", '"default"']
                checks.findings.warning(case.position, message, valid)
            if kind is Kind.TEXT and not case.quoted and (several := _SEVERAL.fullmatch(case.text)):
                message = f"the case {case.text!r} is one text, and not several"
                valid = [f"{several[1]}: and {several[2]}: each with its node", f'"{case.text}" for the text']
                checks.findings.warning(case.position, message, valid)
        if self.default is not None and {(True, True), (True, False)} <= first.keys():
            message = "the default is never reached: there are cases for true and for false"
            checks.findings.in_vain(self.default.position, message, ["leaving out the default"])

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as any branch can, and without a default when no case fits."""
        ways = [known.of(part, skip_fails=skip_fails) for part in self.parts]
        codes = codes_of(ways) | known.of_value(self.value)
        if self.default is None:
            codes |= {"no_case"}
        skips = any(way.can_skip for way in ways)
        return NodeOutcomes(any(way.can_succeed for way in ways), codes, can_skip=skips)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build all branches."""
        from florence_bt.behaviours import branching

        branches = builder.children(self.parts, skipped_fails=skipped_fails)
        wanted = [self._can_be(literal, builder) for literal, _ in self.cases]
        default = branches.pop() if self.default is not None else None
        labels = [literal.text for literal, _ in self.cases]
        value = builder.value(self.value, None)
        cases = list(zip(wanted, branches, strict=True))
        behaviour = branching.Switch(name, builder.context, value, cases, default, labels)
        return builder.titled(self, behaviour, value, None)

    def _can_be(self, literal: Literal, builder: TreeBuilder) -> tuple[Any, ...]:
        """Return what the value can be when a case fits; more than one when its kind is not known."""
        kind = builder.kind_of(self.value)
        if literal.quoted or kind is Kind.TEXT:
            return (literal.text,)
        if kind is not None:
            return (builder.value(literal, kind),)
        guessed = guess_value(literal.text)[1]
        return (guessed,) if guessed == literal.text else (guessed, literal.text)
