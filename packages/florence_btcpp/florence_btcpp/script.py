"""The scripts of BehaviorTree.CPP (``Script``, ``_skipIf``, ...), and their way to our expressions and back.

Scripts are parsed, never evaluated. The precedence is theirs: ``&&`` and ``||`` bind equally and from the
left, ``a < b < c`` is a chain. Their numbers have no units.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language import model
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.expressions.parser import parse_expression
from florence_bt.trees.language.expressions.syntax import Constant, Term, parts_of, print_term
from florence_bt.trees.language.model import Literal, Value
from florence_bt.trees.language.quantities import UNITS, guess_value
from florence_btcpp.values import quantity_text, script_number, si_text

MAX_LENGTH = 10_000
"""Longest script that is read."""
MAX_DIGITS = 40
"""Most digits of a whole number; one of 64 bits, as BehaviorTree.CPP has them, needs no more than 19."""
MAX_TOKENS = 200
"""Most words and signs of a statement; an expression of a mission has no more."""
MAX_DEPTH = 40
"""Deepest nesting of parentheses and operators."""


@dataclass(frozen=True, slots=True)
class NumberExpr:
    """``42``, ``1.5``, ``0x2A``; ``true`` and ``false`` are in :class:`Truth`."""

    value: int | float


@dataclass(frozen=True, slots=True)
class TextExpr:
    """``'hello'``."""

    value: str


@dataclass(frozen=True, slots=True)
class BooleanExpr:
    """``true``, ``false``."""

    value: bool


@dataclass(frozen=True, slots=True)
class NameExpr:
    """A key of the blackboard, or a registered enumeration value."""

    name: str


@dataclass(frozen=True, slots=True)
class UnaryExpr:
    """``-a``, ``!a``, ``~a``."""

    operator: str
    operand: ScriptExpr


@dataclass(frozen=True, slots=True)
class BinaryExpr:
    """``a + b``, ``a && b``, ``a < b``, ``a & b``."""

    operator: str
    left: ScriptExpr
    right: ScriptExpr


@dataclass(frozen=True, slots=True)
class ChoiceExpr:
    """``a ? b : c``."""

    condition: ScriptExpr
    then: ScriptExpr
    otherwise: ScriptExpr


@dataclass(frozen=True, slots=True)
class AssignmentExpr:
    """``a := b``, ``a = b``, ``a += b``."""

    operator: str
    name: str
    value: ScriptExpr


ScriptExpr = (
    NumberExpr | TextExpr | BooleanExpr | NameExpr | UnaryExpr | BinaryExpr | ChoiceExpr | AssignmentExpr
)

_TOKEN = re.compile(
    r"""
    (?P<space>\s+|\\\n)
  | (?P<number>0[xX][0-9a-fA-F]+|(?:\d+\.\d*|\.\d+|\d+)(?:[eE][+-]?\d+)?)
  | (?P<text>'[^']*')
  | (?P<name>@?[^\W\d]\w*)
  | (?P<symbol>:=|\+=|-=|\*=|/=|==|!=|<=|>=|&&|\|\||[-+*/<>=!~&|^?:;()])
    """,
    re.VERBOSE,
)
_ASSIGNMENTS = (":=", "=", "+=", "-=", "*=", "/=")
_COMPARISONS = ("==", "!=", "<=", ">=", "<", ">")


def parse_script(text: str) -> list[ScriptExpr]:
    """Parse a script: statements with ``;`` between them.

    Raises:
        ConfigError: It is not a script. The error has no place in the file.
    """
    return _ExprParser(text).statements()


def parse_condition(text: str) -> ScriptExpr:
    """Parse a script that is one expression, such as ``_skipIf``.

    Raises:
        ConfigError: It is not a script, or not exactly one statement.
    """
    statements = parse_script(text)
    if len(statements) != 1:
        raise ConfigError(f"one condition is needed, not {len(statements)} statements")
    return statements[0]


def order_matters(text: str) -> bool:
    """Tell whether a script has a sum or product that versions before 4.9 compute otherwise: from the right.

    Raises:
        ConfigError: It is not a script. The error has no place in the file.
    """
    parser = _ExprParser(text)
    parser.statements()
    return parser.order_matters


def names_in(code: ScriptExpr) -> Iterator[tuple[str, bool]]:
    """Yield every name in a piece of script in the order of its evaluation, with whether it is written."""
    match code:
        case NameExpr(name=name):
            yield name, False
        case UnaryExpr(operand=operand):
            yield from names_in(operand)
        case BinaryExpr(left=left, right=right):
            yield from names_in(left)
            yield from names_in(right)
        case ChoiceExpr(condition=condition, then=then, otherwise=otherwise):
            for part in (condition, then, otherwise):
                yield from names_in(part)
        case AssignmentExpr(operator=operator, name=name, value=value):
            yield from names_in(value)
            if operator not in (":=", "="):
                yield name, False
            yield name, True


def hints_in(code: ScriptExpr, *, is_condition: bool = True) -> Iterator[tuple[str, Kind]]:
    """Yield what the names in a script seem to be: truth values where they are conditions, else what they are
    compared with, and numbers where they are computed with.

    Args:
        code: The script.
        is_condition: Whether the script is a condition.
    """
    match code:
        case NameExpr(name=name) if is_condition:
            yield name, Kind.BOOLEAN
        case UnaryExpr(operator="!", operand=operand):
            yield from hints_in(operand)
        case BinaryExpr(operator="&&" | "||", left=left, right=right):
            yield from hints_in(left)
            yield from hints_in(right)
        case BinaryExpr(operator=operator, left=left, right=right):
            for one, other in ((left, right), (right, left)):
                kind = literal_kind(other) or (Kind.NUMBER if operator in _OF_NUMBERS else None)
                if isinstance(one, NameExpr) and kind is not None:
                    yield one.name, kind
                yield from hints_in(one, is_condition=False)
        case AssignmentExpr(value=value):
            yield from hints_in(value, is_condition=False)


_OF_NUMBERS = ("<", ">", "<=", ">=", "-", "*", "/")
"""Operators that texts and truth values do not have."""


def literal_kind(code: ScriptExpr) -> Kind | None:
    """Return the kind of a literal, None for everything else."""
    match code:
        case NumberExpr(value=value):
            return Kind.INTEGER if isinstance(value, int) else Kind.NUMBER
        case TextExpr():
            return Kind.TEXT
        case BooleanExpr():
            return Kind.BOOLEAN
        case UnaryExpr(operator="-", operand=operand):
            return literal_kind(operand)
    return None


class _ExprParser:
    def __init__(self, text: str) -> None:
        if len(text) > MAX_LENGTH:
            raise ConfigError(f"the script has more than {MAX_LENGTH} characters")
        self._tokens = list(_cut(text))
        self._at = 0
        self._depth = 0
        self.order_matters = False

    def statements(self) -> list[ScriptExpr]:
        found: list[ScriptExpr] = []
        while self._kind() != "end":
            begin = self._at
            found.append(self._assignment())
            if self._at - begin > MAX_TOKENS:
                raise ConfigError(f"{self._at - begin} words and signs; at most {MAX_TOKENS} are read")
            if self._kind() != "end":
                self._expect(";")
        if not found:
            raise ConfigError("the script is empty")
        return found

    def _assignment(self) -> ScriptExpr:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise ConfigError(f"the script is nested more than {MAX_DEPTH} deep")
        left = self._choice()
        operator = self._text()
        if self._kind() == "symbol" and operator in _ASSIGNMENTS:
            if not isinstance(left, NameExpr):
                raise ConfigError(f"only a name can stand before {operator!r}")
            self._at += 1
            left = AssignmentExpr(operator, left.name, self._choice())
        self._depth -= 1
        return left

    def _choice(self) -> ScriptExpr:
        condition = self._logical()
        if not self._take("?"):
            return condition
        then = self._assignment()
        self._expect(":")
        return ChoiceExpr(condition, then, self._logical())

    def _logical(self) -> ScriptExpr:
        left = self._comparison()
        while (operator := self._text()) in ("&&", "||"):
            self._at += 1
            left = BinaryExpr(operator, left, self._comparison())
        return left

    def _comparison(self) -> ScriptExpr:
        left = self._sum()
        chain: ScriptExpr | None = None
        while (operator := self._text()) in _COMPARISONS:
            self._at += 1
            right = self._sum()
            link = BinaryExpr(operator, left, right)
            chain = link if chain is None else BinaryExpr("&&", chain, link)
            left = right
        return left if chain is None else chain

    def _sum(self) -> ScriptExpr:
        left = self._product()
        before = ""
        while (operator := self._text()) in ("+", "-", "|", "^"):
            self.order_matters |= before == "-"
            self._at += 1
            left = BinaryExpr(operator, left, self._product())
            before = operator
        return left

    def _product(self) -> ScriptExpr:
        left = self._prefix()
        before = ""
        while (operator := self._text()) in ("*", "/", "&"):
            self.order_matters |= before == "/"
            self._at += 1
            left = BinaryExpr(operator, left, self._prefix())
            before = operator
        return left

    def _prefix(self) -> ScriptExpr:
        operator = self._text()
        if self._kind() == "symbol" and operator in ("-", "!", "~"):
            self._at += 1
            return UnaryExpr(operator, self._atom())
        return self._atom()

    def _atom(self) -> ScriptExpr:
        kind, text = self._tokens[self._at]
        if self._take("("):
            inner = self._assignment()
            self._expect(")")
            return inner
        if kind not in ("number", "text", "name"):
            raise ConfigError(f"a value is needed {_before(kind, text)}")
        self._at += 1
        match kind:
            case "number":
                return NumberExpr(_read_number(text))
            case "text":
                return TextExpr(text[1:-1])
        return BooleanExpr(text == "true") if text in ("true", "false") else NameExpr(text)

    def _kind(self) -> str:
        return self._tokens[self._at][0]

    def _text(self) -> str:
        kind, text = self._tokens[self._at]
        return text if kind == "symbol" else ""

    def _take(self, symbol: str) -> bool:
        found = self._text() == symbol
        self._at += found
        return found

    def _expect(self, symbol: str) -> None:
        if not self._take(symbol):
            raise ConfigError(f"{symbol!r} is needed {_before(*self._tokens[self._at])}")


def _before(kind: str, text: str) -> str:
    return "at the end of the script" if kind == "end" else f"before {text!r}"


def _read_number(text: str) -> int | float:
    digits, base = (text[2:], 16) if text[:2] in ("0x", "0X") else (text, 10)
    if base == 10 and not text.isdecimal():
        number = float(text)
        if not math.isfinite(number):
            raise ConfigError(f"the number {text:.40} is too large")
        return number
    if len(digits) > MAX_DIGITS or int(digits, base) >= 1 << 63:
        raise ConfigError(f"the number {text:.40} does not fit into 64 bits")
    return int(digits, base)


def _cut(text: str) -> Iterator[tuple[str, str]]:
    at = 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise ConfigError(f"{text[at]!r} has no place in a script")
        if match.lastgroup != "space":
            yield str(match.lastgroup), match[0]
        at = match.end()
    yield "end", ""


_HERE = Position()
_LOGICAL = {"&&": "and", "||": "or"}
_ARITHMETIC = ("+", "-", "*", "/")
_PLAIN = (Kind.INTEGER, Kind.NUMBER)


class Scope(Protocol):
    """The names of a tree, as far as they are known."""

    def key(self, foreign: str) -> str | None:
        """Return our name of a key, None when the name is not a key (an enumeration value)."""

    def key_name(self, foreign: str) -> str:
        """Return our name of a key that is written."""

    def kind(self, foreign: str) -> Kind | None:
        """Return the kind of a key, None when it is not known."""


def condition_text(code: ScriptExpr, scope: Scope) -> str:
    """Write a script that is a condition as the text of an expression.

    Raises:
        ConfigError: A part of it has no equivalent. The error has no place.
    """
    return _fitting(_truth(code, scope), code, scope, Kind.BOOLEAN)


def value_text(code: ScriptExpr, scope: Scope, wanted: Kind | None) -> str:
    """Write a script that is a value as the text of an expression.

    Args:
        code: The script.
        scope: The names.
        wanted: What kind the value shall have; numbers get its unit.

    Raises:
        ConfigError: A part of it has no equivalent. The error has no place.
    """
    return _fitting(_value(code, scope, wanted), code, scope, wanted)


def _fitting(term: Term, code: ScriptExpr, scope: Scope, wanted: Kind | None) -> str:
    """Write an expression as a text, if its values fit together and it is not too long for a mission."""
    text = print_term(term)
    kinds = {key: scope.kind(name) for name, _ in names_in(code) if (key := scope.key(name)) is not None}
    problems = check_kinds(parse_expression(text), kinds, wanted).problems
    if problems:
        raise ConfigError(problems[0].message)
    return text


def kind_of_code(code: ScriptExpr, scope: Scope) -> Kind | None:
    """Return the kind of a script's value; None when it is not known, or a number that fits any unit."""
    match code:
        case TextExpr():
            return Kind.TEXT
        case BooleanExpr():
            return Kind.BOOLEAN
        case NameExpr(name=name):
            return scope.kind(name) if scope.key(name) is not None else Kind.TEXT
        case UnaryExpr(operator="!"):
            return Kind.BOOLEAN
        case UnaryExpr(operand=operand):
            return kind_of_code(operand, scope)
        case BinaryExpr(operator=operator, left=left, right=right):
            if operator in _LOGICAL or operator in _COMPARISONS:
                return Kind.BOOLEAN
            return _combined(operator, kind_of_code(left, scope), kind_of_code(right, scope))
        case ChoiceExpr(then=then, otherwise=otherwise):
            return kind_of_code(then, scope) or kind_of_code(otherwise, scope)
    return None


def assigned_value(code: AssignmentExpr) -> ScriptExpr:
    """Return what an assignment gives its key: ``a += 1`` is ``a + 1``."""
    if code.operator in (":=", "="):
        return code.value
    return BinaryExpr(code.operator[0], NameExpr(code.name), code.value)


def is_fractional(code: ScriptExpr) -> bool:
    """Tell whether a sum of whole numbers need not be whole: it divides, or has a number with a point."""
    match code:
        case NumberExpr(value=value):
            return isinstance(value, float)
        case UnaryExpr(operand=operand):
            return is_fractional(operand)
        case BinaryExpr(operator=operator, left=left, right=right):
            return operator == "/" or is_fractional(left) or is_fractional(right)
        case ChoiceExpr(then=then, otherwise=otherwise):
            return is_fractional(then) or is_fractional(otherwise)
    return False


def _combined(operator: str, left: Kind | None, right: Kind | None) -> Kind | None:
    if left is None or right is None:
        return left or right
    if operator == "/" and left is right and left not in _PLAIN:
        return Kind.NUMBER
    if left in _PLAIN and right in _PLAIN:
        return Kind.NUMBER if operator == "/" or Kind.NUMBER in (left, right) else Kind.INTEGER
    return right if left in _PLAIN else left if right in _PLAIN or operator in ("+", "-") else None


def _truth(code: ScriptExpr, scope: Scope) -> Term:
    match code:
        case BooleanExpr(value=value):
            return _constant(value, Kind.BOOLEAN)
        case NumberExpr(value=value):
            return _constant(value != 0, Kind.BOOLEAN)
        case UnaryExpr(operator="!", operand=operand):
            return syntax.Unary("not", _truth(operand, scope), _HERE)
        case BinaryExpr(operator=operator, left=left, right=right) if operator in _LOGICAL:
            return syntax.Binary(_LOGICAL[operator], _truth(left, scope), _truth(right, scope), _HERE)
        case BinaryExpr(operator=operator) if operator in _COMPARISONS:
            return _value(code, scope, None)
    kind = kind_of_code(code, scope)
    term = _value(code, scope, kind)
    if kind is Kind.BOOLEAN or (kind is None and isinstance(code, NameExpr)):
        return term
    nothing = _constant("", Kind.TEXT) if kind is Kind.TEXT else _number(0, kind)
    return syntax.Binary("!=", term, nothing, _HERE)


def _value(code: ScriptExpr, scope: Scope, wanted: Kind | None) -> Term:
    match code:
        case NumberExpr(value=value):
            return _number(value, wanted)
        case TextExpr(value=value):
            return _constant(value, Kind.TEXT)
        case BooleanExpr(value=value):
            return (
                _constant(si_text(value), Kind.TEXT)
                if wanted is Kind.TEXT
                else _constant(value, Kind.BOOLEAN)
            )
        case NameExpr(name=name):
            key = scope.key(name)
            return syntax.Key(key, _HERE) if key is not None else _constant(name, Kind.TEXT)
        case UnaryExpr(operator="-", operand=operand):
            return syntax.Unary("-", _value(operand, scope, wanted), _HERE)
        case UnaryExpr(operator="!"):
            return _truth(code, scope)
        case BinaryExpr(operator=operator) if operator in _LOGICAL:
            return _truth(code, scope)
        case BinaryExpr(operator=operator, left=left, right=right) if operator in _COMPARISONS:
            common = kind_of_code(left, scope) or kind_of_code(right, scope)
            return syntax.Binary(operator, _value(left, scope, common), _value(right, scope, common), _HERE)
        case BinaryExpr(operator=operator, left=left, right=right) if operator in _ARITHMETIC:
            return _sum(operator, left, right, scope, wanted)
        case UnaryExpr(operator=operator) | BinaryExpr(operator=operator):
            raise ConfigError(f"the operator {operator!r} has no equivalent")
        case ChoiceExpr():
            raise ConfigError("a ? b : c inside an expression has no equivalent")
        case AssignmentExpr(name=name):
            raise ConfigError(f"an assignment to {name!r} inside an expression has no equivalent")


def _sum(operator: str, left: ScriptExpr, right: ScriptExpr, scope: Scope, wanted: Kind | None) -> Term:
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
    if kind is Kind.TEXT:
        return _constant(si_text(value), Kind.TEXT)
    return _constant(value, Kind.INTEGER if isinstance(value, int) else Kind.NUMBER)


def _constant(value: bool | int | float | str, kind: Kind) -> Term:
    if kind is Kind.TEXT and '"' in str(value) and "'" in str(value):
        raise ConfigError("text with both kinds of quotes cannot be written in an expression")
    return syntax.Constant(value, kind, si_text(value), _HERE)


class Inexpressible(ConfigError):
    """A part of an expression that the scripts of BehaviorTree.CPP do not have."""


def script_of(term: Term) -> str:
    """Write one of our expressions as a script.

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
        case syntax.Item() | syntax.Listed() | syntax.Binary(operator="in"):
            raise Inexpressible("the scripts of BehaviorTree.CPP have no lists")
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
    """Write a text in a script.

    Raises:
        Inexpressible: It holds what a text of a script cannot hold.
    """
    if "'" in text or not text.isascii() or not text.isprintable():
        raise Inexpressible(f"the text {text!r} cannot be written in a script of BehaviorTree.CPP")
    return f"'{text}'"


def _operand(term: Term, *, atom: bool = False, inside: str = "") -> str:
    """Write an operand, in parentheses unless it certainly needs none: their precedence is not ours."""
    text = script_of(term)
    compares = isinstance(term, syntax.Binary) and term.operator in _COMPARISONS and inside in ("and", "or")
    if isinstance(term, syntax.Constant | syntax.Key) or compares:
        negative = isinstance(term, syntax.Constant) and text.startswith("-")
        return f"({text})" if atom and negative else text
    if isinstance(term, syntax.Unary) and not atom:
        return text
    return f"({text})"


def set_script(values: tuple[tuple[Literal, Value], ...]) -> str:
    """Write the values of a ``set`` as assignments.

    Raises:
        Inexpressible: A value is a pose or a text with keys, or reads a key that another one writes.
    """
    written = {key.text for key, _ in values}
    for _, value in values:
        if written & {reference.key for reference in model.references(value)} and len(values) > 1:
            raise Inexpressible("the values of a set are all found before any is written")
    return "; ".join(f"{key.text} := {value_script(value)}" for key, value in values)


def value_script(value: Value) -> str:
    """Write a value as the right side of an assignment.

    Raises:
        Inexpressible: It is a pose or a text with keys.
    """
    match value:
        case Literal(text=text, quoted=True):
            return script_text(text)
        case Literal(text=text):
            kind, guessed = guess_value(text)
            return script_text(text) if kind is Kind.TEXT else script_number(guessed)
        case model.Reference(key=key):
            return key
        case model.Expression(term=term):
            return script_of(term)
    raise Inexpressible("a script of BehaviorTree.CPP has no poses, and puts no keys into texts")


def needs_mark(value: Value) -> bool:
    """Tell whether a script loses a part of the value, because its numbers have no units."""
    match value:
        case Literal(text=text, quoted=quoted):
            return not quoted and guess_value(text)[0] in (*UNITS, Kind.NUMBER)
        case model.Expression(term=term):
            return term_needs_mark(term)
    return False


def term_needs_mark(term: Term) -> bool:
    """Tell whether a script loses a part of the expression."""
    if isinstance(term, Constant):
        return term.kind in UNITS or term.kind is Kind.NUMBER
    return any(term_needs_mark(part) for part in parts_of(term))
