"""Syntax trees back to text, with no more parentheses than are needed. Parsing it gives the tree again."""

from __future__ import annotations

from florence_bt.core.declaration import Kind
from florence_bt.trees.language.expressions.syntax import (
    Binary,
    Constant,
    Function,
    Key,
    PosePart,
    Term,
    Unary,
)

_LOOSENESS = {"or": 1, "and": 2, "not": 3, "+": 5, "-": 5, "*": 6, "/": 6}
_COMPARISON = 4
_MINUS = 7
_TIGHT = 8


def print_term(term: Term) -> str:
    """A term as an author would write it.

    Args:
        term: Any part of an expression.

    Returns:
        The text; constants stand as they were written.
    """
    return _print(term)[0]


def _print(term: Term) -> tuple[str, int]:
    """The text of a term and how tightly it holds together."""
    match term:
        case Constant(kind=Kind.TEXT, text=text):
            return (f"'{text}'" if '"' in text else f'"{text}"'), _TIGHT
        case Constant(text=text):
            return text, _TIGHT
        case Key(key=key):
            return f"${key}", _TIGHT
        case PosePart(pose=pose, part=part):
            return f"{_at_least(pose, _TIGHT)}.{part}", _TIGHT
        case Unary(operator="not", operand=operand):
            return f"not {_at_least(operand, _LOOSENESS['not'])}", _LOOSENESS["not"]
        case Unary(operand=operand):
            return f"-{_at_least(operand, _MINUS)}", _MINUS
        case Function(name=name, arguments=arguments):
            return f"{name}({', '.join(print_term(argument) for argument in arguments)})", _TIGHT
        case Binary(operator=operator, left=left, right=right):
            own = _LOOSENESS.get(operator, _COMPARISON)
            # Chains lean to the left; comparisons make no chains.
            loosest_left = own + 1 if own == _COMPARISON else own
            return f"{_at_least(left, loosest_left)} {operator} {_at_least(right, own + 1)}", own


def _at_least(term: Term, tightness: int) -> str:
    text, own = _print(term)
    return text if own >= tightness else f"({text})"
