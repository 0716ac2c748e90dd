"""A checked mission to a tree of behaviours."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy
from py_trees.composites import Parallel, Sequence

from florence_bt.behaviours.composites import Finally, Selector
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.decorators import CallMission, ForceSuccess, Invert
from florence_bt.behaviours.keys import KeyStore
from florence_bt.behaviours.leaves import Fail, SetKey
from florence_bt.behaviours.pacing import Repeat, Retry, Timeout, Wait
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.why import Because, give_reason
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.trees import model
from florence_bt.trees.findings import ERROR
from florence_bt.trees.kinds import FAILED
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.model import Literal, Mission, Node, Value
from florence_bt.trees.source import Position
from florence_bt.trees.values import port_value, template_of, tree_value


@dataclass(frozen=True)
class CompiledTree:
    """A mission that can be ticked.

    Attributes:
        root: The root of the tree.
        mission: What it was built from.
        keys: The keys of the mission.
    """

    root: Behaviour
    mission: Mission
    keys: KeyStore

    def outputs(self) -> dict[str, Any]:
        """The outputs that have been written so far, in SI units."""
        return {name: self.keys.read(name) for name in self.mission.outputs if name in self.keys}


def compile_mission(
    mission: Mission, library: MissionLibrary, inputs: Mapping[str, Any], context: TreeContext
) -> CompiledTree:
    """Build the tree of a mission.

    Args:
        mission: The mission, checked (``lint.check``).
        library: Where called missions are found.
        inputs: Every input in SI units, as ``parse_inputs`` returns them.
        context: What the tree's nodes share; its keys are set to the inputs.

    Raises:
        ConfigError: The mission, or one that it calls, has an error that a check would have found.
    """
    context.keys.reset(inputs)
    builder = _Builder(mission, library, context, (mission.name,))
    return CompiledTree(builder.root(mission.name), mission, context.keys)


class _Builder:
    """Builds the nodes of one call of one mission.

    Args:
        mission: The mission.
        library: Where called missions are found.
        context: The context with the keys of this call.
        callers: The names of the missions from the outermost to this one.
    """

    def __init__(
        self, mission: Mission, library: MissionLibrary, context: TreeContext, callers: tuple[str, ...]
    ) -> None:
        self._mission = mission
        self._library = library
        self._context = context
        self._callers = callers

    def root(self, default_name: str | None = None) -> Behaviour:
        for finding in self._mission.findings:
            if finding.severity == ERROR:
                raise finding.as_error()
        if self._mission.tree is None:
            raise ConfigError("the mission has no tree", file=self._mission.file)
        tree = self._mission.tree
        return self.node(tree, tree.name or default_name)

    def node(self, node: Node, name: str | None = None) -> Behaviour:
        """Build a node with everything below it."""
        name = name or node.title
        if node.cleanup is None:
            behaviour = self._bare(node, name)
        else:
            behaviour = self._finally(node, node.cleanup, name)
        if node.reasons is not None:
            always = node.reasons.always
            give_reason(
                behaviour,
                Because(
                    self._context.keys,
                    template_of(always) if always is not None else None,
                    {code: template_of(text) for code, text in node.reasons.by_code.items()},
                ),
            )
        return behaviour

    def _finally(self, node: Node, cleanup: Node, name: str) -> Behaviour:
        def make_cleanup(context: TreeContext) -> Behaviour:
            builder = _Builder(
                self._mission, self._library, context.with_keys(self._context.keys), self._callers
            )
            return builder.node(cleanup)

        return Finally(name, self._context, self._bare(node, node.default_title), make_cleanup)

    def _bare(self, node: Node, name: str) -> Behaviour:
        context = self._context
        match node:
            case model.Sequence(children=children, memory=memory):
                return Sequence(name, memory, self._children(children))
            case model.Selector(children=children, memory=memory):
                return Selector(name, memory, self._children(children))
            case model.Parallel(children=children, any_is_enough=enough):
                policy = ParallelPolicy.SuccessOnOne() if enough else ParallelPolicy.SuccessOnAll()
                return Parallel(name, policy, self._children(children))
            case model.Retry(child=child, attempts=attempts, on=on, attempt_key=key):
                codes = [code.text for code in on]
                count = self._value(attempts, Kind.INTEGER)
                return Retry(name, self.node(child), context, count, codes, key.text if key else None)
            case model.Repeat(child=child, rounds=rounds):
                return Repeat(name, self.node(child), context, self._value(rounds, Kind.INTEGER))
            case model.Timeout(child=child, duration=duration):
                return Timeout(name, self.node(child), context, self._value(duration, Kind.DURATION))
            case model.Invert(child=child):
                return Invert(name, self.node(child))
            case model.Succeed(child=child):
                return ForceSuccess(name, self.node(child))
            case _:
                return self._leaf(node, name)

    def _leaf(self, node: Node, name: str) -> Behaviour:
        context = self._context
        match node:
            case model.Fail(reason=reason, code=code):
                return Fail(name, context, self._value(reason, Kind.TEXT), code.text if code else FAILED)
            case model.Wait(duration=duration):
                return Wait(name, context, self._value(duration, Kind.DURATION))
            case model.Set(values=values):
                return SetKey(name, context, {key.text: self._value(value, None) for key, value in values})
            case model.Use():
                return self._use(node, name)
            case model.Call():
                return self._call(node, name)
            case _:
                raise TypeError(f"no behaviour is known for {type(node).__name__}")

    def _children(self, nodes: tuple[Node, ...]) -> list[Behaviour]:
        """Build siblings; those with equal names are numbered, so that every path is unique."""
        seen: dict[str, int] = {}
        children = []
        for node in nodes:
            count = seen[node.title] = seen.get(node.title, 0) + 1
            children.append(self.node(node, node.title if count == 1 else f"{node.title} ({count})"))
        return children

    def _use(self, node: model.Use, name: str) -> Behaviour:
        declaration = self._context.declarations.get(node.skill)
        if declaration is None:
            known = closest_first(node.skill, self._context.declarations)
            raise self._error(node.position, f"unknown skill {node.skill!r}", known)
        inputs = self._inputs(node.inputs, declaration.inputs, f"{node.skill} has no input")
        return RunSkill(name, self._context, node.skill, inputs, _targets(node.outputs))

    def _call(self, node: model.Call, name: str) -> Behaviour:
        called = node.mission.text
        if called in self._callers:
            chain = " -> ".join((*self._callers, called))
            raise self._error(node.position, f"the mission {called!r} calls itself: {chain}", ())
        mission = self._library.get(called)
        keys = KeyStore()
        builder = _Builder(mission, self._library, self._context.with_keys(keys), (*self._callers, called))
        inputs = self._inputs(node.inputs, mission.inputs, f"{called} has no input")
        return CallMission(
            name, builder.root(), self._context, keys, mission.inputs, inputs, _targets(node.outputs)
        )

    def _inputs(
        self, pairs: Iterable[tuple[Literal, Value]], ports: Mapping[str, Port], problem: str
    ) -> dict[str, Any]:
        inputs = {}
        for name, value in pairs:
            port = ports.get(name.text)
            if port is None:
                raise self._error(name.position, f"{problem} {name.text!r}", closest_first(name.text, ports))
            inputs[name.text] = self._placed(value, partial(port_value, port=port))
        return inputs

    def _value(self, value: Value, kind: Kind | None) -> Any:
        return self._placed(value, partial(tree_value, kind=kind))

    def _placed(self, value: Value, read: Callable[[Value], Any]) -> Any:
        try:
            return read(value)
        except ConfigError as error:
            raise self._error(value.position, error.problem, error.valid) from error

    def _error(self, position: Position, problem: str, valid: Iterable[str]) -> ConfigError:
        return ConfigError(
            problem, file=self._mission.file, line=position.line, column=position.column, valid=valid
        )


def _targets(pairs: Iterable[tuple[Literal, Literal]]) -> dict[str, str]:
    return {output.text: key.text for output, key in pairs}
