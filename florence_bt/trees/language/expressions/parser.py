"""From the text of an expression to its syntax tree, by recursive descent.

The grammar, loosest first; ``=`` here means "is"::

    or         = and {"or" and}
    and        = not {"and" not}
    not        = "not" not | comparison
    comparison = sum [("==" | "!=" | "<" | "<=" | ">" | ">=" | "in") sum]
    sum        = product {("+" | "-") product}
    product    = minus {("*" | "/") minus}
    minus      = "-" minus | part
    part       = value {"." ("x" | "y" | "yaw") | "[" or "]"}
    value      = number [unit] {number unit} | text | "true" | "false" | "$" key | "(" or ")"
               | function "(" or {"," or} ")" | "[" [or {"," or}] "]"
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position
from florence_bt.core.units import UNITS, quantity_meant
from florence_bt.trees.language.expressions.syntax import (
    Binary,
    Constant,
    Expression,
    Function,
    Item,
    Key,
    Listed,
    PosePart,
    Term,
    Unary,
    print_term,
)
from florence_bt.trees.language.quantities import guess_value
from florence_bt.trees.language.vocabulary import by_spelling

_UNIT = "|".join(
    re.escape(unit)
    for unit in sorted({u for units in UNITS.values() for u in units}, key=lambda u: (-len(u), u))
)
_TOKEN = re.compile(
    rf"""
    (?P<space>\s+)
  | (?P<quantity>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?(?:\s*(?:{_UNIT})(?!\w|/[^\W\d]|°))?)
  | (?P<key>\$(?:[a-z][a-z0-9_]*|\{{[a-z][a-z0-9_]*\}}))
  | (?P<text>"[^"]*"|'[^']*')
  | (?P<word>[^\W\d]\w*)
  | (?P<symbol><=(?!=)|>=(?!=)|==(?!=)|!=(?!=)|<(?![>=])|>(?!=)|[-+*/().,\[\]])
    """,
    re.VERBOSE,
)
_OTHER_SIGNS = by_spelling(
    {
        "==": ("===", "="),
        "!=": ("<>", "≠"),
        ">=": ("=>", "≥"),
        "<=": ("=<", "≤"),
        "and": ("&&", "&"),
        "or": ("||", "|"),
        "not": ("!",),
        "a number between 0 and 1": ("%",),
        "a * a": ("^",),
        "*": ("×", "·"),
        "/": ("÷",),
        "-": ("−", "–"),
        '"': ("“", "”", "„"),
        "'": ("‘", "’"),
        "$key, without braces": ("{{",),
    }
)
"""Signs of other languages -> what is written here."""

_WORD = re.compile(r"\s*((?:[^\W\d]|°)\w*(?:/[^\W\d]\w*)?)")
_OPERATORS = ("and", "or", "<", "==", "+", "*")


@dataclass(frozen=True, slots=True)
class Token:
    """A piece of an expression.

    Attributes:
        kind: ``quantity``, ``key``, ``text``, ``word``, ``symbol`` or ``end``.
        text: As written.
        position: Where it begins.
    """

    kind: str
    text: str
    position: Position


class PositionMap:
    """The places of the characters of a text in its file.

    Args:
        position: Where the text begins.
        exact: Whether the text stands there as it is, on one line; otherwise every character is said to stand
            at the beginning.
    """

    def __init__(self, position: Position, *, exact: bool = True) -> None:
        self._position = position
        self._exact = exact

    def at(self, offset: int) -> Position:
        """Return the place of a character, counted from 0."""
        if not self._exact:
            return self._position
        return Position(self._position.line, self._position.column + offset)


def tokenize(text: str, positions: PositionMap) -> list[Token]:
    """Cut an expression into tokens, with one of the kind ``end`` after the last.

    Raises:
        ConfigError: With the line and column of what is not part of an expression.
    """
    tokens: list[Token] = []
    offset = 0
    while offset < len(text):
        match = _TOKEN.match(text, offset)
        if match is None:
            raise _unknown_sign(text, offset, positions.at(offset))
        if match.lastgroup == "quantity":
            _refuse_unit(text, match.end(), match[0], positions)
        if match.lastgroup != "space":
            tokens.append(Token(str(match.lastgroup), match[0], positions.at(offset)))
        offset = match.end()
    tokens.append(Token("end", "", positions.at(len(text.rstrip()))))
    return tokens


def problem_at(position: Position, problem: str, *valid: str) -> ConfigError:
    """Make an error with a place."""
    return ConfigError(problem, line=position.line, column=position.column, valid=valid)


def _refuse_unit(text: str, end: int, number: str, positions: PositionMap) -> None:
    """Refuse a word right after a number that is no unit."""
    match = _WORD.match(text, end)
    if match is None or match[1] in ("and", "or", "in"):
        return
    position = positions.at(match.start(1))
    if not number[-1].isdigit() and number[-1] != ".":
        raise problem_at(position, f"{match[1]!r} cannot follow {number!r}", *_OPERATORS)
    meant = [said for kind in UNITS if (said := quantity_meant(number, match[1], kind)) is not None]
    units = [unit for known in UNITS.values() for unit in known]
    valid = meant or [f"{number} {unit}" for unit in closest_first(match[1], units)]
    raise problem_at(position, f"{match[1]!r} is not a unit", *valid)


_TIME_AROUND = re.compile(r"\d{1,2}:\d{2}$")
"""A time of day of which the colon is met."""


def _unknown_sign(text: str, offset: int, position: Position) -> ConfigError:
    for sign, here in sorted(_OTHER_SIGNS.items(), key=lambda item: -len(item[0])):
        if text.startswith(sign, offset):
            return problem_at(position, f"{sign!r} is not known here", here)
    if text[offset] in "\"'":
        return problem_at(position, "the text has no end", f"a closing {text[offset]}")
    if text[offset] == "$":
        rest = re.match(r"\$\{?(\w*)", text[offset:])
        name = rest[1].lower() if rest else ""
        return problem_at(position, "a $ must stand before the name of a key", f"${name or 'key'}")
    if text[offset] == ":" and (time := _TIME_AROUND.search(text[: offset + 3])):
        return problem_at(position, "an expression knows no time of day", f"wait_until: {time[0]}, as a node")
    if text[offset] in "{}":
        return problem_at(position, f"{text[offset]!r} has no place in an expression", "( and )")
    return problem_at(position, f"{text[offset]!r} has no place in an expression")


def closing_brace(text: str, start: int) -> int | None:
    """Return the index of the first ``}`` from ``start`` on outside quotes, None when there is none.

    Braces round a key, as in ``${key}``, belong together.
    """
    quote = ""
    depth = 0
    for index in range(start, len(text)):
        sign = text[index]
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "\"'":
            quote = sign
        elif sign == "{":
            depth += 1
        elif sign == "}":
            if depth == 0:
                return index
            depth -= 1
    return None


MAX_LENGTH = 1000
"""Characters that an expression has at most."""
MAX_TOKENS = 200
"""Words, numbers and signs that it has at most."""
MAX_NESTING = 32
"""Levels to which parentheses, signs and functions are nested at most."""

COMPARISONS = ("==", "!=", "<", "<=", ">", ">=", "in")
POSE_PARTS = ("x", "y", "yaw")
FUNCTIONS = {"abs": 1, "min": 2, "max": 2, "count": 1, "distance": 2, "bearing": 2}
"""Function -> how many values it needs."""
_OTHER_FUNCTIONS = by_spelling(
    {"count": ("len", "length", "size"), "the skill pick_random": ("random", "rand", "choice")}
)
"""Other languages' names of the functions, and what stands here in place of one."""
_WORDS = ("and", "or", "not", "in", "true", "false")
_OTHER_WORDS = {"is": "==", "equals": "==", "eq": "==", "isnt": "!=", "ne": "!=", "lt": "<", "gt": ">"}

_KIND_OF_CONSTANT = {int: Kind.INTEGER, float: Kind.NUMBER, str: Kind.TEXT, bool: Kind.BOOLEAN}
"""Of the values that an interface can name."""


def parse_expression(
    text: str,
    position: Position | None = None,
    *,
    exact: bool = True,
    constants: Mapping[str, Any] | None = None,
) -> Expression:
    """Parse an expression.

    Args:
        text: The expression, without ``${`` and ``}``.
        position: Where it begins in its file; line 1, column 1 when not given.
        exact: Whether the text stands in the file as it is here, on one line; otherwise every part is said to
            stand at the beginning.
        constants: Of an expression over a message, whose parts have names of their own: the values that its
            type names.

    Raises:
        ConfigError: It is not an expression; with line and column, without a file.
    """
    start = position or Position()
    if len(text) > MAX_LENGTH:
        problem = f"an expression of {len(text)} characters; at most {MAX_LENGTH} are read"
        raise problem_at(start, problem, "set: a part of it to a key first")
    positions = PositionMap(start, exact=exact)
    tokens = tokenize(text, positions)
    words = len(tokens) - 1  # the last one stands for the end
    if words > MAX_TOKENS:
        problem = f"an expression of {words} words and signs; at most {MAX_TOKENS} are read"
        raise problem_at(start, problem, "set: a part of it to a key first")
    if not words:
        raise problem_at(start, "an expression is missing", "$distance < 1 m", "$found and not $done")
    begin = positions.at(len(text) - len(text.lstrip()))
    term = _ExpressionParser(tokens, constants).whole()
    return Expression(print_term(term) if "\n" in text.strip() else text.strip(), term, begin)


def negated(text: str) -> str:
    """Write the opposite of a condition; ``not (...)`` round one that cannot be read."""
    try:
        term = parse_expression(text).term
    except ConfigError:
        return f"not ({text or '...'})"
    if isinstance(term, Unary) and term.operator == "not":
        return print_term(term.operand)
    return print_term(Unary("not", term, Position()))


class _ExpressionParser:
    def __init__(self, tokens: list[Token], constants: Mapping[str, Any] | None) -> None:
        self._tokens = tokens
        self._constants = constants
        self._index = 0
        self._depth = 0

    def whole(self) -> Term:
        term = self._or()
        if self._now.kind != "end":
            raise self._left_over(self._now)
        return term

    # ---- tokens ---------------------------------------------------------------------------------------

    @property
    def _now(self) -> Token:
        return self._tokens[self._index]

    def _take(self) -> Token:
        token = self._now
        self._index += token.kind != "end"
        return token

    def _is(self, *texts: str) -> bool:
        return self._now.kind in ("symbol", "word") and self._now.text in texts

    def _expect(self, sign: str, opened: Token) -> None:
        if not self._is(sign):
            if self._now.kind == "end":
                raise problem_at(opened.position, f"this {opened.text} is not closed", sign)
            raise self._left_over(self._now, sign)
        self._take()

    def _nested(self, position: Position, parse: Callable[[], Term]) -> Term:
        self._depth += 1
        if self._depth > MAX_NESTING:
            problem = f"parts of an expression are nested more than {MAX_NESTING} deep"
            raise problem_at(position, problem, "set: a part of it to a key first")
        term = parse()
        self._depth -= 1
        return term

    # ---- grammar --------------------------------------------------------------------------------------

    def _or(self) -> Term:
        return self._left_to_right(("or",), self._and)

    def _and(self) -> Term:
        return self._left_to_right(("and",), self._not)

    def _not(self) -> Term:
        if not self._is("not"):
            return self._comparison()
        token = self._take()
        return Unary("not", self._nested(token.position, self._not), token.position)

    def _comparison(self) -> Term:
        left = self._sum()
        if not self._is(*COMPARISONS):
            return left
        token = self._take()
        term = Binary(token.text, left, self._sum(), token.position)
        if self._is(*COMPARISONS):
            problem = "comparisons cannot be chained"
            raise problem_at(self._now.position, problem, "$a < $b and $b < $c")
        return term

    def _sum(self) -> Term:
        return self._left_to_right(("+", "-"), self._product)

    def _product(self) -> Term:
        return self._left_to_right(("*", "/"), self._minus)

    def _left_to_right(self, operators: tuple[str, ...], operand: Callable[[], Term]) -> Term:
        term = operand()
        while self._is(*operators):
            token = self._take()
            term = Binary(token.text, term, operand(), token.position)
        return term

    def _minus(self) -> Term:
        if not self._is("-"):
            return self._part()
        token = self._take()
        return Unary("-", self._nested(token.position, self._minus), token.position)

    def _part(self) -> Term:
        term = self._value()
        while self._is(".", "["):
            dot = self._take()
            if dot.text == "[":
                index = self._nested(dot.position, self._or)
                self._expect("]", dot)
                term = Item(term, index, dot.position)
                continue
            name = self._take()
            if name.kind != "word":
                valid = [f".{part}" for part in POSE_PARTS]
                raise problem_at(dot.position, f"a pose has no part {name.text!r}", *valid)
            term = PosePart(term, name.text, name.position)
        return term

    def _value(self) -> Term:
        token = self._take()
        match token.kind:
            case "quantity":
                return _quantity(self._with_parts(token))
            case "text":
                return Constant(token.text[1:-1], Kind.TEXT, token.text[1:-1], token.position)
            case "key":
                return Key(token.text.strip("${}"), token.position)
            case "word":
                return self._word(token)
        if token.text == "(":
            term = self._nested(token.position, self._or)
            self._expect(")", token)
            return term
        if token.text == "[":
            return Listed(self._items(token, "]"), token.position)
        raise self._no_value(token)

    def _items(self, opened: Token, closing: str) -> tuple[Term, ...]:
        """Read what stands between commas, up to the closing sign."""
        items = [] if self._is(closing) else [self._nested(opened.position, self._or)]
        while self._is(","):
            self._take()
            items.append(self._nested(opened.position, self._or))
        self._expect(closing, opened)
        return tuple(items)

    def _with_parts(self, token: Token) -> Token:
        """Return a quantity with the parts that follow it: ``1 h 30 min``."""
        while self._now.kind == "quantity":
            whole = f"{token.text} {self._now.text}"
            if guess_value(whole)[0] is not Kind.DURATION:
                break
            self._take()
            token = Token("quantity", whole, token.position)
        return token

    def _word(self, token: Token) -> Term:
        if token.text in ("true", "false"):
            return Constant(token.text == "true", Kind.BOOLEAN, token.text, token.position)
        if self._constants is not None and token.text in self._constants:
            value = self._constants[token.text]
            text = value if isinstance(value, str) else token.text
            return Constant(value, _KIND_OF_CONSTANT[type(value)], text, token.position)
        if self._is("(") and token.text not in ("and", "or", "not", "in"):
            return self._function(token)
        raise self._bare_word(token)

    def _function(self, name: Token) -> Term:
        if name.text not in FUNCTIONS:
            other = _OTHER_FUNCTIONS.get(name.text.lower())
            names = (other,) if other is not None else closest_first(name.text, FUNCTIONS)
            valid = [f"{known}(...)" if known in FUNCTIONS else known for known in names]
            raise problem_at(name.position, f"there is no function {name.text!r}", *valid)
        arguments = self._items(self._take(), ")")
        wanted = FUNCTIONS[name.text]
        if len(arguments) != wanted:
            problem = f"{name.text} needs {wanted} value{'s' if wanted > 1 else ''}, not {len(arguments)}"
            raise problem_at(name.position, problem, f"{name.text}({', '.join(('$a', '$b')[:wanted])})")
        return Function(name.text, arguments, name.position)

    # ---- errors ---------------------------------------------------------------------------------------

    def _no_value(self, token: Token) -> ConfigError:
        if token.kind == "end":
            before = self._tokens[-2].text
            return problem_at(token.position, f"a value is missing after {before!r}", "$key", "1.5 m")
        return problem_at(token.position, f"a value is needed before {token.text!r}", "$key", "1.5 m")

    def _bare_word(self, token: Token) -> ConfigError:
        word = token.text
        lower = word.lower()
        if lower in _WORDS and lower != word:
            return problem_at(token.position, f"{word!r} is written in lower case", lower)
        if word in _WORDS:
            return problem_at(token.position, f"a value is needed before {word!r}", "$key", "true")
        close = difflib.get_close_matches(lower, _WORDS, n=1, cutoff=0.75)
        problem = f"{word!r} is neither a key nor text"
        if self._constants and word.isupper():
            problem = f"the interface names no {word}"
            return problem_at(token.position, problem, *closest_first(word, self._constants))
        skill = (f"a node, if it is a skill: {{{word}: }}",) if "_" in word else ()
        return problem_at(token.position, problem, f"${lower}", f'"{word}"', *close, *skill)

    def _left_over(self, token: Token, *wanted: str) -> ConfigError:
        if token.text in (")", "]"):
            return problem_at(token.position, f"this {token.text} closes nothing", *wanted)
        if token.kind == "word":
            close = difflib.get_close_matches(token.text.lower(), ("and", "or"), n=1, cutoff=0.5)
            operator = _OTHER_WORDS.get(token.text.lower())
            before = self._tokens[self._index - 1]
            if before.kind == "key" and any(token.text in units for units in UNITS.values()):
                operator = f"{before.text} * 1 {token.text}"
            if token.text == "not" and self._tokens[self._index + 1].text == "in":
                operator = "not $item in $list"
            valid = (operator,) if operator else tuple(close) or ("and", "or", *COMPARISONS)
            return problem_at(token.position, f"an operator is needed, not {token.text!r}", *valid)
        before = self._tokens[self._index - 1]
        if token.text == "(" and before.text.strip("${}") in FUNCTIONS:
            argument = self._tokens[self._index + 1].text
            call = f"{before.text[1:]}(${argument})" if argument.isidentifier() else f"{before.text[1:]}(...)"
            return problem_at(before.position, f"{before.text!r} is a key and no function", call)
        operators = wanted or ("and", "or", *COMPARISONS, "+", "-", "*", "/")
        return problem_at(token.position, f"an operator is missing before {token.text!r}", *operators)


def _quantity(token: Token) -> Constant:
    try:
        kind, value = guess_value(token.text)
    except ConfigError as error:
        raise problem_at(token.position, error.problem, *error.valid) from error
    if kind is Kind.TEXT:
        raise problem_at(token.position, f"{token.text!r} is not a number", "1.5", "0.5 m")
    return Constant(value, kind, token.text, token.position)
