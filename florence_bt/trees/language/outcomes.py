"""How each node of a mission can end, found without running it: the basis of what is never reached.

Everything here errs on one side: what is said to be impossible is impossible; what is said to be possible may
in truth never happen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES, LASTING_CODES
from florence_bt.trees.language import model
from florence_bt.trees.language.code_groups import ANY, by_code, codes_named, groups_of
from florence_bt.trees.language.expressions.compiling import can_break, constant_of
from florence_bt.trees.language.model import Expression, Literal, Mission, Node, PolicyKind, Value
from florence_bt.trees.language.vocabulary import (
    FAILED,
    GUARD_FAILED,
    UNEXPECTED_SUCCESS,
    UNTIL_NOT_MET,
)

OWN_CODES = {
    "missing_key": "a key was read that nothing has written",
    "no_skill": "this robot lacks the skill",
    "bad_output": "the skill succeeded without giving what it promises",
}
"""Codes that the tree itself gives the use of a skill, beside those of the skill."""

COUNT = Port(Kind.INTEGER, "", minimum=1)
"""What ``retry`` and ``repeat`` take."""
PAUSE = Port(Kind.DURATION, "", minimum=0.0)
"""What ``wait`` and ``timeout`` take."""


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
        """Whether it can fail."""
        return bool(self.codes)

    @property
    def ends(self) -> bool:
        """Whether it can end in any way but by being stopped."""
        return self.can_succeed or self.can_fail


SUCCEEDS = NodeOutcomes(True, frozenset())
NO_CODES = frozenset[str]()
_WHATEVER_A_VALUE_DOES = frozenset({"missing_key", "bad_input"})


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
        self._declared = mission.keys
        self._declarations = declarations
        self._groups = groups_of(declarations)
        self._called = called
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
        outcomes = self._bare(node, skip_fails)
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

    def _bare(self, node: Node, skip_fails: bool) -> NodeOutcomes:
        if type(node).outcomes is not Node.outcomes:
            return node.outcomes(self, skip_fails)
        match node:
            case model.Sequence(children=children):
                parts = [self.of(child, skip_fails=False) for child in children]
                reached = _up_to(parts, lambda part: not part.can_succeed)
                return NodeOutcomes(all(part.can_succeed for part in parts), _codes(reached))
            case model.Selector(children=children):
                parts = [self.of(child, skip_fails=True) for child in children]
                return _selector(parts)
            case model.Parallel():
                return _parallel(node, [self.of(child, skip_fails=False) for child in node.children])
            case model.If():
                return self._if(node, skip_fails)
            case model.Switch():
                return self._switch(node, skip_fails)
            case model.WaitUntil(goal=goal):
                asked = self.of(goal, skip_fails=True)
                return NodeOutcomes(asked.can_succeed, asked.codes & LASTING_CODES)
            case model.Wrapper(child=child):
                below = self.of(child, skip_fails=node.skip_fails_below(skip_fails))
                outcomes = self._wrapper(node, below, skip_fails)
                return skipped_with(below, outcomes, skip_fails) if node.skipped_with_child else outcomes
        return self._leaf(node)

    def _if(self, node: model.If, skip_fails: bool) -> NodeOutcomes:
        then = self.of(node.then, skip_fails=skip_fails)
        other = self.of(node.otherwise, skip_fails=skip_fails) if node.otherwise is not None else SUCCEEDS
        if isinstance(node.condition, Expression):
            fixed, codes = constant_of(node.condition), self.of_expression(node.condition)
        else:
            asked, codes = self.of(node.condition, skip_fails=True), NO_CODES
            fixed = None if asked.can_succeed and asked.can_fail else asked.can_succeed
        ways = [then, other] if fixed is None else [then if fixed else other]
        skips = any(way.can_skip for way in ways)
        return NodeOutcomes(any(way.can_succeed for way in ways), _codes(ways) | codes, can_skip=skips)

    def _switch(self, node: model.Switch, skip_fails: bool) -> NodeOutcomes:
        ways = [self.of(part, skip_fails=skip_fails) for part in node.parts]
        codes = _codes(ways) | self.of_value(node.value)
        if node.default is None:
            codes |= {"no_case"}
        skips = any(way.can_skip for way in ways)
        return NodeOutcomes(any(way.can_succeed for way in ways), codes, can_skip=skips)

    def _wrapper(self, node: model.Wrapper, child: NodeOutcomes, skip_fails: bool) -> NodeOutcomes:
        match node:
            case model.Succeed():
                return NodeOutcomes(child.can_succeed or child.can_fail, NO_CODES)
            case model.Invert():
                own = frozenset({node.own_failure(UNEXPECTED_SUCCESS)})
                return NodeOutcomes(child.can_fail, own if child.can_succeed else NO_CODES)
            case model.Timeout(duration=value):
                codes = child.codes | self.of_value(value, PAUSE) | {"timed_out"}
                return NodeOutcomes(child.can_succeed, codes)
            case model.Repeat(rounds=None):
                return NodeOutcomes(False, child.codes)
            case model.OnFailure():
                return self._on_failure(node, child)
            case model.Until(goal=goal):
                ends = self.of(goal, skip_fails=True)
                codes = child.codes | (ends.codes & LASTING_CODES)
                codes |= {node.own_failure(UNTIL_NOT_MET)} if child.can_succeed else NO_CODES
                return NodeOutcomes(ends.can_succeed, codes)
            case model.Interruptible(goal=goal, interruption=interruption):
                asked = self.of(goal, skip_fails=True).codes & LASTING_CODES
                done = self.of(interruption, skip_fails=False)
                return NodeOutcomes(child.can_succeed, child.codes | asked | done.codes)
            case model.Repeat(rounds=value):
                assert value is not None  # that was a case above
                return NodeOutcomes(child.can_succeed, child.codes | self.of_value(value, COUNT))
        return child

    def _on_failure(self, node: model.OnFailure, child: NodeOutcomes) -> NodeOutcomes:
        handlers = [(code.text, self.of(each, skip_fails=True)) for code, each in node.handlers]
        caught = by_code(handlers, self._groups)
        ways = [caught.get(code, caught.get(ANY)) for code in child.codes]
        # A handler that is skipped leaves the failure as it was.
        left = {code for code, way in zip(child.codes, ways, strict=True) if way is None or way.can_skip}
        done = [way for way in ways if way is not None]
        can_succeed = child.can_succeed or any(way.can_succeed for way in done)
        return NodeOutcomes(can_succeed, _codes(done) | left)

    def _leaf(self, node: Node) -> NodeOutcomes:
        match node:
            case model.Fail(reason=reason):
                return NodeOutcomes(False, self.of_value(reason) | {node.own_failure(FAILED)})
            case model.Wait(duration=duration):
                return NodeOutcomes(True, self.of_value(duration, PAUSE))
            case model.Append(values=values):
                return NodeOutcomes(True, self._of_append(values))
            case model.Set(values=values):
                return NodeOutcomes(
                    True, NO_CODES.union(*(self._of_write(key, value) for key, value in values))
                )
            case model.RunSkill(skill=skill):
                declaration = self._declarations.get(skill)
                declared = declaration.failures if declaration else ()
                given = [self.of_value(value) for _, value in node.inputs]
                return NodeOutcomes(True, frozenset({*declared, *COMMON_CODES, *OWN_CODES}).union(*given))
            case model.CallMission(mission=mission):
                below = self._called(mission.text) or SUCCEEDS
                given = [self.of_value(value) for _, value in node.inputs]
                codes = below.codes.union(*given, _WHATEVER_A_VALUE_DOES if node.inputs else ())
                return NodeOutcomes(below.can_succeed, codes | ({"bad_output"} if node.outputs else NO_CODES))
        return NodeOutcomes(True, NO_CODES)

    def _of_append(self, values: tuple[tuple[Literal, Value], ...]) -> frozenset[str]:
        missing = any(not self._always_there(key.text) for key, _ in values)
        codes = frozenset({"missing_key"}) if missing else NO_CODES
        return codes.union(*(self.of_value(value) for _, value in values))

    def _of_write(self, key: Literal, value: Value) -> frozenset[str]:
        checked = key.text in self._declared and not isinstance(value, Literal)
        return self.of_value(value) | ({"bad_output"} if checked else NO_CODES)

    def codes_named(self, words: Iterable[Literal]) -> frozenset[str]:
        """Return the codes that some codes and groups stand for."""
        return NO_CODES.union(*(codes_named(word.text, self._groups) for word in words))

    def of_value(self, value: Value, port: Port | None = None) -> frozenset[str]:
        """Return the codes with which reading a value can fail; ``port`` is what the node demands of it."""
        if isinstance(value, Literal):
            return NO_CODES
        codes = self.of_expression(value) if isinstance(value, Expression) else NO_CODES
        if any(not self._always_there(reference.key) for reference in model.references(value)):
            codes |= {"missing_key"}
        if port is not None and not self._within(value, port):
            codes |= {"bad_input"}
        return codes

    def of_expression(self, expression: Expression) -> frozenset[str]:
        """Return the codes with which an expression can fail."""
        missing = any(not self._always_there(key) for key in expression.keys)
        return frozenset(
            (["missing_key"] if missing else []) + (["bad_expression"] if can_break(expression) else [])
        )

    def _always_there(self, key: str) -> bool:
        return key in self._inputs or (key in self._declared and not self._declared[key].required)

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


def _codes(outcomes: Iterable[NodeOutcomes]) -> frozenset[str]:
    return NO_CODES.union(*(each.codes for each in outcomes))


def _up_to(parts: list[NodeOutcomes], is_last: Callable[[NodeOutcomes], bool]) -> list[NodeOutcomes]:
    """Return the parts that are reached: those up to the first after which nothing follows."""
    last = next((number for number, part in enumerate(parts) if is_last(part)), len(parts))
    return parts[: last + 1]


def _selector(parts: list[NodeOutcomes]) -> NodeOutcomes:
    can_succeed = any(part.can_succeed for part in _up_to(parts, lambda part: not part.can_fail))
    if not parts or not all(part.can_fail for part in parts):
        return NodeOutcomes(can_succeed, NO_CODES)
    # It fails as the last one did; one that was skipped may leave the word to those before it.
    return NodeOutcomes(can_succeed, _codes(parts) if "skipped" in parts[-1].codes else parts[-1].codes)


def _parallel(node: model.Parallel, parts: list[NodeOutcomes]) -> NodeOutcomes:
    policy, count = node.policy, len(parts)
    can_succeed = sum(part.can_succeed for part in parts)
    can_fail = sum(part.can_fail for part in parts)
    if policy.kind is PolicyKind.SELECTED:
        selected = set(node.selected)
        wanted = [part for child, part in zip(node.children, parts, strict=True) if child in selected]
        return NodeOutcomes(all(part.can_succeed for part in wanted), _codes(parts))
    needed = min(policy.successes_needed(count), count)  # what cannot be is found elsewhere
    too_many = count - needed + 1
    if policy.kind is PolicyKind.COUNTED and policy.fail is not None:
        too_many = min(too_many, policy.fail)
    return NodeOutcomes(can_succeed >= needed, _codes(parts) if can_fail >= too_many else NO_CODES)
