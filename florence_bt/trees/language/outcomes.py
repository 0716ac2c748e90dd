"""Possible ends of each node of a mission, found without running it: the basis of what is never reached.

Everything here errs on one side: what is said to be impossible is impossible; what is said to be possible may
in truth never happen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from florence_bt.core.declaration import Port, SkillDeclaration
from florence_bt.trees.language import model
from florence_bt.trees.language.code_groups import codes_named, groups_of
from florence_bt.trees.language.expressions.compiling import can_break, constant_of
from florence_bt.trees.language.model import Expression, Literal, Mission, Node, Value
from florence_bt.trees.language.vocabulary import GUARD_FAILED

OWN_CODES = {
    "missing_key": "a key was read that nothing has written",
    "no_skill": "this robot lacks the skill",
    "bad_output": "the skill succeeded without giving what it promises",
}
"""Codes that the tree itself gives the use of a skill, beside those of the skill."""


@dataclass(frozen=True, slots=True)
class NodeOutcomes:
    """The outcomes that a node can have.

    Attributes:
        can_succeed: Whether it can succeed.
        codes: The codes it can fail with; none when it cannot fail.
        skip_succeeds: Whether it counts as success when a guard keeps it from starting; else it has failed.
        only_skips: Whether it succeeds in no other way than that.
        can_skip: Whether it, or all that it has to do, can be skipped.
    """

    can_succeed: bool
    codes: frozenset[str]
    skip_succeeds: bool = True
    only_skips: bool = False
    can_skip: bool = False

    @property
    def can_fail(self) -> bool:
        """Tell whether it can fail."""
        return bool(self.codes)

    @property
    def ends(self) -> bool:
        """Tell whether it can end in any way but by being stopped."""
        return self.can_succeed or self.can_fail


SUCCEEDS = NodeOutcomes(True, frozenset())
NO_CODES = frozenset[str]()


class MissionOutcomes:
    """Finds the outcomes of every node of one mission.

    Args:
        mission: The mission.
        declarations: The skills by name.
        called: Gives the outcomes of a mission that is called, None when they are not known.
    """

    def __init__(
        self,
        mission: Mission,
        declarations: Mapping[str, SkillDeclaration],
        called: Callable[[str], NodeOutcomes | None],
    ) -> None:
        self._inputs = mission.inputs
        self.declared_keys = mission.keys
        self.declarations = declarations
        self.groups = groups_of(declarations)
        self.called = called
        self.by_node: dict[Node, NodeOutcomes] = {}
        """The outcomes of each node."""
        if mission.tree is not None:
            self.of(mission.tree, skip_fails=False)

    def of(self, node: Node, *, skip_fails: bool) -> NodeOutcomes:
        """Return the outcomes of a node.

        Args:
            node: The node.
            skip_fails: Whether it has failed when it is skipped: where another one is tried then.
        """
        outcomes = node.outcomes(self, skip_fails)
        if node.cleanup is not None:
            self.of(node.cleanup, skip_fails=False)
        if node.guards:
            outcomes = self._guarded(node, outcomes, skip_fails)
        self.by_node[node] = outcomes
        return outcomes

    def _guarded(self, node: Node, outcomes: NodeOutcomes, skip_fails: bool) -> NodeOutcomes:
        codes = outcomes.codes.union(*(self.of_expression(guard) for guard in node.guards))
        never = constant_of(node.when) is False
        can_succeed = outcomes.can_succeed and not never and constant_of(node.holds) is not False
        if constant_of(node.holds) is not True and node.holds is not None:
            codes |= {node.own_failure(GUARD_FAILED)}
        if node.when is None:
            return NodeOutcomes(can_succeed, codes, can_skip=outcomes.can_skip)
        if skip_fails:
            return NodeOutcomes(can_succeed, codes | {"skipped"}, skip_succeeds=False, can_skip=True)
        return NodeOutcomes(True, codes, only_skips=not can_succeed, can_skip=True)

    def codes_named(self, words: Iterable[Literal]) -> frozenset[str]:
        """Return the codes that some codes and groups stand for."""
        return NO_CODES.union(*(codes_named(word.text, self.groups) for word in words))

    def of_value(self, value: Value, port: Port | None = None) -> frozenset[str]:
        """Return the codes with which reading a value can fail; ``port`` is what the node demands of it."""
        if isinstance(value, Literal):
            return NO_CODES
        codes = self.of_expression(value) if isinstance(value, Expression) else NO_CODES
        if any(not self.always_there(reference.key) for reference in model.references(value)):
            codes |= {"missing_key"}
        if port is not None and not self._within(value, port):
            codes |= {"bad_input"}
        return codes

    def of_expression(self, expression: Expression) -> frozenset[str]:
        """Return the codes with which an expression can fail."""
        missing = any(not self.always_there(key) for key in expression.keys)
        return frozenset(
            (["missing_key"] if missing else []) + (["bad_expression"] if can_break(expression) else [])
        )

    def always_there(self, key: str) -> bool:
        """Tell whether a key has a value from the start."""
        return key in self._inputs or (key in self.declared_keys and not self.declared_keys[key].required)

    def _within(self, value: Value, port: Port) -> bool:
        """Tell whether a value is a mission's input with limits that are no wider than a port's."""
        given = self._inputs.get(value.key) if isinstance(value, model.Reference) else None
        if given is None or given.kind is not port.kind or port.minimum is None:
            return False
        return given.minimum is not None and given.minimum >= port.minimum


def skipped_with(below: NodeOutcomes, own: NodeOutcomes, skip_fails: bool) -> NodeOutcomes:
    """Add to the outcomes of a node what becomes of it when it is skipped with what is below."""
    if not below.can_skip:
        return own
    codes = own.codes | {"skipped"} if skip_fails else own.codes
    return NodeOutcomes(own.can_succeed or not skip_fails, codes, can_skip=True)


def codes_of(outcomes: Iterable[NodeOutcomes]) -> frozenset[str]:
    """Return the codes of several nodes."""
    return NO_CODES.union(*(each.codes for each in outcomes))


def up_to(parts: list[NodeOutcomes], is_last: Callable[[NodeOutcomes], bool]) -> list[NodeOutcomes]:
    """Return the parts that are reached: those up to the first after which nothing follows."""
    last = next((number for number, part in enumerate(parts) if is_last(part)), len(parts))
    return parts[: last + 1]
