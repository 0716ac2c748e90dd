"""From the syntax tree of an expression to what a behaviour tree computes with."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from florence_bt.behaviours import expressions as values
from florence_bt.behaviours.expressions import Computable, Formula
from florence_bt.behaviours.keys import KeyReference
from florence_bt.core.declaration import Kind
from florence_bt.trees.language.expressions.syntax import (
    Binary,
    Constant,
    Expression,
    Function,
    Key,
    PosePart,
    Term,
    Unary,
)
from florence_bt.trees.language.quantities import format_value


def build_formula(expression: Expression, kinds: Mapping[str, Kind | None] | None = None) -> Formula:
    """Make an expression ready to be computed.

    Args:
        expression: The expression.
        kinds: The kinds of the keys, as far as they are known: they say how values are shown in reasons.
    """
    known = {key: kind for key in expression.keys if (kind := (kinds or {}).get(key)) is not None}
    shown = {key: partial(format_value, kind=kind) for key, kind in known.items()}
    return Formula(expression.text, _built(expression.term), expression.keys, shown)


def _built(term: Term) -> Computable:
    match term:
        case Constant(value=value):
            return values.Constant(value)
        case Key(key=key):
            return KeyReference(key)
        case PosePart(pose=pose, part=part):
            return values.PosePart(_built(pose), part)
        case Unary(operator="not", operand=operand):
            return values.Operation("not", values.invert, (_built(operand),))
        case Unary(operand=operand):
            return values.Operation("-", values.negate, (_built(operand),))
        case Binary(operator=("and" | "or") as operator, left=left, right=right):
            return values.Junction(operator == "or", _built(left), _built(right))
        case Binary(operator=operator, left=left, right=right):
            return values.Operation(operator, values.OPERATORS[operator], (_built(left), _built(right)))
        case Function(name=name, arguments=arguments):
            return values.Operation(name, values.OPERATORS[name], tuple(_built(a) for a in arguments))
