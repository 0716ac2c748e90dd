"""Expressions that always have the same value, and expressions that can be without one."""

from __future__ import annotations

from collections.abc import Iterator

from florence_bt.behaviours.keys import KeyStore, ValueProblem
from florence_bt.trees.language.expressions.building import build_formula
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.expressions.syntax import Binary, Expression, Function, Term, parts_of

_ARITHMETIC = frozenset("+-*/")


def constant_of(expression: Expression | None) -> bool | None:
    """Whether a condition always holds (True) or never does (False); None when that depends on keys."""
    if expression is None:
        return None
    try:
        value = build_formula(expression).resolve(KeyStore())
    except ValueProblem:
        return (
            None  # it needs a key, or has no value: the first is as it should be, the second found elsewhere
        )
    if not isinstance(value, bool) or check_kinds(expression, {}).problems:
        return None
    return value


def can_break(expression: Expression) -> bool:
    """Whether an expression can be without a value: a division by zero, a number without end."""
    return any(
        isinstance(part, Function) or (isinstance(part, Binary) and part.operator in _ARITHMETIC)
        for part in _walk(expression.term)
    )


def _walk(term: Term) -> Iterator[Term]:
    yield term
    for part in parts_of(term):
        yield from _walk(part)
