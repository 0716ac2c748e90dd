"""Nodes with nothing below: skills, calls, and the small ones."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.trees.language.expressions.syntax import Expression
from florence_bt.trees.language.model.node import Node
from florence_bt.trees.language.model.values import Literal, Value, show


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition(Node):
    """``condition``: succeeds when an expression holds.

    Attributes:
        condition: The expression.
    """

    condition: Expression

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """The guards, and the condition."""
        return (*self.guards, self.condition)

    @property
    def default_title(self) -> str:
        """The expression itself, such as ``$distance < 1 m``."""
        return self.condition.text


@dataclass(frozen=True, slots=True, kw_only=True)
class Fail(Node):
    """``fail``: fails with a reason."""

    reason: Value
    code: Literal | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Wait(Node):
    """``wait``: a pause."""

    duration: Value

    @property
    def default_title(self) -> str:
        """Such as ``wait 1 s``."""
        return f"wait {show(self.duration)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Set(Node):
    """``set``: writes keys."""

    values: tuple[tuple[Literal, Value], ...]

    @property
    def default_title(self) -> str:
        """Such as ``set goal``."""
        return "set " + ", ".join(key.text for key, _ in self.values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Use(Node):
    """``skill_name``: runs a skill.

    Attributes:
        skill: The name that was written; whether there is such a skill is for the checks.
        inputs: Input names and values.
        outputs: Output names and the keys that receive them.
        table_given: Whether the inputs were written as a table, or nothing was.
        unread: Names of inputs whose values could not be read, which was noted there.
        written: What stands there in place of a table.
        every: How often it is asked again where it is watched as a condition, in seconds; None: not given.
    """

    skill: str
    inputs: tuple[tuple[Literal, Value], ...] = ()
    outputs: tuple[tuple[Literal, Literal], ...] = ()
    table_given: bool = True
    unread: tuple[str, ...] = ()
    written: str = ""
    every: float | None = None

    @property
    def default_title(self) -> str:
        """Such as ``navigate to``."""
        return self.skill.replace("_", " ")


@dataclass(frozen=True, slots=True, kw_only=True)
class Call(Node):
    """``run``: runs another mission with keys of its own.

    Attributes:
        mission: Its name.
        inputs: Input names and values.
        outputs: Output names and the keys that receive them.
        unread: Names of inputs whose values could not be read, which was noted there.
    """

    mission: Literal
    inputs: tuple[tuple[Literal, Value], ...] = ()
    outputs: tuple[tuple[Literal, Literal], ...] = ()
    unread: tuple[str, ...] = ()

    @property
    def default_title(self) -> str:
        """Such as ``run detect_user``."""
        return f"run {self.mission.text}"
