"""From the syntax tree of an expression to what a behaviour tree evaluates; and what is constant in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from florence_bt.behaviours.expressions import CompiledExpression, Evaluate, junction, operation, pose_part
from florence_bt.behaviours.keys import KeyReference, KeyStore, ValueProblem
from florence_bt.core.declaration import Kind
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.quantities import format_value


def compile_expression(
    expression: syntax.Expression, kinds: Mapping[str, Kind | None] | None = None
) -> CompiledExpression:
    """Make an expression ready to be computed.

    Args:
        expression: The expression.
        kinds: The kinds of the keys, as far as they are known: they say how values are shown in reasons.
    """
    kinds = kinds or {}
    known = {key: kind for key in expression.keys if (kind := kinds.get(key)) is not None}
    terms = {syntax.print_term(term): term for term in _measured(expression.term)}
    for text, term in terms.items():
        kind = check_kinds(syntax.Expression(text, term, syntax.start_of(term)), kinds).kind
        if kind is not None:
            known[text] = kind
    return CompiledExpression(
        expression.text,
        _compiled(expression.term),
        expression.keys,
        {text: partial(format_value, kind=kind) for text, kind in known.items()},
        {text: _compiled(term) for text, term in terms.items()},
    )


_COMPARISONS = frozenset(("==", "!=", "<", "<=", ">", ">="))


def _measured(term: syntax.Term) -> Iterator[syntax.Term]:
    """Yield what is computed from keys and compared with something."""
    if not isinstance(term, syntax.Binary) or term.operator not in _COMPARISONS:
        for part in syntax.parts_of(term):
            yield from _measured(part)
        return
    for side in syntax.parts_of(term):
        if not isinstance(side, syntax.Key | syntax.Constant) and any(syntax.keys_of(side)):
            yield side


def _compiled(term: syntax.Term) -> Evaluate:
    match term:
        case syntax.Constant(value=value):
            return lambda keys: value
        case syntax.Key(key=key):
            return KeyReference(key).resolve
        case syntax.PosePart(pose=pose, part=part):
            return pose_part(_compiled(pose), part)
        case syntax.Item(items=items, index=index):
            return operation("item", _compiled(items), _compiled(index))
        case syntax.Listed(items=listed):
            return operation("list", *map(_compiled, listed))
        case syntax.Unary(operator=sign, operand=operand):
            return operation("not" if sign == "not" else "negate", _compiled(operand))
        case syntax.Binary(operator=("and" | "or") as word, left=left, right=right):
            return junction(word == "or", _compiled(left), _compiled(right))
        case syntax.Binary(operator=sign, left=left, right=right):
            return operation(sign, _compiled(left), _compiled(right))
        case syntax.Function(name=name, arguments=arguments):
            return operation(name, *(_compiled(argument) for argument in arguments))


_ARITHMETIC = frozenset("+-*/")


def constant_of(expression: syntax.Expression | None) -> bool | None:
    """Tell whether a condition always holds (True) or never does (False); None when that depends on keys."""
    if expression is None:
        return None
    try:
        value = compile_expression(expression).resolve(KeyStore())
    except ValueProblem:
        # It needs a key, or has no value: the first is as it should be, the second is found elsewhere.
        return None
    if not isinstance(value, bool) or check_kinds(expression, {}).problems:
        return None
    return value


def can_break(expression: syntax.Expression) -> bool:
    """Tell whether the evaluation of an expression can fail: a division by zero, an infinite number."""
    return any(
        (isinstance(part, syntax.Function) and part.name != "count")
        or isinstance(part, syntax.Item)
        or (isinstance(part, syntax.Binary) and part.operator in _ARITHMETIC)
        for part in syntax.walk(expression.term)
    )
