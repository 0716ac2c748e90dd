"""Expressions as written: an immutable syntax tree with the position of every part, and back to text."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from florence_bt.core.declaration import Kind
from florence_bt.core.plain_yaml import Position


@dataclass(frozen=True, slots=True)
class Constant:
    """A value that is written out: ``0.5 m``, ``"kitchen"``, ``true``.

    Attributes:
        value: The value in SI units.
        kind: What it is.
        text: As written; a text without its quotes.
        position: Where it begins.
    """

    value: Any
    kind: Kind
    text: str
    position: Position


@dataclass(frozen=True, slots=True)
class Key:
    """``$key``: the value of a key.

    Attributes:
        key: The key's name.
        position: Where it begins, at the dollar sign.
    """

    key: str
    position: Position


@dataclass(frozen=True, slots=True)
class PosePart:
    """``$pose.x``: a number of a pose.

    Attributes:
        pose: What it is a part of.
        part: ``x``, ``y`` or ``yaw``.
        position: Where the name of the part stands.
    """

    pose: Term
    part: str
    position: Position


@dataclass(frozen=True, slots=True)
class Item:
    """``$rooms[0]``: an item of a list, counted from 0.

    Attributes:
        items: The list.
        index: Which item.
        position: Where the bracket stands.
    """

    items: Term
    index: Term
    position: Position


@dataclass(frozen=True, slots=True)
class Unary:
    """``not a`` and ``-a``.

    Attributes:
        operator: ``not`` or ``-``.
        operand: What it works on.
        position: Where the operator stands.
    """

    operator: str
    operand: Term
    position: Position


@dataclass(frozen=True, slots=True)
class Binary:
    """An operator between two operands.

    Attributes:
        operator: ``or and in == != < <= > >= + - * /``.
        left: The first operand.
        right: The second operand.
        position: Where the operator stands.
    """

    operator: str
    left: Term
    right: Term
    position: Position


@dataclass(frozen=True, slots=True)
class Function:
    """``min($a, $b)``.

    Attributes:
        name: ``abs``, ``min``, ``max``, ``count`` or ``distance``.
        arguments: What it is given.
        position: Where the name stands.
    """

    name: str
    arguments: tuple[Term, ...]
    position: Position


@dataclass(frozen=True, slots=True)
class Listed:
    """``["yes", $other]``: a list that is written out.

    Attributes:
        items: Its items.
        position: Where the bracket stands.
    """

    items: tuple[Term, ...]
    position: Position


Term = Constant | Key | PosePart | Item | Unary | Binary | Function | Listed


@dataclass(frozen=True, slots=True)
class Expression:
    """A whole expression.

    Attributes:
        text: As the author wrote it, on one line, without ``${`` and ``}``.
        term: The syntax tree.
        position: Where it begins.
        keys: The names of the keys that it reads, each once, in the order of the text.
    """

    text: str
    term: Term
    position: Position
    keys: tuple[str, ...] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Look for the keys once: every check asks for them."""
        object.__setattr__(self, "keys", tuple(dict.fromkeys(key.key for key in keys_of(self.term))))


def parts_of(term: Term) -> tuple[Term, ...]:
    """Return the terms directly below a term."""
    match term:
        case PosePart(pose=pose):
            return (pose,)
        case Item(items=items, index=index):
            return (items, index)
        case Unary(operand=operand):
            return (operand,)
        case Binary(left=left, right=right):
            return (left, right)
        case Function(arguments=arguments):
            return arguments
        case Listed(items=items):
            return items
    return ()


def walk(term: Term) -> Iterator[Term]:
    """Yield a term with everything below it."""
    yield term
    for part in parts_of(term):
        yield from walk(part)


def with_parts(term: Term, change: Callable[[Term], Term]) -> Term:
    """Return a term with each of the terms directly below it changed."""
    match term:
        case PosePart(pose=pose):
            return replace(term, pose=change(pose))
        case Item(items=items, index=index):
            return replace(term, items=change(items), index=change(index))
        case Unary(operand=operand):
            return replace(term, operand=change(operand))
        case Binary(left=left, right=right):
            return replace(term, left=change(left), right=change(right))
        case Function(arguments=arguments):
            return replace(term, arguments=tuple(map(change, arguments)))
        case Listed(items=items):
            return replace(term, items=tuple(map(change, items)))
    return term


def replaced(term: Term, old: Term, new: Term) -> Term:
    """Return a term with another one in place of one of its parts."""
    return new if term is old else with_parts(term, lambda part: replaced(part, old, new))


def keys_of(term: Term) -> Iterator[Key]:
    """Yield every mention of a key in a term, from left to right."""
    if isinstance(term, Key):
        yield term
    for part in parts_of(term):
        yield from keys_of(part)


def start_of(term: Term) -> Position:
    """Return where the text of a term begins; an opening parenthesis is not counted."""
    match term:
        case Binary(left=left):
            return start_of(left)
        case PosePart(pose=pose):
            return start_of(pose)
        case Item(items=items):
            return start_of(items)
    return term.position


_LOOSENESS = {"or": 1, "and": 2, "not": 3, "+": 5, "-": 5, "*": 6, "/": 6}
_COMPARISON = 4
_MINUS = 7
_TIGHT = 8
"""Places in the order of :data:`_LOOSENESS`, a higher one binding tighter."""


def print_term(term: Term) -> str:
    """Print a term as an author would write it.

    Args:
        term: Any part of an expression.

    Returns:
        The text; constants stand as they were written.
    """
    return _print(term)[0]


def _print(term: Term) -> tuple[str, int]:
    """Print a term, and tell how tightly it holds together."""
    match term:
        case Constant(kind=Kind.TEXT, text=text):
            return (f"'{text}'" if '"' in text else f'"{text}"'), _TIGHT
        case Constant(text=text):
            return text, _TIGHT
        case Key(key=key):
            return f"${key}", _TIGHT
        case PosePart(pose=pose, part=part):
            return f"{_at_least(pose, _TIGHT)}.{part}", _TIGHT
        case Item(items=items, index=index):
            return f"{_at_least(items, _TIGHT)}[{print_term(index)}]", _TIGHT
        case Unary(operator="not", operand=operand):
            return f"not {_at_least(operand, _LOOSENESS['not'])}", _LOOSENESS["not"]
        case Unary(operand=operand):
            return f"-{_at_least(operand, _MINUS)}", _MINUS
        case Function(name=name, arguments=arguments):
            return f"{name}({', '.join(print_term(argument) for argument in arguments)})", _TIGHT
        case Listed(items=items):
            return f"[{', '.join(map(print_term, items))}]", _TIGHT
        case Binary(operator=operator, left=left, right=right):
            own = _LOOSENESS.get(operator, _COMPARISON)
            # Chains lean to the left; comparisons make no chains.
            loosest_left = own + 1 if own == _COMPARISON else own
            return f"{_at_least(left, loosest_left)} {operator} {_at_least(right, own + 1)}", own


def _at_least(term: Term, tightness: int) -> str:
    text, own = _print(term)
    return text if own >= tightness else f"({text})"
