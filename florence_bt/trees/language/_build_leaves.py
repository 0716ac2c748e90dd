"""Leaves of a mission to behaviours, and the values that nodes are given."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property, partial
from typing import Any

from py_trees.behaviour import Behaviour

from florence_bt.behaviours.conditions import Condition
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.expressions import Formula
from florence_bt.behaviours.keys import is_source, readable
from florence_bt.behaviours.leaves import Fail, SetKey
from florence_bt.behaviours.pacing import Wait
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.titles import Title, give_title
from florence_bt.behaviours.watched_skill import EVERY_S, WatchedSkill
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.trees.language import model
from florence_bt.trees.language._facts import Facts, kind_of
from florence_bt.trees.language.expressions.building import build_formula
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.kinds import FAILED
from florence_bt.trees.language.model import (
    Expression,
    Literal,
    Mission,
    Node,
    Value,
    references,
    show,
    values_of,
)
from florence_bt.trees.language.quantities import format_value, guess_value
from florence_bt.trees.language.source import Position
from florence_bt.trees.language.values import literal_value, port_value, tree_value
from florence_bt.trees.language.watching import is_condition


class LeafBuilder:
    """Builds the leaves of one call of one mission.

    Args:
        mission: The mission.
        facts: What is known of all missions and skills.
        context: The context with the keys of this call.
        callers: The names of the missions from the outermost to this one.
    """

    def __init__(
        self, mission: Mission, facts: Facts, context: TreeContext, callers: tuple[str, ...]
    ) -> None:
        self.mission = mission
        self.facts = facts
        self.context = context
        self.callers = callers
        self.watched: list[WatchedSkill] | None = None
        """The skills that the composite without memory above watches so far; None: nobody watches here."""

    def leaf(self, node: Node, name: str) -> Behaviour:
        """Build a node with nothing below it."""
        context = self.context
        match node:
            case model.Condition(condition=condition):
                return Condition(name, context, self.condition(condition))
            case model.Fail(reason=reason, code=code):
                kind = None if isinstance(reason, Expression) else Kind.TEXT
                return Fail(name, context, self.value(reason, kind), code.text if code else FAILED)
            case model.Wait(duration=duration):
                seconds = self.value(duration, Kind.DURATION)
                return self.titled(node, Wait(name, context, seconds), seconds, Kind.DURATION)
            case model.Set(values=values):
                return SetKey(name, context, {key.text: self._set_value(key, value) for key, value in values})
            case model.Use():
                return self._use(node, name)
            case _:
                raise TypeError(f"no behaviour is known for {type(node).__name__}")

    def _set_value(self, key: Literal, value: Value) -> Any:
        port = self.mission.keys.get(key.text)
        return self.value(value, port.kind if port is not None else None)

    def _use(self, node: model.Use, name: str) -> Behaviour:
        declaration = self.context.declarations.get(node.skill)
        if declaration is None:
            known = closest_first(node.skill, self.context.declarations)
            raise self.error(node.position, f"unknown skill {node.skill!r}", known)
        inputs = self.inputs(node.inputs, declaration.inputs, f"{node.skill} has no input")
        outputs = targets(node.outputs)
        if self.watched is None or not is_condition(node, declaration):
            return RunSkill(name, self.context, node.skill, inputs, outputs)
        keys = {each.key for value in values_of(node) for each in references(value)}
        every = EVERY_S if node.every is None else node.every
        skill = WatchedSkill(name, self.context, node.skill, inputs, outputs, keys=keys, every=every)
        self.watched.append(skill)
        return skill

    def titled(self, node: Node, behaviour: Behaviour, value: Any, kind: Kind | None) -> Behaviour:
        """Let a dump show the value that stands in a title as ``$key``, once it is known."""
        if node.name is None and is_source(value):
            shown = partial(format_value, kind=kind) if kind is not None else readable
            written = show(next(values_of(node))).replace("/", "\N{DIVISION SLASH}")
            give_title(behaviour, Title(written, value, self.context.keys, shown))
        return behaviour

    # ---- values ---------------------------------------------------------------------------------------

    @cached_property
    def kinds(self) -> Mapping[str, Kind]:
        """The kinds of the mission's keys, as far as they are known."""
        return self.facts.key_kinds(self.mission)

    def condition(self, expression: Expression) -> Formula:
        """An expression that is true or false.

        Raises:
            ConfigError: It is something else, or cannot be computed.
        """
        for problem in check_kinds(expression, self.kinds, Kind.BOOLEAN).problems:
            raise self.error(problem.position, problem.message, problem.valid)
        return build_formula(expression, self.kinds)

    def value(self, value: Value, kind: Kind | None) -> Any:
        """A value in SI units, or a value source.

        Raises:
            ConfigError: It is of another kind.
        """
        return self._placed(value, partial(tree_value, kind=kind, kinds=self._kinds_for(value)))

    def inputs(
        self, pairs: Iterable[tuple[Literal, Value]], ports: Mapping[str, Port], problem: str
    ) -> dict[str, Any]:
        """The inputs of a skill or a mission, as given.

        Raises:
            ConfigError: One is unknown, of another kind or out of range.
        """
        inputs = {}
        for name, value in pairs:
            port = ports.get(name.text)
            if port is None:
                raise self.error(name.position, f"{problem} {name.text!r}", closest_first(name.text, ports))
            read = partial(port_value, port=port, kinds=self._kinds_for(value))
            inputs[name.text] = self._placed(value, read)
        return inputs

    def case_values(self, literal: Literal, value: Value) -> tuple[Any, ...]:
        """What a value can be when a case fits; more than one when its kind is not known."""
        kind = kind_of(value, self.kinds)
        if literal.quoted or kind is Kind.TEXT:
            return (literal.text,)
        if kind is not None:
            return (self._placed(literal, lambda _: literal_value(literal, kind)),)
        guessed = guess_value(literal.text)[1]
        return (guessed,) if guessed == literal.text else (guessed, literal.text)

    def _kinds_for(self, value: Value) -> Mapping[str, Kind]:
        """Only expressions need to know kinds, and these take a walk through the mission to find."""
        parts = (value.x, value.y, value.yaw) if isinstance(value, model.PoseParts) else (value,)
        return self.kinds if any(isinstance(part, Expression) for part in parts) else {}

    def _placed(self, value: Value, read: Callable[[Value], Any]) -> Any:
        try:
            return read(value)
        except ConfigError as error:
            inside = Position(error.line, error.column or 1) if error.line else value.position
            raise self.error(inside, error.problem, error.valid) from error

    def error(self, position: Position | None, problem: str, valid: Iterable[str] = ()) -> ConfigError:
        """An error at a place in the mission's file."""
        line, column = (position.line, position.column) if position is not None else (None, None)
        return ConfigError(problem, file=self.mission.file, line=line, column=column, valid=valid)


def targets(pairs: Iterable[tuple[Literal, Literal]]) -> dict[str, str]:
    """``out``: output -> key."""
    return {output.text: key.text for output, key in pairs}


def declared_keys(mission: Mission) -> dict[str, Port]:
    """What the declared keys of a mission hold; outputs and inputs are keys too, without limits."""
    ends = {name: Port(port.kind, port.description) for name, port in mission.outputs.items()}
    starts = {name: Port(port.kind, port.description) for name, port in mission.inputs.items()}
    return {**ends, **starts, **mission.keys}
