"""Numbers that an expression can give, as far as the limits of a mission's inputs say."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from florence_bt.core.declaration import Port
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.expressions.checking import KindProblem

Range = tuple[float, float]
"""The smallest and the largest number."""

_COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")


def zero_divisors(expression: syntax.Expression, inputs: Mapping[str, Port]) -> Iterator[KindProblem]:
    """Yield where an expression divides by zero with a value that the inputs of the mission may have.

    A key that the expression compares with something is taken to be looked after there.

    Args:
        expression: The expression, whose kinds are right.
        inputs: The inputs of the mission, which nothing in it writes.
    """
    looked_after = {
        key.key
        for term in syntax.walk(expression.term)
        if isinstance(term, syntax.Binary) and term.operator in _COMPARISONS
        for key in syntax.walk(term)
        if isinstance(key, syntax.Key)
    }
    for term in syntax.walk(expression.term):
        if not isinstance(term, syntax.Binary) or term.operator != "/":
            continue
        keys = [part.key for part in syntax.walk(term.right) if isinstance(part, syntax.Key)]
        found = _range_of(term.right, inputs)
        if keys and found is not None and found[0] <= 0.0 <= found[1] and not looked_after & {*keys}:
            divisor = syntax.print_term(term.right)
            message = f"{divisor} can be 0, and nothing can be divided by it"
            yield KindProblem(
                syntax.start_of(term.right), message, (f"limits of ${keys[0]} that leave 0 out",)
            )


def _range_of(term: syntax.Term, inputs: Mapping[str, Port]) -> Range | None:
    """Return the range of a term; None when it is not known."""
    match term:
        case syntax.Constant(value=int() | float() as value):
            return value, value
        case syntax.Key(key=key) if key in inputs:
            low, high = inputs[key].minimum, inputs[key].maximum
            return -math.inf if low is None else low, math.inf if high is None else high
        case syntax.Unary(operator="-", operand=operand):
            found = _range_of(operand, inputs)
            return (-found[1], -found[0]) if found is not None else None
        case syntax.Binary(operator="+" | "-" | "*" as operator, left=left, right=right):
            first, second = _range_of(left, inputs), _range_of(right, inputs)
            return _joined(operator, first, second) if first is not None and second is not None else None
    return None


def _joined(operator: str, left: Range, right: Range) -> Range:
    if operator == "+":
        return left[0] + right[0], left[1] + right[1]
    if operator == "-":
        return left[0] - right[1], left[1] - right[0]
    corners = [0.0 if 0.0 in (one, other) else one * other for one in left for other in right]
    return min(corners), max(corners)
