"""Fields of messages in expressions and texts: ``$bed.state == 2`` reads the field ``bed.state``."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterator
from functools import lru_cache
from typing import Any

from florence_bt.behaviours.keys import readable
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.interfaces import field_type, fields_below, get, kind_of_field, load_interface, part_of
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.expressions.parser import POSE_PARTS


def with_paths(
    expression: syntax.Expression, known: Container[str], type_of: Callable[[str], str | None]
) -> syntax.Expression:
    """Return an expression in which each field of a message is a key, by its path.

    Args:
        expression: An expression over a message, whose parts of keys may have any name.
        known: The keys that are no fields.
        type_of: Gives the type of a field by its path; None when there is none, or it is not known.

    Raises:
        ConfigError: A pose of those keys has no such part; with line and column.
    """
    term = expression.term
    for part in list(_fields_in(term)):
        path, root, position = _path(part)
        pose = _pose_below(part, type_of)
        if root in known:
            _check_pose_parts(part)
        elif pose is not None:
            term = syntax.replaced(term, pose, syntax.Key(_path(pose)[0], position))
        else:
            term = syntax.replaced(term, part, syntax.Key(path, position))
    return syntax.Expression(expression.text, term, expression.position)


def check_readable(message_type: Any, path: str) -> Kind:
    """Return the kind of a field in an expression or text.

    Raises:
        ConfigError: There is no such field, or it has no kind; with what would have worked.
    """
    written = field_type(message_type, path)
    kind = kind_of_field(written)
    if kind is None:
        below = [f"${each}" for each in fields_below(message_type, path)]
        items = [f"${path}[0]"] if written.endswith((">", "]")) else []
        raise ConfigError(f"{path} is of the type {written}, and no single value", valid=[*below, *items])
    return kind


def value_in(message: Any, path: str, interface: str, part: str) -> Any:
    """Read a field for an expression; an infinite number is one.

    Args:
        message: The message.
        path: The field.
        interface: The type of the interface, such as ``nav2_msgs/action/Spin``.
        part: The part of it that the message is, as of :func:`~florence_bt.core.interfaces.part_of`.

    Raises:
        ConfigError: The field or item is not there, or is no number (NaN): nothing was measured.
    """
    value = get(message, path, _kind_at(interface, part, path), any_number=True)
    if isinstance(value, float) and math.isnan(value):
        raise ConfigError(f"{path} is nan: whoever sent it has measured nothing")
    return value


def shown_in(message: Any, path: str, interface: str, part: str) -> str:
    """Read a field for people, as :func:`value_in` does; one that is not there is empty."""
    kind = _kind_at(interface, part, path)
    try:
        return readable(get(message, path, kind, any_number=True), kind)
    except ConfigError:  # an item of an array that is shorter
        return ""


@lru_cache(maxsize=1024)
def _kind_at(interface: str, part: str, path: str) -> Kind:
    return check_readable(part_of(load_interface(interface), part), path)


def _fields_in(term: syntax.Term) -> Iterator[syntax.PosePart | syntax.Item]:
    """Yield each part of a key, or of a part of one, that is as long as it can be."""
    if isinstance(term, syntax.PosePart | syntax.Item) and _path(term)[1]:
        yield term
        return
    for part in syntax.parts_of(term):
        yield from _fields_in(part)


def _path(term: syntax.Term) -> tuple[str, str, Position]:
    """Return the path of a field, the key that it begins with, and where; an empty key when it is none."""
    match term:
        case syntax.Key(key=key, position=position):
            return key, key, position
        case syntax.PosePart(pose=pose, part=part):
            path, root, position = _path(pose)
            return f"{path}.{part}", root, position
        case syntax.Item(items=items, index=syntax.Constant(value=int() as index)):
            path, root, position = _path(items)
            return f"{path}[{index}]", root, position
    return "", "", term.position


def _pose_below(term: syntax.Term, type_of: Callable[[str], str | None]) -> syntax.Term | None:
    """Return the field whose part is a number of a pose, ``$final_pose.x``; None when it is none."""
    if not isinstance(term, syntax.PosePart) or term.part not in POSE_PARTS:
        return None
    written = type_of(_path(term.pose)[0])
    return term.pose if written is not None and kind_of_field(written) is Kind.POSE else None


def _check_pose_parts(term: syntax.Term) -> None:
    """Refuse a part that no pose has: the key is an input or an output."""
    while isinstance(term, syntax.PosePart | syntax.Item):
        if isinstance(term, syntax.PosePart) and term.part not in POSE_PARTS:
            place = term.position
            problem = f"a pose has no part {term.part!r}"
            raise ConfigError(
                problem, line=place.line, column=place.column, valid=[f".{each}" for each in POSE_PARTS]
            )
        term = term.pose if isinstance(term, syntax.PosePart) else term.items
