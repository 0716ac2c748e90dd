"""Fields of messages in expressions and texts: ``$bed.state == 2`` reads the field ``bed.state``."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from florence_bt.behaviours.keys import KeyReference, KeyStore, readable
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.interfaces import (
    field_type,
    fields_below,
    get,
    integer_limits,
    item_of_array,
    kind_of_field,
    load_interface,
    part_of,
)
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.expressions.checking import KindProblem
from florence_bt.trees.language.expressions.parser import POSE_PARTS
from florence_bt.trees.language.model import Reference, Template

_STEP = re.compile(r"\.[a-z]\w*|\[\d+\]")
"""From a field to one below it, or to an item."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """The number that a choice stands for.

    Attributes:
        choice: Gives the text.
        numbers: Choice -> number.
    """

    choice: KeyReference
    numbers: Mapping[str, int]

    def resolve(self, keys: KeyStore) -> int:
        """Return the number of what is chosen now.

        Raises:
            ValueProblem: There is no value; KeyError when it is no choice.
        """
        return self.numbers[self.choice.resolve(keys)]


def numbers_of(choices: Iterable[str], constants: Mapping[str, int], field: str) -> dict[str, int]:
    """Return which constant of an interface each choice is: of its name, or of the end of it.

    Args:
        choices: The choices.
        constants: The constants.
        field: The field, whose name begins those that count where several end alike.

    Raises:
        ConfigError: A choice is no constant, or may be several; with those that there are.
    """
    found: dict[str, int] = {}
    for choice in choices:
        word = choice.upper().replace("-", "_").replace(" ", "_")
        names = [name for name in constants if name == word or name.endswith(f"_{word}")]
        names = [name for name in names if name == word or name.startswith(field.upper())] or names
        if len({constants[name] for name in names}) != 1:
            many = " and ".join(names)
            problem = f"{choice!r} is {many}" if names else f"the interface names no {word}"
            raise ConfigError(problem, valid=names or closest_first(word, constants))
        found[choice] = constants[names[0]]
    return found


class AnyConstant(dict[str, int]):
    """The constants of an interface that is not installed: every name in capitals may be one."""

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name.isupper()

    def __missing__(self, name: str) -> int:
        return 0


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

    def changed(term: syntax.Term) -> syntax.Term:
        path, root, position = _path(term)
        if not root or isinstance(term, syntax.Key):
            return syntax.with_parts(term, changed)
        if root in known:
            _check_pose_parts(term)
            return term
        if isinstance(term, syntax.PosePart) and _is_pose_part(term, type_of):
            return replace(term, pose=syntax.Key(_path(term.pose)[0], position))
        return syntax.Key(path, position)

    return syntax.Expression(expression.text, changed(expression.term), expression.position)


def paths_in_text(text: Template | Reference, kind_of: Callable[[str], Kind | None]) -> Template:
    """Return a text in which each field of a field is a key, by its path: ``$state.axis``.

    Args:
        text: The text; what follows a key that has a kind of its own is text.
        kind_of: Gives the kind of a field by its path; None when it has none, or there is no such field.
    """
    parts: list[str | Reference] = list(text.parts) if isinstance(text, Template) else [text]
    for number, part in enumerate(parts):
        while not isinstance(part, str) and kind_of(part.key) is None and number + 1 < len(parts):
            after = parts[number + 1]
            step = _STEP.match(after) if isinstance(after, str) else None
            if step is None or not isinstance(after, str):
                break
            part = replace(part, key=part.key + step[0])
            parts[number], parts[number + 1] = part, after[step.end() :]
    return Template(tuple(part for part in parts if part != ""), text.position)


def never_held(
    expression: syntax.Expression, type_of: Callable[[str], str | None], known: Container[str]
) -> Iterator[KindProblem]:
    """Yield comparisons of an integer field with a number that it has no room for: they never change."""
    for term in syntax.walk(expression.term):
        if not isinstance(term, syntax.Binary):
            continue
        for field, value in ((term.left, term.right), (term.right, term.left)):
            if (
                not isinstance(field, syntax.Key)
                or not isinstance(value, syntax.Constant)
                or field.key in known
            ):
                continue
            limits = integer_limits(type_of(field.key) or "")
            number = value.value
            if limits is not None and isinstance(number, int) and not limits[0] <= number <= limits[1]:
                message = f"{field.key} is {limits[0]} to {limits[1]}, and never {number}"
                yield KindProblem(value.position, message, ())


def check_readable(message_type: Any, path: str) -> Kind:
    """Return the kind of a field in an expression or text.

    Raises:
        ConfigError: There is no such field, or it has no kind; with what would have worked.
    """
    written = field_type(message_type, path)
    kind = kind_of_field(written)
    if kind is None:
        below = [f"${each}" for each in fields_below(message_type, path)]
        valid = [*below, *(_of_items(message_type, path) if item_of_array(written) else ())]
        raise ConfigError(f"{path} is of the type {written}, and no single value", valid=valid)
    return kind


def _of_items(message_type: Any, path: str) -> Iterator[str]:
    """Suggest how a field of an array of messages is read: of one item, and of all by an output."""
    for below in fields_below(message_type, f"{path}[0]"):
        every = below.replace("[0]", "[*]")
        kind = kind_of_field(field_type(message_type, every))
        if kind is not None and "[*]" not in path:
            yield f"${below}"
            name = every.replace("[*]", "").replace(".", "_")
            yield f"outputs: {{{name}: {{type: {kind.value}, from: '{every}'}}}}, and ${name}"


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


def _is_pose_part(term: syntax.PosePart, type_of: Callable[[str], str | None]) -> bool:
    """Tell whether a part is a number of a field that is a pose: ``$final_pose.x``."""
    written = type_of(_path(term.pose)[0])
    is_pose = written is not None and kind_of_field(written) is Kind.POSE
    return is_pose and term.part in POSE_PARTS


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
