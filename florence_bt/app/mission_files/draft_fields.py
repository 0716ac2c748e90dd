"""Fields of interfaces as a draft of a skill takes them: values, lists, times, choices, and what is none."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from florence_bt.core.answer_shape import constants_of
from florence_bt.core.declaration import Kind
from florence_bt.core.interfaces import TIME, holder_of, holds, integer_limits, item_of_array, load_interface

_KINDS = (
    *(Kind.TEXT, Kind.BOOLEAN, Kind.NUMBER, Kind.INTEGER, Kind.POSE, Kind.DURATION, Kind.ANGLE),
    *(Kind.LIST_OF_TEXT, Kind.LIST_OF_BOOLEAN, Kind.LIST_OF_NUMBER, Kind.LIST_OF_INTEGER, Kind.LIST_OF_POSE),
)
"""Kinds of a drafted field: the first of these that can hold it."""
_NO_POSE = re.compile(r"(sequence<)?geometry_msgs/Point\b.*")
"""Holds the place of a pose, and mostly is something else: a way, or the corner of a box."""
_MOST_FIELDS = 20
"""A draft takes no more fields of a part; a picture has more."""


@dataclass(frozen=True, slots=True)
class Fields:
    """The fields of a message.

    Attributes:
        kinds: Those that values can stand for, by path; deeper ones where the message has no kind.
        times: Those that are a time.
        arrays: Those that are arrays of messages, or of what has no kind, each with what can be done.
        beyond: Those that are too many for a draft.
    """

    kinds: dict[str, Kind] = field(default_factory=dict)
    times: list[str] = field(default_factory=list)
    arrays: list[str] = field(default_factory=list)
    beyond: list[str] = field(default_factory=list)

    @property
    def not_sent(self) -> tuple[str, ...]:
        """List what a draft does not send."""
        return (*self.arrays, *self.beyond)

    @property
    def not_read(self) -> tuple[str, ...]:
        """List what a draft does not read."""
        return (
            *self.arrays,
            *(f"{path} ({TIME}): no kind of value is a time" for path in self.times),
            *self.beyond,
        )

    def take(self, path: str, written: str, kind: Kind) -> None:
        """Note a field that values can stand for."""
        if len(self.kinds) < _MOST_FIELDS:
            self.kinds[path] = kind
        else:
            self.beyond.append(f"{path} ({written}): a draft takes {_MOST_FIELDS} fields")


def fields_of(message_type: Any, above: str = "", *, lists: bool) -> Fields:
    """Find the fields of a message.

    Args:
        message_type: The message.
        above: What stands before their names.
        lists: Whether each field of the items of an array is a list; else the array has no kind.
    """
    found = Fields()
    for name, written in message_type.get_fields_and_field_types().items():
        path = f"{above}{name}"
        kind = next((kind for kind in _KINDS if holds(kind, written)), None)
        item = item_of_array(written)
        if written == "std_msgs/Header":
            continue
        if kind is not None and not _NO_POSE.fullmatch(written):
            found.take(path, written, kind)
        elif written == TIME:
            found.times.append(path)
        elif "/" in written and not item:
            deeper = fields_of(_message(written), f"{path}.", lists=lists)
            for below, its_kind in deeper.kinds.items():
                found.take(below, written, its_kind)
            for ours, its in zip(_parts(found), _parts(deeper), strict=True):
                ours.extend(its)
        elif "/" in item and lists:
            deeper = fields_of(_message(item), f"{path}[*].", lists=False)
            for below, its_kind in deeper.kinds.items():
                if its_kind.item is None:
                    found.take(below, written, its_kind.list)
                else:
                    found.arrays.append(f"{below} ({its_kind.value}): a list of lists is no kind of value")
            found.arrays.extend(deeper.not_read)
        else:
            hint = "no kind of value"
            if "[*]" in path:
                hint = "a list of lists is no kind of value"
            elif "/" in item:
                hint = f"lists of its fields, as in {path}[*].FIELD"
            found.arrays.append(f"{path} ({written}): {hint}")
    return found


def _parts(fields: Fields) -> tuple[list[str], ...]:
    return fields.times, fields.arrays, fields.beyond


def _message(written: str) -> Any:
    package, name = written.split("/")
    return load_interface(f"{package}/msg/{name}")


def port_name(path: str) -> str:
    """Return the name of the input or output for a field."""
    return path.replace("[*]", "").replace(".", "_")


def choices_of(whole: Any, sent: Mapping[str, Kind]) -> dict[str, dict[str, int]]:
    """Return for fields whose values have names in the interface those names, without what they share.

    Args:
        whole: The message.
        sent: The fields.

    Returns:
        Path -> choice -> number.
    """
    found = {}
    for path, kind in sent.items():
        if kind is not Kind.INTEGER:
            continue
        holder = holder_of(whole, path)
        fields = holder.get_fields_and_field_types()
        limits = integer_limits(fields[path.rpartition(".")[2]]) or (0, 0)
        alone = sum(integer_limits(written) is not None for written in fields.values()) == 1
        named = {
            name: number
            for name, number in constants_of(holder).items()
            if limits[0] <= number <= limits[1] and (alone or _is_about(name, path.rpartition(".")[2]))
        }
        if len(named) > 1:
            shared = _shared_words(list(named))
            found[path] = {name[len(shared) :].lower(): number for name, number in named.items()}
    return found


def _is_about(constant: str, field: str) -> bool:
    """Tell whether the name of a constant begins as the name of a field, or the other way round."""
    first = constant.partition("_")[0].lower()
    return field.startswith(first) or constant.lower().startswith(f"{field}_")


def _shared_words(names: Sequence[str]) -> str:
    """Return the words that all names begin with, ``ROW_`` of ``ROW_LEFT`` and ``ROW_RIGHT``."""
    first, last = min(names), max(names)
    length = next((at for at, sign in enumerate(first) if sign != last[at]), len(first))
    return first[: first.rfind("_", 0, length) + 1]
