"""The scripts of BehaviorTree.CPP (``Script``, ``_skipIf``, ...) as syntax trees. Parsed, never evaluated.

The precedence is theirs: ``&&`` and ``||`` bind equally and from the left, ``a < b < c`` is a chain.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError

MAX_LENGTH = 10_000
"""Longest script that is read."""
MAX_DIGITS = 40
"""Most digits of a whole number; one of 64 bits, as BehaviorTree.CPP has them, needs no more than 19."""
MAX_DEPTH = 40
"""Deepest nesting of parentheses and operators."""


@dataclass(frozen=True, slots=True)
class Number:
    """``42``, ``1.5``, ``0x2A``; ``true`` and ``false`` are in :class:`Truth`."""

    value: int | float


@dataclass(frozen=True, slots=True)
class Text:
    """``'hello'``."""

    value: str


@dataclass(frozen=True, slots=True)
class Truth:
    """``true``, ``false``."""

    value: bool


@dataclass(frozen=True, slots=True)
class Name:
    """A key of the blackboard, or a registered enumeration value."""

    name: str


@dataclass(frozen=True, slots=True)
class Unary:
    """``-a``, ``!a``, ``~a``."""

    operator: str
    operand: Code


@dataclass(frozen=True, slots=True)
class Binary:
    """``a + b``, ``a && b``, ``a < b``, ``a & b``."""

    operator: str
    left: Code
    right: Code


@dataclass(frozen=True, slots=True)
class Choice:
    """``a ? b : c``."""

    condition: Code
    then: Code
    otherwise: Code


@dataclass(frozen=True, slots=True)
class Assignment:
    """``a := b``, ``a = b``, ``a += b``."""

    operator: str
    name: str
    value: Code


Code = Number | Text | Truth | Name | Unary | Binary | Choice | Assignment

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


def parse_script(text: str) -> list[Code]:
    """Parse a script: statements with ``;`` between them.

    Raises:
        ConfigError: It is no script. The error has no place in the file.
    """
    return _Parser(text).statements()


def parse_expression(text: str) -> Code:
    """Parse a script whose value is asked for, such as ``_skipIf``.

    Raises:
        ConfigError: It is no script, or not exactly one statement.
    """
    statements = parse_script(text)
    if len(statements) != 1:
        raise ConfigError(f"one condition is needed, not {len(statements)} statements")
    return statements[0]


def order_matters(text: str) -> bool:
    """Whether a script has a sum or product that versions before 4.9 compute otherwise: from the right.

    Raises:
        ConfigError: It is no script. The error has no place in the file.
    """
    parser = _Parser(text)
    parser.statements()
    return parser.order_matters


def names_in(code: Code) -> Iterator[tuple[str, bool]]:
    """Every name in a piece of script in the order of its evaluation, with whether it is written."""
    match code:
        case Name(name=name):
            yield name, False
        case Unary(operand=operand):
            yield from names_in(operand)
        case Binary(left=left, right=right):
            yield from names_in(left)
            yield from names_in(right)
        case Choice(condition=condition, then=then, otherwise=otherwise):
            for part in (condition, then, otherwise):
                yield from names_in(part)
        case Assignment(operator=operator, name=name, value=value):
            yield from names_in(value)
            if operator not in (":=", "="):
                yield name, False
            yield name, True


def hints_in(code: Code, *, asked: bool = True) -> Iterator[tuple[str, Kind]]:
    """What the names in a piece of script seem to be: truth values where they are asked, else what they are
    compared with.

    Args:
        code: The script.
        asked: Whether it is asked whether it holds.
    """
    match code:
        case Name(name=name) if asked:
            yield name, Kind.BOOLEAN
        case Unary(operator="!", operand=operand):
            yield from hints_in(operand)
        case Binary(operator="&&" | "||", left=left, right=right):
            yield from hints_in(left)
            yield from hints_in(right)
        case Binary(left=left, right=right):
            for one, other in ((left, right), (right, left)):
                kind = literal_kind(other)
                if isinstance(one, Name) and kind is not None:
                    yield one.name, kind
                yield from hints_in(one, asked=False)
        case Assignment(value=value):
            yield from hints_in(value, asked=False)


def literal_kind(code: Code) -> Kind | None:
    """The kind of a literal, None for everything else."""
    match code:
        case Number(value=value):
            return Kind.INTEGER if isinstance(value, int) else Kind.NUMBER
        case Text():
            return Kind.TEXT
        case Truth():
            return Kind.BOOLEAN
        case Unary(operator="-", operand=operand):
            return literal_kind(operand)
    return None


class _Parser:
    def __init__(self, text: str) -> None:
        if len(text) > MAX_LENGTH:
            raise ConfigError(f"the script has more than {MAX_LENGTH} characters")
        self._tokens = list(_cut(text))
        self._at = 0
        self._depth = 0
        self.order_matters = False

    def statements(self) -> list[Code]:
        found: list[Code] = []
        while self._kind() != "end":
            found.append(self._assignment())
            if self._kind() != "end":
                self._expect(";")
        if not found:
            raise ConfigError("the script is empty")
        return found

    def _assignment(self) -> Code:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise ConfigError(f"the script is nested more than {MAX_DEPTH} deep")
        left = self._choice()
        operator = self._text()
        if self._kind() == "symbol" and operator in _ASSIGNMENTS:
            if not isinstance(left, Name):
                raise ConfigError(f"only a name can stand before {operator!r}")
            self._at += 1
            left = Assignment(operator, left.name, self._choice())
        self._depth -= 1
        return left

    def _choice(self) -> Code:
        condition = self._logical()
        if not self._take("?"):
            return condition
        then = self._assignment()
        self._expect(":")
        return Choice(condition, then, self._logical())

    def _logical(self) -> Code:
        left = self._comparison()
        while (operator := self._text()) in ("&&", "||"):
            self._at += 1
            left = Binary(operator, left, self._comparison())
        return left

    def _comparison(self) -> Code:
        left = self._sum()
        chain: Code | None = None
        while (operator := self._text()) in _COMPARISONS:
            self._at += 1
            right = self._sum()
            link = Binary(operator, left, right)
            chain = link if chain is None else Binary("&&", chain, link)
            left = right
        return left if chain is None else chain

    def _sum(self) -> Code:
        left = self._product()
        before = ""
        while (operator := self._text()) in ("+", "-", "|", "^"):
            self.order_matters |= before == "-"
            self._at += 1
            left = Binary(operator, left, self._product())
            before = operator
        return left

    def _product(self) -> Code:
        left = self._prefix()
        before = ""
        while (operator := self._text()) in ("*", "/", "&"):
            self.order_matters |= before == "/"
            self._at += 1
            left = Binary(operator, left, self._prefix())
            before = operator
        return left

    def _prefix(self) -> Code:
        operator = self._text()
        if self._kind() == "symbol" and operator in ("-", "!", "~"):
            self._at += 1
            return Unary(operator, self._atom())
        return self._atom()

    def _atom(self) -> Code:
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
                return Number(_number(text))
            case "text":
                return Text(text[1:-1])
        return Truth(text == "true") if text in ("true", "false") else Name(text)

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


def _number(text: str) -> int | float:
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
