"""The shape of an answer: which of its fields says that the server refused, and which says why.

Interfaces of other people have no field for that in common, but a form: a flag, or a number with named
values, and a text. The names of the fields only tell which flag it is where there are several, and whether
true is a yes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from florence_bt.core.interfaces import load_interface

_YES = frozenset(
    (
        *(
            "accepted",
            "allowed",
            "approved",
            "completed",
            "confirmed",
            "done",
            "finished",
            "found",
            "granted",
        ),
        *("ok", "okay", "reached", "ready", "result", "succeeded", "success", "successful", "valid"),
    )
)
_NO = frozenset(
    (
        *("aborted", "blocked", "busy", "canceled", "cancelled", "denied", "error", "fail", "failed"),
        *("failure", "fault", "faulty", "invalid", "refused", "rejected", "timeout", "unavailable"),
    )
)
_NOT = frozenset(("no", "not", "without", "never"))
_CODE = frozenset(("code", "errno", "error"))
"""Parts of names of flags that are true for a yes, of those that are true for a no, of words that turn the
meaning round, and of integers that say what went wrong."""
_WORDS = ("error_msg", "error_message", "message", "status_message", "reason", "note", "why")
"""Fields that have the server's own words, wherever they stand."""
_FINE = re.compile(r"(?:.*_)?(?:OK|NONE|SUCCESS|SUCCEEDED|NO_ERROR)")
"""Constants that name no failure."""
_INTEGER = re.compile(r"u?int\d+")


@dataclass(frozen=True, slots=True)
class AnswerShape:
    """The fields of an answer that say how it went.

    Attributes:
        flag: The field that is true or false; empty without.
        denies: Whether a true flag is a refusal.
        flags: Every field that is true or false.
        code: The integer that says what went wrong; empty without.
        fine: The values of the code that name no failure.
        failures: Code by name, of the other values that the type names.
        words: The text with the server's own words; empty without.
        words_only: Whether nothing else than such words can stand there, by its name.
    """

    flag: str = ""
    denies: bool = False
    flags: tuple[str, ...] = ()
    code: str = ""
    fine: tuple[int, ...] = (0,)
    failures: Mapping[str, int] = field(default_factory=dict)
    words: str = ""
    words_only: bool = False

    @property
    def refusal(self) -> str:
        """The expression that holds when the flag says no; empty without a flag."""
        if not self.flag:
            return ""
        return f"${self.flag}" if self.denies else f"not ${self.flag}"

    @property
    def mishap(self) -> str:
        """The expression that holds when the code names no success, known to the type or not."""
        return " and ".join(f"${self.code} != {number}" for number in self.fine) if self.code else ""


def shape_of(message_type: Any) -> AnswerShape:
    """Return the shape of a response or a result; of a message in it, when it has no flag or code itself."""
    shape = _shape_of(message_type)
    if shape.flag or shape.code:
        return shape
    for name, written in message_type.get_fields_and_field_types().items():
        if re.fullmatch(r"\w+/\w+", written) and not written.startswith("std_msgs/Header"):
            package, last = written.split("/")
            inner = load_interface(f"{package}/msg/{last}")
            below = _shape_of(inner)
            alone = len(inner.get_fields_and_field_types()) == 2
            if below.flag and below.words and (alone or _parts(below.flag) & (_YES | _NO)):
                return replace(
                    shape,
                    flag=f"{name}.{below.flag}",
                    denies=below.denies,
                    words=f"{name}.{below.words}",
                    words_only=True,
                )
    return shape


def _shape_of(message_type: Any) -> AnswerShape:
    all_fields: Mapping[str, str] = message_type.get_fields_and_field_types()
    fields = {name: written for name, written in all_fields.items() if written != "std_msgs/Header"}
    flags = tuple(name for name, written in fields.items() if written == "boolean")
    texts = [name for name, written in fields.items() if re.fullmatch(r"w?string(<\d+>)?", written)]
    flag = _flag(flags, bool(texts), len(fields))
    constants = constants_of(message_type)
    integers = [name for name, written in fields.items() if _INTEGER.fullmatch(written)]
    code = next((name for name in integers if _parts(name) & _CODE), "")
    if not code and not flag and len(integers) == 1 and constants:
        code = integers[0]
    words = next((name for name in _WORDS if name in texts), "")
    known = bool(words)
    if not words and (flag or code) and len(texts) == 1:
        words = texts[0]
    fine = {number for name, number in constants.items() if _FINE.fullmatch(name)} if code else set()
    failures = {
        name: number
        for name, number in constants.items()
        if code and number not in (fine or {0}) and not _FINE.fullmatch(name)
    }
    return AnswerShape(
        flag, _denies(flag), flags, code, tuple(sorted(fine)) or (0,), failures, words, words_only=known
    )


def constants_of(message_type: Any) -> dict[str, int]:
    """Return the integer constants that a type names, by their values."""
    names = [name for name in dir(type(message_type)) if name.isupper() and not name.startswith("_")]
    values = {name: getattr(message_type, name) for name in names}
    found = {name: value for name, value in values.items() if isinstance(value, int)}
    return dict(sorted(found.items(), key=lambda pair: pair[1]))


def constants_below(message_type: Any) -> dict[str, int]:
    """Return the constants of a type and of all messages in it; without names that mean several numbers."""
    found: dict[str, set[int]] = {}
    for each in _types_below(message_type, set()):
        for name, number in constants_of(each).items():
            found.setdefault(name, set()).add(number)
    return {name: min(numbers) for name, numbers in found.items() if len(numbers) == 1}


def _types_below(message_type: Any, seen: set[str]) -> Iterator[Any]:
    yield message_type
    for written in message_type.get_fields_and_field_types().values():
        nested = re.search(r"(\w+)/(\w+)", written)
        if nested is not None and nested[0] not in seen:
            seen.add(nested[0])
            yield from _types_below(load_interface(f"{nested[1]}/msg/{nested[2]}"), seen)


def _flag(flags: tuple[str, ...], with_text: bool, fields: int) -> str:
    """Return the flag that says yes or no: by its name, or as the only one beside a text or alone."""
    known = [name for name in flags if _parts(name) & (_YES | _NO)]
    if known:
        return known[0]
    return flags[0] if len(flags) == 1 and (with_text or fields == 1) else ""


def _denies(flag: str) -> bool:
    parts = _parts(flag)
    return bool(parts & _NO) is not bool(parts & _NOT)


def _parts(name: str) -> frozenset[str]:
    return frozenset(name.lower().split("_"))
