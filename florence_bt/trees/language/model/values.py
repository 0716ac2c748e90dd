"""Values as written: literals, keys, texts with keys, poses, expressions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from florence_bt.trees.language.expressions.syntax import Expression, keys_of
from florence_bt.trees.language.source import Position


@dataclass(frozen=True, slots=True)
class Literal:
    """A value that is written out.

    Attributes:
        text: As written, ``$$`` already replaced.
        quoted: Whether it was written in quotes, and so is a text.
        position: Where it stands.
    """

    text: str
    quoted: bool
    position: Position


@dataclass(frozen=True, slots=True)
class Reference:
    """``$key``: the value of a key or of an input of the mission.

    Attributes:
        key: The key's name.
        position: Where it stands.
    """

    key: str
    position: Position


@dataclass(frozen=True, slots=True)
class Template:
    """A text with keys in it.

    Attributes:
        parts: Texts and references in order.
        position: Where it stands.
        quoted: Whether it stood in quotes, and so is certainly meant as a text.
    """

    parts: tuple[str | Reference, ...]
    position: Position
    quoted: bool = False


@dataclass(frozen=True, slots=True)
class PoseParts:
    """``{x: ..., y: ..., yaw: ...}``.

    Attributes:
        x: A length.
        y: A length.
        yaw: An angle.
        position: Where it stands.
    """

    x: Value
    y: Value
    yaw: Value
    position: Position


Value = Literal | Reference | Template | PoseParts | Expression
"""What can stand where a value is expected; an expression stands in ``${...}``."""


@dataclass(frozen=True, slots=True)
class Reasons:
    """``because``: the author's words for a node's failures.

    Attributes:
        always: The text for every failure, or None.
        by_code: Texts for failures with one code.
        position: Where it stands.
        places: Code -> where it stands.
    """

    always: Value | None
    by_code: Mapping[str, Value]
    position: Position
    places: Mapping[str, Position] = field(default_factory=dict)


def references(value: Value) -> Iterator[Reference]:
    """Every key that a value needs."""
    match value:
        case Reference():
            yield value
        case Template(parts=parts):
            yield from (part for part in parts if isinstance(part, Reference))
        case PoseParts(x=x, y=y, yaw=yaw):
            for part in (x, y, yaw):
                yield from references(part)
        case Expression(term=term):
            yield from (Reference(key.key, key.position) for key in keys_of(term))


def show(value: Value) -> str:
    """A value as the author wrote it, on one line."""
    match value:
        case Literal(text=text):
            return text
        case Reference(key=key):
            return f"${key}"
        case Template(parts=parts):
            return "".join(part if isinstance(part, str) else f"${part.key}" for part in parts)
        case PoseParts(x=x, y=y, yaw=yaw):
            return f"{{x: {show(x)}, y: {show(y)}, yaw: {show(yaw)}}}"
        case Expression(text=text):
            return f"${{{text}}}"
