"""Small changes of the text of a mission, each at one place.

What stands behind a word of the language, its record says (``trees/kinds``): where a node, an expression, a
duration or a code is expected, such a thing is changed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from florence_bt.assurance.mutating.source_text import Piece, SourceText
from florence_bt.core.declaration import CodeGroup
from florence_bt.core.units import UNITS
from florence_bt.trees import kinds
from florence_bt.trees.kinds.in_order import InOrder
from florence_bt.trees.kinds.words import MODIFIERS, NODE_KINDS
from florence_bt.trees.language import vocabulary
from florence_bt.trees.language.code_groups import ANY
from florence_bt.trees.language.model import Wrapper
from florence_bt.trees.language.value_schemas import EXPRESSION, NODE, Schema

GUARD, CLEAN_UP, HANDLER, PART, ORDER = "guard", "clean-up", "on_failure", "part", "order"
WRAPPER, COUNT, CODE, LIMIT, COMPARISON, WORD = "wrapper", "count", "code", "limit", "comparison", "word"
FAMILIES: dict[str, str] = {
    GUARD: "a `when`, `while`, `ensure`, `until` or `interrupted_by` is left out",
    CLEAN_UP: "a `finally` is left out",
    HANDLER: "an answer to a failure is left out",
    PART: "an `else`, `default`, `between`, `on` or another part that need not be there is left out",
    ORDER: "two nodes that follow each other are exchanged",
    WRAPPER: "a time-out, a loop, `succeed`, `invert` or `once` round a node is taken off",
    COUNT: "a number of rounds, or another whole number, is one more or one less",
    CODE: "a code is another one, a group of codes is one of its codes, a code is left out of a list",
    LIMIT: "a duration, length or other quantity is a tenth more",
    COMPARISON: "`<` and `<=`, `==` and `!=`, `and` and `or` are exchanged, a `not` is left out",
    WORD: "`memory`, `first_success` or `policy` says the opposite",
}
"""Kinds of changes -> what is changed."""

OTHER_CODE = "some_other_failure"
"""The code that is written in the place of an author's own."""

_OPPOSITES = {
    "<": "<=",
    "<=": "<",
    ">": ">=",
    ">=": ">",
    "==": "!=",
    "!=": "==",
    "and": "or",
    "or": "and",
}
_UNIT = "|".join(sorted({re.escape(u) for units in UNITS.values() for u in units}, key=len, reverse=True))
_NUMBER = r"\d+(?:\.\d+)?"
_QUANTITY = re.compile(rf"({_NUMBER})(\s*(?:{_UNIT}))(?![\w/])")
_WHOLE_QUANTITY = re.compile(rf"[+-]?({_NUMBER})(\s*(?:{_UNIT}))")
_WHOLE_NUMBER = re.compile(r"\d+")
_DECIMAL = re.compile(r"\d*\.\d+")
_IN_EXPRESSION = re.compile(
    rf"""(?P<text>"[^"]*"|'[^']*')|(?P<key>\$\{{?\w+\}}?)|(?P<quantity>{_NUMBER}(?:\s*(?:{_UNIT})(?![\w/]))?)"""
    r"|(?P<operator><=|>=|==|!=|<|>|\b(?:and|or)\b)|(?P<negation>\bnot\s+)|(?P<word>\w+)"
)
_FAMILIES_OF_WORDS = {**dict.fromkeys(vocabulary.ANYWHERE, GUARD), "finally": CLEAN_UP}
_UNWRAPPED = tuple(
    word for word, node in kinds.BY_WORD.items() if issubclass(node, Wrapper) and node is not kinds.ForEach
)


@dataclass(frozen=True, slots=True)
class Mutation:
    """One small change.

    Attributes:
        family: What kind of change it is, one of :data:`FAMILIES`.
        line: Where it begins, from 1.
        what: The change in words.
        text: The whole text, changed.
    """

    family: str
    line: int
    what: str
    text: str


def mutations_of(text: str, groups: Mapping[str, CodeGroup]) -> list[Mutation]:
    """Return every small change of a mission, in the order of the file; no two make the same text.

    Args:
        text: The text of the mission, in which the check finds no error.
        groups: The groups of codes.
    """
    found: dict[str, Mutation] = {}
    for each in _Mutator(text, groups).all():
        if each.text != text:
            found.setdefault(each.text, each)
    return sorted(found.values(), key=lambda each: each.line)


class _Mutator:
    """Goes through a mission and changes what it finds."""

    def __init__(self, text: str, groups: Mapping[str, CodeGroup]) -> None:
        self._source = SourceText(text)
        self._groups = groups

    def all(self) -> Iterator[Mutation]:
        """Yield the changes of the tree."""
        tree = self._source.root.get("tree")
        if tree is not None:
            yield from self._node(tree)

    def _made(self, family: str, piece: Piece, what: str, text: str | None) -> Iterator[Mutation]:
        if text is not None:
            yield Mutation(family, piece.line, what, text)

    # ---- nodes ----------------------------------------------------------------------------------------

    def _node(self, node: Piece) -> Iterator[Mutation]:
        yield from self._without_wrapper(node)
        for number, (key, value) in enumerate(node.entries):
            word = key.text or ""
            yield from self._without_word(node, number, word)
            yield from self._behind(word, value)
            kind = kinds.BY_WORD.get(word)
            if kind is not None and issubclass(kind, InOrder):
                yield from self._swaps(value)
            if word == kinds.OnFailure.kind.word:
                yield from self._handlers(value)

    def _behind(self, word: str, value: Piece) -> Iterator[Mutation]:
        """Yield the changes of what stands behind a word of a node."""
        schema = _schema_of(word)
        if schema is not None:
            yield from self._value(schema, value, word)

    def _without_wrapper(self, node: Piece) -> Iterator[Mutation]:
        words = [key.text for key, _ in node.entries]
        word = next((each for each in words if each in _UNWRAPPED), None)
        if word is None:
            return
        own = {word, "do", "code", "name", *(each.word for each in kinds.BY_WORD[word].kind.modifiers)}
        inner = node.get("do") or node.get(word)
        if inner is not None and inner.entries and own.issuperset(words):
            text = self._source.unwrapped(node, inner)
            yield from self._made(WRAPPER, node, f"`{word}` is taken off", text)

    def _without_word(self, node: Piece, number: int, word: str) -> Iterator[Mutation]:
        key, value = node.entries[number]
        if (
            word in ("name", "because", "code", "out")
            or word in NODE_KINDS
            or value.text in ("true", "false")
        ):
            return
        modifier = MODIFIERS.get(word)
        if word in vocabulary.ANYWHERE:
            family = HANDLER if word == "on_failure" else _FAMILIES_OF_WORDS[word]
            if word == "on_failure" and len(value.entries) > 1:
                return  # each of them is left out by itself
        elif modifier is not None and not modifier.names_key and not _is_needed(word):
            family = PART
        else:
            return
        text = self._source.without_entry(node, number)
        yield from self._made(family, key, f"`{word}` is left out", text)

    def _swaps(self, children: Piece) -> Iterator[Mutation]:
        for first, second in zip(children.items, children.items[1:], strict=False):
            text = self._source.swapped(first, second)
            yield from self._made(ORDER, first, "it is exchanged with the next one", text)

    def _handlers(self, handlers: Piece) -> Iterator[Mutation]:
        for number, (code, _) in enumerate(handlers.entries):
            if len(handlers.entries) > 1:
                text = self._source.without_entry(handlers, number)
                yield from self._made(HANDLER, code, f"the answer to {code.text} is left out", text)
            if ANY not in [other.text for other, _ in handlers.entries]:
                yield from self._wanted_code(code)

    # ---- values, as their schema says -----------------------------------------------------------------

    def _value(self, schema: Schema, value: Piece, word: str) -> Iterator[Mutation]:
        if schema == NODE and value.entries:
            yield from self._node(value)
        elif schema == EXPRESSION and value.text is not None:
            yield from self._expression(value)
        elif "anyOf" in schema:
            option = next((each for each in schema["anyOf"] if _fits(each, value)), None)
            if option is not None:
                yield from self._value(option, value, word)
        elif "$ref" in schema:
            yield from self._referred(schema["$ref"].rsplit("/", 1)[-1], value)
        elif "enum" in schema:
            yield from self._other_words(schema["enum"], value, word)
        else:
            yield from self._typed(schema, value, word)

    def _typed(self, schema: Schema, value: Piece, word: str) -> Iterator[Mutation]:
        types = schema.get("type", ())
        if "array" in types:
            for item in value.items:
                yield from self._value(schema.get("items", {}), item, word)
            if schema.get("items") != NODE:
                yield from self._without_items(value, word)
        elif "object" in types:
            for key, below in value.entries:
                yield from self._value(_schema_of_key(schema, key.text or ""), below, word)
        elif types == "boolean":
            yield from self._other_words(("true", "false"), value, word)
        elif types == "integer" or not schema:
            yield from self._any(value)

    def _referred(self, name: str, value: Piece) -> Iterator[Mutation]:
        if name == "wanted_code":
            yield from self._wanted_code(value)
        elif name == "code" and value.text is not None:
            text = self._source.replaced(value, OTHER_CODE)
            yield from self._made(CODE, value, f"the code {value.text} is another one", text)
        elif name not in ("node", "expression"):
            yield from self._any(value)

    def _any(self, value: Piece) -> Iterator[Mutation]:
        """Yield the changes of a value of any kind: numbers, quantities, expressions, what a list holds."""
        for part in (*value.items, *(below for _, below in value.entries)):
            yield from self._any(part)
        if value.text is None:
            return
        if value.text.startswith("${"):
            yield from self._expression(value)
        elif value.plain and _WHOLE_NUMBER.fullmatch(value.text):
            yield from self._counts(value, int(value.text))
        elif _WHOLE_QUANTITY.fullmatch(value.text) or _DECIMAL.fullmatch(value.text):
            new = _more(value.text)
            what = f"{value.text} becomes {new}"
            yield from self._made(LIMIT, value, what, self._in_place(value, value.text, new))

    def _counts(self, value: Piece, number: int) -> Iterator[Mutation]:
        for other in (number + 1, number - 1):
            if other > 0:
                text = self._source.replaced(value, str(other))
                yield from self._made(COUNT, value, f"{number} becomes {other}", text)

    def _other_words(self, words: Any, value: Piece, word: str) -> Iterator[Mutation]:
        if value.text in words:
            other = next(each for each in words if each != value.text)
            what = f"`{word}: {value.text}` becomes `{other}`"
            yield from self._made(WORD, value, what, self._source.replaced(value, other))

    def _without_items(self, value: Piece, word: str) -> Iterator[Mutation]:
        if len(value.items) < 2:
            return
        for number, item in enumerate(value.items):
            family = CODE if _names_codes(word) else WORD
            text = self._source.without_item(value, number)
            yield from self._made(family, item, f"{item.text} is left out of `{word}`", text)

    def _wanted_code(self, value: Piece) -> Iterator[Mutation]:
        group = self._groups.get(value.text or "")
        if group is not None:
            code = min(group.codes)
            text = self._source.replaced(value, code)
            yield from self._made(CODE, value, f"the group {value.text} becomes its code {code}", text)
        elif value.text not in (None, ANY):
            text = self._source.replaced(value, ANY)
            yield from self._made(CODE, value, f"the code {value.text} becomes {ANY}", text)

    # ---- expressions ----------------------------------------------------------------------------------

    def _expression(self, value: Piece) -> Iterator[Mutation]:
        """Yield the changes of an expression, which stands in the file exactly as it is read."""
        assert value.text is not None
        for match in _IN_EXPRESSION.finditer(value.text):
            part = match[0]
            if match["operator"]:
                yield from self._changed_part(COMPARISON, value, match, _OPPOSITES[part])
            elif match["negation"]:
                yield from self._changed_part(COMPARISON, value, match, "")
            elif match["quantity"]:
                yield from self._changed_part(LIMIT, value, match, _more(part))

    def _changed_part(self, family: str, value: Piece, match: re.Match[str], new: str) -> Iterator[Mutation]:
        assert value.text is not None
        changed = value.text[: match.start()] + new + value.text[match.end() :]
        what = f"{match[0].strip()} becomes {new}" if new else f"{match[0].strip()} is left out"
        yield from self._made(family, value, what, self._in_place(value, value.text, changed))

    def _in_place(self, value: Piece, old: str, new: str) -> str | None:
        """Write a scalar anew with its quotes; None when it does not stand in one line as it is read."""
        written = self._source.text[value.start : value.end]
        return self._source.replaced(value, written.replace(old, new)) if written.count(old) == 1 else None


def _schema_of(word: str) -> Schema | None:
    """Return what may stand behind a word of a node; None where nothing is changed."""
    if word in kinds.BY_WORD:
        return {**kinds.BY_WORD[word].kind.value}
    if word in kinds.OF_MODIFIERS:
        return {**kinds.OF_MODIFIERS[word].kind.value}
    if word in vocabulary.GUARDS:
        return EXPRESSION
    if word == "finally":
        return NODE
    if word in ("name", "because", "out"):
        return None
    return {**MODIFIERS[word].value} if word in MODIFIERS else {"type": "object"}  # the inputs of a skill


def _schema_of_key(schema: Schema, key: str) -> Schema:
    known: Schema | None = schema.get("properties", {}).get(key)
    if known is not None:
        return known
    further = schema.get("additionalProperties")
    return further if isinstance(further, dict) else {}


def _fits(schema: Schema, value: Piece) -> bool:
    """Tell whether one of several schemas is the one for a piece, by its form."""
    if schema == NODE:
        return bool(value.entries)
    if schema.get("type") == "object":
        return bool(value.entries)
    if schema.get("type") == "array":
        return bool(value.items)
    if "const" in schema:
        return value.text == str(schema["const"])
    if "enum" in schema:
        return value.text in schema["enum"]
    if schema.get("type") == "integer":
        return value.text is not None and _WHOLE_NUMBER.fullmatch(value.text) is not None
    return value.text is not None


def _is_needed(word: str) -> bool:
    return any(word in node.kind.needed for node in kinds.ALL) or word in ("then", "cases", "with", "do")


def _names_codes(word: str) -> bool:
    return "wanted_code" in str(MODIFIERS[word].value) if word in MODIFIERS else False


def _more(quantity: str) -> str:
    """Return a quantity that is a tenth more; a whole number without a unit is one more."""
    match = re.match(_NUMBER, quantity.lstrip("+-"))
    assert match is not None
    number, rest = match[0], quantity.lstrip("+-")[match.end() :]
    sign = quantity[: len(quantity) - len(quantity.lstrip("+-"))]
    if not rest and _WHOLE_NUMBER.fullmatch(number):
        return f"{sign}{int(number) + 1}"
    return f"{sign}{round(float(number) * 1.1, 6) or 1:g}{rest}"
