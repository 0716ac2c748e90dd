"""Expressions over keys, ready to be computed: what ``if``, ``when``, ``while`` and ``${...}`` become.

Numbers are in SI units. Two numbers that differ by less than a billionth of their size count as equal, so
that 70 cm and 0.7 m are the same length; ``<=``, ``>=``, ``<`` and ``>`` follow. What has no value (such
as a division by zero) is an expected failure with the code ``bad_expression``.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from florence_bt.behaviours.keys import NOTHING, KeyStore, ValueProblem, readable
from florence_bt.core.geometry import Pose2

_RELATIVE = 1e-9
_ABSOLUTE = 1e-12
"""Numbers are equal within this part of the larger one, and within so much near zero: rounding, no more."""
MAX_INTEGER = 2**63 - 1
"""Whole numbers beyond this, either way, have no value."""


class BadExpression(ValueProblem):
    """An expression has no value."""

    code = "bad_expression"


class Unknown:
    """A value of which only is known how it came about: what operations give for it, it says itself.

    Missions that run have none. Whoever explores all that a mission may do derives from this and from the
    type of the value.
    """

    def operate(self, name: str, operands: Sequence[Any]) -> Any:
        """Return what one of :data:`OPERATORS` gives for operands of which this is one.

        Raises:
            ArithmeticError: It has no value.
        """
        raise NotImplementedError


Evaluate = Callable[[KeyStore], Any]
"""Gives the value of a part of an expression; raises ValueProblem where it has none."""


def pose_part(pose: Evaluate, part: str) -> Evaluate:
    """Return ``x``, ``y`` (metres) or ``yaw`` (radians) of a pose."""

    def evaluate(keys: KeyStore) -> Any:
        value = pose(keys)
        if isinstance(value, Unknown):
            return value.operate(part, [value])
        if not isinstance(value, Pose2):
            raise BadExpression(f"{readable(value)!r} is not a pose and has no {part}")
        return float(OPERATORS[part](value))

    return evaluate


def operation(name: str, *operands: Evaluate) -> Evaluate:
    """Compile one of :data:`OPERATORS`, on operands that are all evaluated first."""
    function = OPERATORS[name]

    def evaluate(keys: KeyStore) -> Any:
        values = [operand(keys) for operand in operands]
        try:
            for value in values:
                if isinstance(value, Unknown):
                    return value.operate(name, values)
            return function(*values)
        except ZeroDivisionError:
            raise BadExpression(f"{readable(values[0])} is divided by zero") from None
        except (TypeError, ArithmeticError, ValueError) as error:
            given = " and ".join(readable(value) for value in values)
            raise BadExpression(f"{name!r} has no value for {given}: {error}") from None

    return evaluate


def junction(decisive: bool, left: Evaluate, right: Evaluate) -> Evaluate:
    """Compile ``and`` and ``or``: the right side is evaluated only when the left does not decide.

    Args:
        decisive: The value of the left side that decides: True for ``or``, False for ``and``.
        left: The first side.
        right: The second side.
    """

    def evaluate(keys: KeyStore) -> bool:
        value = _truth(left(keys))
        return value if value is decisive else _truth(right(keys))

    return evaluate


@dataclass(frozen=True, slots=True)
class CompiledExpression:
    """A whole expression: a value source that knows what it reads and how it was written.

    Attributes:
        text: As the author wrote it.
        evaluate: Computes it.
        keys: The keys that it reads.
        shown: How the values of keys and what is measured are written for people, where kinds are known.
        measured: What is computed from keys and then compared, as written -> what computes it.
    """

    text: str
    evaluate: Evaluate
    keys: tuple[str, ...]
    shown: Mapping[str, Callable[[Any], str]] = field(default_factory=dict, compare=False)
    measured: Mapping[str, Evaluate] = field(default_factory=dict, compare=False)

    def resolve(self, keys: KeyStore) -> Any:
        """Return the value now.

        Raises:
            ValueProblem: A key has no value, or the expression has none; the message names the expression.
        """
        try:
            return self.evaluate(keys)
        except BadExpression as error:
            raise BadExpression(f"{self.text} has no value: {error}") from None

    def holds(self, keys: KeyStore) -> bool:
        """Tell whether the condition is true now.

        Raises:
            ValueProblem: As :meth:`resolve`, also when the value is neither true nor false.
        """
        value = self.resolve(keys)
        if not isinstance(value, bool):
            raise BadExpression(f"{self.text} is {readable(value)}, neither true nor false")
        return value

    def with_values(self, keys: KeyStore) -> str:
        """Return the keys' values for people, e.g. ``x is 5, room is kitchen``; empty without keys."""
        return self.text_of(keys.peek(self.keys))

    def text_of(self, values: Sequence[Any]) -> str:
        """Return the values of its keys for people, as they were when they were looked up."""
        return ", ".join(
            f"{key} is {self._show(key, value)}" for key, value in zip(self.keys, values, strict=True)
        )

    def denial(self, keys: KeyStore) -> str:
        """Write a sentence that says that the condition does not hold, with the values behind it.

        Of poses that something was measured between only that is told.
        """
        measured = [(text, _measure(evaluate, keys)) for text, evaluate in self.measured.items()]
        known = [*measured, *zip(self.keys, keys.peek(self.keys), strict=True)]
        values = ", ".join(
            f"{text} is {self._show(text, value)}"
            for text, value in known
            if not (measured and isinstance(value, Pose2))
        )
        return f"{self.text} does not hold{f' ({values})' if values else ''}"

    def _show(self, key: str, value: Any) -> str:
        return "not known" if value is NOTHING else self.shown.get(key, readable)(value)


def _measure(evaluate: Evaluate, keys: KeyStore) -> Any:
    try:
        return evaluate(keys)
    except ValueProblem:
        return NOTHING


# ---- operators ----------------------------------------------------------------------------------------


def invert(value: Any) -> bool:
    """Return True for false and false for true."""
    return not _truth(value)


def distance(start: Any, end: Any) -> float:
    """Return the metres between two poses, in a straight line."""
    if not isinstance(start, Pose2) or not isinstance(end, Pose2):
        raise TypeError("two poses are needed")
    return _finite(start.distance_to(end))


def bearing(start: Any, end: Any) -> float:
    """Return a robot's turn from one pose to look at another, radians in (-pi, pi], counter-clockwise."""
    if not isinstance(start, Pose2) or not isinstance(end, Pose2):
        raise TypeError("two poses are needed")
    return _finite(start.bearing_to(end.x, end.y))


def equal(left: Any, right: Any) -> bool:
    """Tell whether two values of one kind are the same, numbers up to a billionth."""
    for value in (left, right):
        if isinstance(value, Unknown):
            return bool(value.operate("==", (left, right)))
    if isinstance(left, (bool, str, Pose2, tuple)) or isinstance(right, (bool, str, Pose2, tuple)):
        if type(left) is not type(right):
            raise TypeError("two values of one kind are needed")
        return bool(left == right)
    return _same(_number(left), _number(right))


def item_of(items: Any, index: Any) -> Any:
    """Return an item of a list, counted from 0."""
    known = _items(items)
    if isinstance(index, bool) or not isinstance(index, int):
        raise TypeError("a whole number is needed")
    if not 0 <= index < len(known):
        raise ValueError(f"the list has {len(known)} items, counted from 0")
    return known[index]


def less(left: Any, right: Any) -> bool:
    """Tell whether a number is smaller than another, and not the same up to a billionth."""
    return _number(left) < _number(right) and not _same(left, right)


def at_most(left: Any, right: Any) -> bool:
    """Tell whether a number is smaller than another or the same."""
    return _number(left) <= _number(right) or _same(left, right)


def _numeric(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make an operator on numbers whose result must be a finite number."""

    def compute(*operands: Any) -> Any:
        return _finite(function(*(_number(operand) for operand in operands)))

    return compute


OPERATORS: dict[str, Callable[..., Any]] = {
    "+": _numeric(operator.add),
    "-": _numeric(operator.sub),
    "*": _numeric(operator.mul),
    "/": _numeric(operator.truediv),
    "negate": _numeric(operator.neg),
    "not": invert,
    "==": equal,
    "!=": lambda left, right: not equal(left, right),
    "<": less,
    "<=": at_most,
    ">": lambda left, right: less(right, left),
    ">=": lambda left, right: at_most(right, left),
    "abs": _numeric(abs),
    "min": _numeric(min),
    "max": _numeric(max),
    "count": lambda items: len(_items(items)),
    "in": lambda value, items: any(_is_item(value, item) for item in _items(items)),
    "item": item_of,
    "list": lambda *items: items,
    "distance": distance,
    "bearing": bearing,
    **{part: operator.attrgetter(part) for part in ("x", "y", "yaw")},
}
"""Operator, function or part of a pose -> what computes it."""


def _same(left: Any, right: Any) -> bool:
    if isinstance(left, int) and isinstance(right, int):
        return left == right
    return math.isclose(left, right, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)


def _items(value: Any) -> tuple[Any, ...]:
    if not isinstance(value, tuple):
        raise TypeError("a list is needed")
    return value


def _is_item(value: Any, item: Any) -> bool:
    try:
        return equal(value, item)
    except TypeError:  # values of two kinds
        return False


def _number(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError("numbers are needed")
    return value


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise BadExpression(f"{readable(value)} is neither true nor false")
    return value


def _finite(value: Any) -> Any:
    if isinstance(value, int) and abs(value) > MAX_INTEGER:
        raise OverflowError("the number is too large")
    if not math.isfinite(value):
        raise OverflowError("the number is too large")
    return value
