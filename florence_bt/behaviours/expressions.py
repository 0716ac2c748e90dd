"""Expressions over keys, ready to be computed: what ``if``, ``when``, ``while`` and ``${...}`` become.

Numbers are in SI units. Two numbers that differ by less than a billionth of their size count as equal, so
that 70 cm and 0.7 m are the same length; ``<=``, ``>=``, ``<`` and ``>`` follow. What has no value (such
as a division by zero) is an expected failure with the code ``bad_expression``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from florence_bt.behaviours.keys import KeyStore, ValueProblem, readable
from florence_bt.core.geometry import Pose2

_RELATIVE = 1e-9
_ABSOLUTE = 1e-12
MAX_INTEGER = 2**63 - 1
"""Whole numbers beyond this, either way, have no value."""


class BadExpression(ValueProblem):
    """An expression has no value."""

    code = "bad_expression"


class Computable(Protocol):
    """A part of an expression."""

    def resolve(self, keys: KeyStore) -> Any:
        """Its value now.

        Raises:
            ValueProblem: It needs a key that has no value, or cannot be computed.
        """


@dataclass(frozen=True, slots=True)
class Constant:
    """A value that is written out.

    Attributes:
        value: The value in SI units.
    """

    value: Any

    def resolve(self, keys: KeyStore) -> Any:
        """The value."""
        return self.value


@dataclass(frozen=True, slots=True)
class PosePart:
    """A number of a pose.

    Attributes:
        pose: The pose.
        part: ``x``, ``y`` or ``yaw``.
    """

    pose: Computable
    part: str

    def resolve(self, keys: KeyStore) -> float:
        """Metres or radians."""
        pose = self.pose.resolve(keys)
        if not isinstance(pose, Pose2):
            raise BadExpression(f"{readable(pose)!r} is no pose and has no {self.part}")
        return float(getattr(pose, self.part))


@dataclass(frozen=True, slots=True)
class Operation:
    """A function of values that are all computed first: sums, comparisons, ``not``, ``min``.

    Attributes:
        name: The operator or the function, for messages.
        function: Computes it; raises TypeError, ArithmeticError or ValueError when there is no value.
        operands: What it is given.
    """

    name: str
    function: Callable[..., Any]
    operands: tuple[Computable, ...]

    def resolve(self, keys: KeyStore) -> Any:
        """The value now."""
        values = [operand.resolve(keys) for operand in self.operands]
        try:
            return self.function(*values)
        except ZeroDivisionError:
            raise BadExpression(f"{readable(values[0])} is divided by zero") from None
        except (TypeError, ArithmeticError, ValueError) as error:
            given = " and ".join(readable(value) for value in values)
            raise BadExpression(f"{self.name!r} has no value for {given}: {error}") from None


@dataclass(frozen=True, slots=True)
class Junction:
    """``and`` and ``or``: the right side is looked at only when the left does not decide.

    Attributes:
        decisive: The value of the left side that decides: True for ``or``, False for ``and``.
        left: The first side.
        right: The second side.
    """

    decisive: bool
    left: Computable
    right: Computable

    def resolve(self, keys: KeyStore) -> bool:
        """True or false."""
        left = _truth(self.left.resolve(keys))
        return left if left is self.decisive else _truth(self.right.resolve(keys))


@dataclass(frozen=True, slots=True)
class Formula:
    """A whole expression: a value source that knows what it reads and how it was written.

    Attributes:
        text: As the author wrote it.
        term: What is computed.
        keys: The keys that it reads.
        shown: How the values of keys are written for people, where their kinds are known.
    """

    text: str
    term: Computable
    keys: tuple[str, ...]
    shown: Mapping[str, Callable[[Any], str]] = field(default_factory=dict, compare=False)

    def resolve(self, keys: KeyStore) -> Any:
        """The value now.

        Raises:
            ValueProblem: A key has no value, or the expression has none; the message names the expression.
        """
        try:
            return self.term.resolve(keys)
        except BadExpression as error:
            raise BadExpression(f"{self.text} has no value: {error}") from None

    def holds(self, keys: KeyStore) -> bool:
        """Whether the condition is true now.

        Raises:
            ValueProblem: As :meth:`resolve`, also when the value is neither true nor false.
        """
        value = self.resolve(keys)
        if not isinstance(value, bool):
            raise BadExpression(f"{self.text} is {readable(value)}, neither true nor false")
        return value

    def with_values(self, keys: KeyStore) -> str:
        """The values of its keys for people, such as ``x is 5, room is kitchen``; empty without keys."""
        return ", ".join(f"{key} is {self._show(key, keys)}" for key in self.keys)

    def denial(self, keys: KeyStore, *, wanted: bool = True) -> str:
        """A sentence that says that the condition is not as wanted, with the values behind it."""
        values = self.with_values(keys)
        verb = "does not hold" if wanted else "holds"
        return f"{self.text} {verb}{f' ({values})' if values else ''}"

    def _show(self, key: str, keys: KeyStore) -> str:
        if key not in keys:
            return "not known"
        return self.shown.get(key, readable)(keys.read(key))


# ---- operators ----------------------------------------------------------------------------------------


def add(left: Any, right: Any) -> Any:
    """The sum of two numbers."""
    return _finite(_number(left) + _number(right))


def subtract(left: Any, right: Any) -> Any:
    """The difference of two numbers."""
    return _finite(_number(left) - _number(right))


def multiply(left: Any, right: Any) -> Any:
    """The product of two numbers."""
    return _finite(_number(left) * _number(right))


def divide(left: Any, right: Any) -> Any:
    """The quotient of two numbers, never a whole-number division."""
    return _finite(_number(left) / _number(right))


def negate(value: Any) -> Any:
    """A number with the other sign."""
    return -_number(value)


def invert(value: Any) -> bool:
    """True for false and false for true."""
    return not _truth(value)


def absolute(value: Any) -> Any:
    """A number without its sign."""
    return abs(_number(value))


def smaller(left: Any, right: Any) -> Any:
    """The smaller of two numbers."""
    return min(_number(left), _number(right))


def larger(left: Any, right: Any) -> Any:
    """The larger of two numbers."""
    return max(_number(left), _number(right))


def distance(start: Any, end: Any) -> float:
    """Metres between two poses, in a straight line."""
    if not isinstance(start, Pose2) or not isinstance(end, Pose2):
        raise TypeError("two poses are needed")
    return _finite(start.distance_to(end))


def equal(left: Any, right: Any) -> bool:
    """Whether two values of one kind are the same, numbers up to a billionth."""
    if isinstance(left, (bool, str, Pose2)) or isinstance(right, (bool, str, Pose2)):
        if type(left) is not type(right):
            raise TypeError("two values of one kind are needed")
        return bool(left == right)
    return _same(_number(left), _number(right))


def unequal(left: Any, right: Any) -> bool:
    """The opposite of :func:`equal`."""
    return not equal(left, right)


def less(left: Any, right: Any) -> bool:
    """Whether a number is smaller than another, and not the same up to a billionth."""
    return _number(left) < _number(right) and not _same(left, right)


def at_most(left: Any, right: Any) -> bool:
    """Whether a number is smaller than another or the same."""
    return _number(left) <= _number(right) or _same(left, right)


def greater(left: Any, right: Any) -> bool:
    """Whether a number is larger than another, and not the same up to a billionth."""
    return less(right, left)


def at_least(left: Any, right: Any) -> bool:
    """Whether a number is larger than another or the same."""
    return at_most(right, left)


OPERATORS: dict[str, Callable[..., Any]] = {
    "+": add,
    "-": subtract,
    "*": multiply,
    "/": divide,
    "==": equal,
    "!=": unequal,
    "<": less,
    "<=": at_most,
    ">": greater,
    ">=": at_least,
    "abs": absolute,
    "min": smaller,
    "max": larger,
    "distance": distance,
}
"""Operator with two operands, or function -> what computes it."""


def _same(left: Any, right: Any) -> bool:
    if isinstance(left, int) and isinstance(right, int):
        return left == right
    return math.isclose(left, right, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)


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
