"""Values of a mission file to values of the tree: literals are read, references become value sources."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from florence_bt.behaviours.keys import (
    KeyReference,
    KeyStore,
    ListFromItems,
    PoseFromParts,
    TextTemplate,
    ValueInWords,
    ValueProblem,
    is_source,
    readable,
)
from florence_bt.core._flow_hints import quoted
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.plain_yaml import Position
from florence_bt.core.units import UNITS
from florence_bt.trees.language import quantities
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.expressions.compiling import compile_expression
from florence_bt.trees.language.expressions.parser import parse_expression
from florence_bt.trees.language.expressions.syntax import Constant, Key, Term
from florence_bt.trees.language.model import (
    Expression,
    ListItems,
    Literal,
    PoseParts,
    Reference,
    Template,
    Value,
    show,
)

_KEY_AND_UNIT = re.compile(r"(\$[a-z][a-z0-9_]*) ?([^\W\d]+(?:/[^\W\d]+)?|°)")
"""A key with the unit that it lacks behind it: ``$pause min``."""
Kinds = Mapping[str, Kind | None]
"""The kinds of keys, as far as they are known."""


def tree_value(value: Value, kind: Kind | None, kinds: Kinds | None = None) -> Any:
    """Return what a node of the tree is given for a value.

    Args:
        value: The value as written.
        kind: What it must be; None when anything that can be held by a key will do.
        kinds: The kinds of the keys, for expressions.

    Returns:
        A value in SI units, or a value source where keys are needed.

    Raises:
        ConfigError: The value is of another kind. Only an error in an expression has a line and column.
    """
    match value:
        case Reference(key=key):
            return KeyReference(key)
        case Literal():
            return literal_value(value, kind)
        case Template(parts=parts):
            if kind is not None and kind is not Kind.TEXT:
                problem = f"{quantities.with_article(kind)} cannot be text with keys in it"
                raise ConfigError(problem, valid=(*as_expression(value), *_written(kind)))
            return TextTemplate(tuple(p if isinstance(p, str) else KeyReference(p.key) for p in parts))
        case PoseParts():
            return _pose(value, kind, kinds)
        case ListItems():
            return _list(value, kind, kinds)
        case Expression():
            return _formula(value, kind, kinds)


def _pose(value: PoseParts, kind: Kind | None, kinds: Kinds | None) -> Any:
    if kind is not None and kind is not Kind.POSE:
        raise ConfigError(f"{quantities.with_article(kind)} is needed, not a pose", valid=_written(kind))
    parts = ((value.x, Kind.LENGTH), (value.y, Kind.LENGTH), (value.yaw, Kind.ANGLE))
    numbers = [tree_value(part, wanted, kinds) for part, wanted in parts]
    if all(isinstance(number, (int, float)) for number in numbers):
        return Pose2(*numbers)
    return PoseFromParts(*numbers)


def _list(value: ListItems, kind: Kind | None, kinds: Kinds | None) -> Any:
    if kind is not None and kind.item is None:
        meant = (quantities.example_of(kind),) if kind is Kind.POSE else _single(value, kind)
        raise ConfigError(f"{quantities.with_article(kind)} is needed, not a list", valid=meant)
    given = kind if kind is not None else kind_of(value, {})
    items = [_item(item, given.item if given is not None else None, kinds) for item in value.items]
    return ListFromItems(tuple(items)) if any(map(is_source, items)) else tuple(items)


def _single(value: ListItems, kind: Kind) -> tuple[str, ...]:
    """Suggest what was meant by a list where one value is needed."""
    items = [show(item) for item in value.items]
    if kind is Kind.TEXT and len(items) > 1:
        return (quoted(", ".join(items)),)
    return (items[0],) if len(items) == 1 else ("a single value",)


def _item(value: Value, kind: Kind | None, kinds: Kinds | None) -> Any:
    try:
        return tree_value(value, kind, kinds)
    except ConfigError as error:
        place = Position(error.line, error.column or 1) if error.line else value.position
        raise ConfigError(error.problem, line=place.line, column=place.column, valid=error.valid) from error


def _formula(value: Expression, kind: Kind | None, kinds: Kinds | None) -> Any:
    """Compile a formula; the value itself when it needs no keys."""
    for problem in check_kinds(value, kinds or {}, kind).problems:
        place = problem.position
        raise ConfigError(problem.message, line=place.line, column=place.column, valid=problem.valid)
    formula = compile_expression(value, kinds)
    if formula.keys:
        return formula
    try:
        return formula.resolve(KeyStore())
    except ValueProblem as error:
        raise ConfigError(str(error), line=value.position.line, column=value.position.column) from error


def port_value(value: Value, port: Port, kinds: Kinds | None = None) -> Any:
    """Convert as :func:`tree_value` does, and what needs no keys is held against the port's limits.

    Where any text will do, a number is given as people write it.

    Raises:
        ConfigError: The value is of another kind or outside the limits; placed as by :func:`tree_value`.
    """
    if isinstance(value, Reference | Expression) and is_said(kind_of(value, kinds or {}), port):
        return template_of(value, kinds)
    result = tree_value(value, port.kind, kinds)
    if isinstance(result, (int, float, str, tuple)) and not isinstance(result, bool):
        problem = quantities.out_of_range(result, port)
        if problem:
            raise ConfigError(problem, valid=quantities.range_of(port))
    return result


def is_said(kind: Kind | None, port: Port) -> bool:
    """Tell whether values of a kind can be given as texts: numbers, where no place is named."""
    return port.kind is Kind.TEXT and not port.names and kind in (*quantities.NUMERIC_KINDS, Kind.BOOLEAN)


def literal_value(literal: Literal, kind: Kind | None) -> Any:
    """Read a literal; a quoted one where no kind is asked for is a text."""
    if kind is None:
        return literal.text if literal.quoted else quantities.guess_value(literal.text)[1]
    return quantities.read_value(literal.text, kind)


def term_of(value: Value) -> Term | None:
    """Return a number, quantity, key or expression as a term of an expression; None for anything else."""
    match value:
        case Expression(term=term):
            return term
        case Reference(key=key):
            return Key(key, value.position)
        case Literal(text=text, quoted=False):
            kind, number = quantities.guess_value(text)
            return Constant(number, kind, text, value.position) if kind in quantities.NUMERIC_KINDS else None
    return None


def template_of(value: Value, kinds: Kinds | None = None) -> TextTemplate:
    """Make a template of a text with or without keys; an expression may be of any kind.

    Args:
        value: The value.
        kinds: The kinds of the keys: they say the unit of an expression.
    """
    if isinstance(value, Expression):
        source = tree_value(value, None, kinds)
        kind = kind_of(value, kinds or {})
        if not is_source(source):
            return TextTemplate((readable(source, kind),))
        return TextTemplate((ValueInWords(source, kind),))
    source = tree_value(value, Kind.TEXT, kinds)
    return source if isinstance(source, TextTemplate) else TextTemplate((source,))


def as_expression(value: Template) -> tuple[str, ...]:
    """Suggest the template in ``"${...}"``, when it is an expression that lacks them."""
    text = re.sub(r"([+-])\1$", r" \1 1", show(value))  # $n++ of other languages
    with_unit = _KEY_AND_UNIT.fullmatch(text)
    if with_unit is not None and any(with_unit[2] in units for units in UNITS.values()):
        return (quoted(f"${{{with_unit[1]} * 1 {with_unit[2]}}}"),)
    try:
        parse_expression(text)
    except ConfigError:
        return ()
    return (quoted(f"${{{text}}}"),)


def _written(kind: Kind) -> tuple[str, ...]:
    return (quantities.example_of(kind), "$key")


def kind_of(value: Value, kinds: Kinds) -> Kind | None:
    """Return the kind of a value where nothing says what it must be; None when it is not known.

    Args:
        value: The value.
        kinds: The kinds of inputs and keys that are known.
    """
    match value:
        case Literal(text=text, quoted=quoted):
            return Kind.TEXT if quoted else quantities.guess_value(text)[0]
        case Reference(key=key):
            return kinds.get(key)
        case Template():
            return Kind.TEXT
        case PoseParts():
            return Kind.POSE
        case ListItems(items=items):
            found = {kind_of(item, kinds) for item in items}
            kind = next(iter(found)) if len(found) == 1 else None
            return kind.list if kind is not None and kind.item is None else None
        case Expression():
            return check_kinds(value, kinds).kind


def fits(given: Kind | None, wanted: Kind | None) -> bool:
    """Tell whether a key of one kind can be given where another is wanted; what is not known fits."""
    return (
        given is None or wanted is None or given is wanted or (given, wanted) == (Kind.INTEGER, Kind.NUMBER)
    )


def literal_kind(literal: Literal, kind: Kind | None) -> object:
    """Return what tells a literal from another one: its value if it has one of the kind, else its text."""
    try:
        return tree_value(Literal(literal.text, literal.quoted, literal.position), kind)
    except ConfigError:
        return literal.text
