"""Between the scripts of BehaviorTree.CPP, whose numbers have no units, and our expressions."""

from __future__ import annotations

from typing import Protocol

from florence_bt.btcpp.script import Assignment, Binary, Choice, Code, Name, Number, Text, Truth, Unary
from florence_bt.btcpp.si_values import quantity_text, script_number, si_text
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.expressions.syntax import Term, print_term
from florence_bt.trees.language.quantities import UNITS

_HERE = Position()
_LOGICAL = {"&&": "and", "||": "or"}
_COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")
_ARITHMETIC = ("+", "-", "*", "/")
_PLAIN = (Kind.INTEGER, Kind.NUMBER)


class Scope(Protocol):
    """What is known about the names of a tree."""

    def key(self, foreign: str) -> str | None:
        """Our name of a key, None when the name is no key (an enumeration value)."""

    def kind(self, foreign: str) -> Kind | None:
        """The kind of a key, None when it is not known."""


def condition_text(code: Code, scope: Scope) -> str:
    """A script that is asked whether it holds as the text of an expression.

    Raises:
        ConfigError: A part of it has no equivalent. The error has no place.
    """
    return print_term(_truth(code, scope))


def value_text(code: Code, scope: Scope, wanted: Kind | None) -> str:
    """A script whose value is asked for as the text of an expression.

    Args:
        code: The script.
        scope: The names.
        wanted: What kind the value shall have; numbers get its unit.

    Raises:
        ConfigError: A part of it has no equivalent. The error has no place.
    """
    return print_term(_value(code, scope, wanted))


def kind_of_code(code: Code, scope: Scope) -> Kind | None:
    """The kind of a script's value; None when it is not known, or a number that fits any unit."""
    match code:
        case Text():
            return Kind.TEXT
        case Truth():
            return Kind.BOOLEAN
        case Name(name=name):
            return scope.kind(name) if scope.key(name) is not None else Kind.TEXT
        case Unary(operator="!"):
            return Kind.BOOLEAN
        case Unary(operand=operand):
            return kind_of_code(operand, scope)
        case Binary(operator=operator, left=left, right=right):
            if operator in _LOGICAL or operator in _COMPARISONS:
                return Kind.BOOLEAN
            return _combined(operator, kind_of_code(left, scope), kind_of_code(right, scope))
    return None


def _combined(operator: str, left: Kind | None, right: Kind | None) -> Kind | None:
    if left is None or right is None:
        return left or right
    if operator == "/" and left is right and left not in _PLAIN:
        return Kind.NUMBER
    if left in _PLAIN and right in _PLAIN:
        return Kind.NUMBER if operator == "/" or Kind.NUMBER in (left, right) else Kind.INTEGER
    return right if left in _PLAIN else left if right in _PLAIN or operator in ("+", "-") else None


def _truth(code: Code, scope: Scope) -> Term:
    match code:
        case Truth(value=value):
            return _constant(value, Kind.BOOLEAN)
        case Number(value=value):
            return _constant(value != 0, Kind.BOOLEAN)
        case Unary(operator="!", operand=operand):
            return syntax.Unary("not", _truth(operand, scope), _HERE)
        case Binary(operator=operator, left=left, right=right) if operator in _LOGICAL:
            return syntax.Binary(_LOGICAL[operator], _truth(left, scope), _truth(right, scope), _HERE)
        case Binary(operator=operator) if operator in _COMPARISONS:
            return _value(code, scope, None)
    kind = kind_of_code(code, scope)
    term = _value(code, scope, kind)
    if kind is Kind.BOOLEAN or (kind is None and isinstance(code, Name)):
        return term
    nothing = _constant("", Kind.TEXT) if kind is Kind.TEXT else _number(0, kind)
    return syntax.Binary("!=", term, nothing, _HERE)


def _value(code: Code, scope: Scope, wanted: Kind | None) -> Term:
    match code:
        case Number(value=value):
            return _number(value, wanted)
        case Text(value=value):
            return _constant(value, Kind.TEXT)
        case Truth(value=value):
            return _constant(value, Kind.BOOLEAN)
        case Name(name=name):
            key = scope.key(name)
            return syntax.Key(key, _HERE) if key is not None else _constant(name, Kind.TEXT)
        case Unary(operator="-", operand=operand):
            return syntax.Unary("-", _value(operand, scope, wanted), _HERE)
        case Unary(operator="!"):
            return _truth(code, scope)
        case Binary(operator=operator) if operator in _LOGICAL:
            return _truth(code, scope)
        case Binary(operator=operator, left=left, right=right) if operator in _COMPARISONS:
            common = kind_of_code(left, scope) or kind_of_code(right, scope)
            return syntax.Binary(operator, _value(left, scope, common), _value(right, scope, common), _HERE)
        case Binary(operator=operator, left=left, right=right) if operator in _ARITHMETIC:
            return _sum(operator, left, right, scope, wanted)
        case Unary(operator=operator) | Binary(operator=operator):
            raise ConfigError(f"the operator {operator!r} has no equivalent")
        case Choice():
            raise ConfigError("a ? b : c inside an expression has no equivalent")
        case Assignment(name=name):
            raise ConfigError(f"an assignment to {name!r} inside an expression has no equivalent")


def _sum(operator: str, left: Code, right: Code, scope: Scope, wanted: Kind | None) -> Term:
    known = kind_of_code(left, scope), kind_of_code(right, scope)
    if operator == "+" and Kind.TEXT in known:
        raise ConfigError("texts put together with + have no equivalent in an expression")
    if operator in ("+", "-"):
        common = known[0] or known[1] or wanted
        kinds: tuple[Kind | None, Kind | None] = (common, common)
    else:
        # In a product one side has the unit: the key's, or else the left number.
        kinds = (known[0] or (wanted if known[1] in (None, *_PLAIN) else None), known[1])
    first, second = (_value(left, scope, kinds[0]), _value(right, scope, kinds[1]))
    return syntax.Binary(operator, first, second, _HERE)


def _number(value: int | float, kind: Kind | None) -> Term:
    if kind in UNITS:
        return syntax.Constant(float(value), kind, quantity_text(float(value), kind), _HERE)
    if kind is Kind.BOOLEAN:
        return _constant(value != 0, Kind.BOOLEAN)
    return _constant(value, Kind.INTEGER if isinstance(value, int) else Kind.NUMBER)


def _constant(value: bool | int | float | str, kind: Kind) -> Term:
    if kind is Kind.TEXT and '"' in str(value) and "'" in str(value):
        raise ConfigError("a text with both kinds of quotes cannot be written in an expression")
    return syntax.Constant(value, kind, si_text(value), _HERE)


class Inexpressible(ConfigError):
    """A part of an expression that the scripts of BehaviorTree.CPP do not have."""


def script_of(term: Term) -> str:
    """One of our expressions as a script.

    Raises:
        Inexpressible: It uses a pose or a function, or a text with quotes.
    """
    match term:
        case syntax.Constant(value=value, kind=Kind.TEXT):
            return script_text(str(value))
        case syntax.Constant(value=value):
            return script_number(value)
        case syntax.Key(key=key):
            return key
        case syntax.Unary(operator=operator, operand=operand):
            sign = "!" if operator == "not" else "-"
            return f"{sign}{_operand(operand, atom=True)}"
        case syntax.Binary(operator=operator, left=left, right=right):
            sign = {"and": "&&", "or": "||"}.get(operator, operator)
            same = (
                isinstance(left, syntax.Binary)
                and left.operator == operator
                and operator in ("and", "or", "+", "*")
            )
            first = script_of(left) if same else _operand(left, inside=operator)
            return f"{first} {sign} {_operand(right, inside=operator)}"
        case syntax.PosePart():
            raise Inexpressible("a part of a pose cannot be read in a script of BehaviorTree.CPP")
        case syntax.Function(name=name):
            raise Inexpressible(f"the scripts of BehaviorTree.CPP have no function {name}")


def script_text(text: str) -> str:
    """A text in a script.

    Raises:
        Inexpressible: It holds what a text of a script cannot hold.
    """
    if "'" in text or not text.isascii() or not text.isprintable():
        raise Inexpressible(f"the text {text!r} cannot be written in a script of BehaviorTree.CPP")
    return f"'{text}'"


def _operand(term: Term, *, atom: bool = False, inside: str = "") -> str:
    """An operand, in parentheses unless it certainly needs none: their precedence is not ours."""
    text = script_of(term)
    compares = isinstance(term, syntax.Binary) and term.operator in _COMPARISONS and inside in ("and", "or")
    if isinstance(term, syntax.Constant | syntax.Key) or compares:
        negative = isinstance(term, syntax.Constant) and text.startswith("-")
        return f"({text})" if atom and negative else text
    if isinstance(term, syntax.Unary) and not atom:
        return text
    return f"({text})"
