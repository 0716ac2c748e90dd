"""The shape of an answer: which of its fields says that the server refused, and which says why.

Interfaces of other people have no field for that in common, but a form: a flag, a number or a text with named
values, a text that is empty when all went well, one of these for each of several things; and a text beside
it. The names of the fields only tell which of several it is, and whether true is a yes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from florence_bt.core.interfaces import item_of_array, load_interface

Number = int | float | str | bool
"""The value of a constant."""
_YES = frozenset(
    (
        *("accepted", "ack", "allowed", "approved", "completed", "confirmed", "done", "finished", "found"),
        *(
            "granted",
            "ok",
            "okay",
            "reached",
            "ready",
            "result",
            "succeeded",
            "success",
            "successful",
            "valid",
        ),
    )
)
_NO = frozenset(
    (
        *("aborted", "blocked", "busy", "canceled", "cancelled", "denied", "error", "fail", "failed"),
        *("failure", "fault", "faulty", "invalid", "refused", "rejected", "timeout", "unavailable"),
    )
)
_NOT = frozenset(("no", "not", "without", "never"))
_CODE = frozenset(
    (
        *("code", "errcode", "errno", "error", "errors", "failures", "faults"),
        *("rc", "ret", "retcode", "retval"),
    )
)
_VERDICT = frozenset(("answer", "outcome", "result", "status", "verdict"))
_TROUBLE = frozenset(
    ("error", "errors", "err", "failure", "failures", "fault", "faults", "problem", "problems")
)
"""Parts of names: of flags that are true for a yes, of those that are true for a no, of words that turn the
meaning round, of numbers that say what went wrong, of values that say how it went, and of texts that say what
went wrong."""
_WORDS = ("error_msg", "error_message", "message", "status_message", "reason", "note", "why")
"""Fields that have the server's own words, wherever they stand."""
_WELL = frozenset(
    (*("fine", "good", "nominal", "none", "normal"), *_YES - {"result", "found"}),
)
_FINE = re.compile(r"(?:.*_)?NO_(?:ERROR|ERRORS|FAULT|FAILURE|PROBLEM)")
_BAD = _NO | {"err", "nack", "nak", "no", "reject", "refuse", "unknown"}
"""Last words of constants that name no failure, whole ones, and words of those that do."""
_INTEGER = re.compile(r"u?int\d+")
_TEXT = re.compile(r"w?string(<\d+>)?")
_MESSAGE = re.compile(r"\w+/\w+")
_DEEPEST = 3
"""Messages in messages are looked at down to here."""


@dataclass(frozen=True, slots=True)
class AnswerShape:
    """The fields of an answer that say how it went.

    Attributes:
        flag: The one field that is true or false; empty without.
        denies: Whether a true flag is a refusal, also of ``many``.
        flags: Every field that is true or false.
        many: The flags of several things, as ``results[*].success``; empty without.
        trouble: The text, or the list of texts, that is empty when all went well; empty without.
        trouble_is_list: Whether that is a list.
        code: The number or text that says what went wrong; empty without.
        fine: The values of the code that name no failure.
        failures: Code by name, of the other values that the type names.
        guessed: Whether nothing but the name of the code tells that it is one, and which values are fine.
        words: The text with the server's own words; empty without.
        words_only: Whether nothing else than such words can stand there, by its name.
    """

    flag: str = ""
    denies: bool = False
    flags: tuple[str, ...] = ()
    many: str = ""
    trouble: str = ""
    trouble_is_list: bool = False
    code: str = ""
    fine: tuple[Number, ...] = (0,)
    failures: Mapping[str, Number] = field(default_factory=dict)
    guessed: bool = False
    words: str = ""
    words_only: bool = False

    @property
    def signs(self) -> tuple[str, ...]:
        """The fields of which each says how it went, one of which is enough; the first is the best."""
        code = self.code if _parts(self.code.replace(".", "_")) & (_CODE | _VERDICT) else ""
        return tuple(filter(None, (self.flag, self.many, self.trouble, code)))

    @property
    def no(self) -> str:
        """The expression that holds when the answer is a no, however it says so; empty when it never is."""
        return self.refusal or self.mishap

    @property
    def refusal(self) -> str:
        """The expression that holds when the server says no; empty where only a code tells it."""
        if self.flag:
            return f"${self.flag}" if self.denies else f"not ${self.flag}"
        if self.many:
            return f"{'true' if self.denies else 'false'} in ${self.many}"
        if self.trouble:
            return f"count(${self.trouble}) > 0" if self.trouble_is_list else f'${self.trouble} != ""'
        return ""

    @property
    def mishap(self) -> str:
        """The expression that holds when the code names no success, known to the type or not."""
        if not self.code:
            return ""
        if len(self.fine) == 1:
            return f"${self.code} != {written(self.fine[0])}"
        return f"not ${self.code} in [{', '.join(map(written, self.fine))}]"


def written(value: Number) -> str:
    """Return a value as an expression has it."""
    return f'"{value}"' if isinstance(value, str) else str(value)


def shape_of(message_type: Any) -> AnswerShape:
    """Return the shape of a response or a result; of a message in it, when it has no such field itself."""
    return _shape_below(message_type, _DEEPEST)


def _shape_below(message_type: Any, deepest: int) -> AnswerShape:
    shape = _shape_of(message_type)
    if deepest == 0 or (shape.signs and not shape.guessed):
        return shape
    for name, kind in _fields(message_type).items():
        item = item_of_array(kind)
        inner = _message(item or kind)
        if inner is None:
            continue
        below = _shape_below(inner, deepest - 1)
        if item and _says_how_it_went(below, inner) and below.flag:
            return replace(shape, many=f"{name}[*].{below.flag}", denies=below.denies, code="", guessed=False)
        about = (_parts(name) | _last_words(below.code)) & (_CODE | _VERDICT)
        if not item and (below.flag or about) and _says_how_it_went(below, inner):
            return _within(name, below, shape.flags)
    return shape


def _says_how_it_went(shape: AnswerShape, message_type: Any) -> bool:
    """Tell whether a message in an answer is about the answer, and not about a thing of the world."""
    if shape.flag:
        alone = len(_fields(message_type)) == 2
        return bool(shape.words) and (alone or bool(_last_words(shape.flag) & (_YES | _NO)))
    known = any(map(_is_fine, constants_of(message_type))) or bool(_last_words(shape.code) & _CODE)
    return bool(shape.code) and not shape.guessed and known


def _within(name: str, shape: AnswerShape, flags: tuple[str, ...]) -> AnswerShape:
    """Return the shape of a message that is the field of another one."""

    def of(path: str) -> str:
        return f"{name}.{path}" if path else ""

    return replace(
        shape,
        flag=of(shape.flag),
        flags=flags,
        many=of(shape.many),
        trouble=of(shape.trouble),
        code=of(shape.code),
        words=of(shape.words),
        words_only=True,
    )


def _shape_of(message_type: Any) -> AnswerShape:
    fields = _fields(message_type)
    flags = tuple(name for name, kind in fields.items() if kind == "boolean")
    texts = [name for name, kind in fields.items() if _TEXT.fullmatch(kind)]
    flag = _flag(flags, bool(texts), len(fields))
    shape = AnswerShape(flag, _denies(flag), flags)
    shape = _with_code(shape, message_type)
    if not shape.flag and (not shape.code or shape.guessed):
        shape = _with_others(shape, fields)
    words = next((name for name in _WORDS if name in texts), "")
    known = bool(words)
    others = [name for name in texts if name != shape.code]
    if not words and (shape.trouble in texts or ((shape.signs or shape.code) and len(others) == 1)):
        words = shape.trouble if shape.trouble in texts else others[0]
    if not words and shape.trouble_is_list:
        words = f"{shape.trouble}[0]"
    if not words and shape.guessed and shape.code in texts:
        words = shape.code
    return replace(shape, words=words, words_only=known)


def _with_code(shape: AnswerShape, message_type: Any) -> AnswerShape:
    """Add the number, or the text of named values, that says what went wrong."""
    fields = _fields(message_type)
    for kind_of_value, fits in ((int, _INTEGER), (str, _TEXT)):
        names = [name for name, kind in fields.items() if fits.fullmatch(kind)]
        constants = constants_of(message_type, kind_of_value)
        code = next((name for name in names if _parts(name) & _CODE), "") if kind_of_value is int else ""
        told = [name for name in names if _parts(name) & _VERDICT]
        if not code and not shape.flag and constants:
            code = names[0] if len(names) == 1 else next(iter(told), "")
        if code:
            return _coded(shape, code, _about(constants, code, fields), kind_of_value)
    told = [name for name, kind in fields.items() if _parts(name) & _VERDICT and _is_value(kind)]
    if told and not shape.flag:
        number = _INTEGER.fullmatch(fields[told[0]]) is not None
        return replace(shape, code=told[0], fine=(0,) if number else _USUAL, guessed=True)
    return shape


_USUAL = ("OK", "ok", "SUCCESS", "success", "DONE", "done")
"""Words of servers for success, in a text."""


def _coded(shape: AnswerShape, code: str, constants: Mapping[str, Any], kind_of_value: type) -> AnswerShape:
    fine = {value for name, value in constants.items() if _is_fine(name)}
    if not fine and kind_of_value is int:
        zero = [name for name, value in constants.items() if value == 0]
        bad = {value for name, value in constants.items() if _parts(name) & _BAD}
        fine = {0} if not (zero and 0 in bad) else {*constants.values()} - bad
    if not fine and kind_of_value is str:
        fine = {value for name, value in constants.items() if not _parts(name) & _BAD}
    failures = {name: value for name, value in constants.items() if value not in fine and not _is_fine(name)}
    return replace(shape, code=code, fine=tuple(sorted(fine)), failures=failures)


def _about(constants: Mapping[str, Any], code: str, fields: Mapping[str, str]) -> dict[str, Any]:
    """Return the constants that may be values of a code: not those whose names begin as another field's."""
    own = code.partition("_")[0]
    others = {name.partition("_")[0] for name in fields} - {own}
    return {name: value for name, value in constants.items() if name.partition("_")[0].lower() not in others}


def _with_others(shape: AnswerShape, fields: Mapping[str, str]) -> AnswerShape:
    """Add the flags of several things, or the text that says what went wrong."""
    for name, kind in fields.items():
        alike = _parts(name) | _parts(name.removesuffix("s")) | _parts(name.removesuffix("es"))
        item = item_of_array(kind)
        if item == "boolean" and alike & (_YES | _NO):
            return replace(shape, many=name, denies=bool(alike & _NO), code="", guessed=False)
    for name, kind in fields.items():
        item = item_of_array(kind)
        if _TEXT.fullmatch(item or kind) and _parts(name) & _TROUBLE:
            return replace(shape, trouble=name, trouble_is_list=bool(item), code="", guessed=False)
    return shape


def _is_value(kind: str) -> bool:
    return (_INTEGER.fullmatch(kind) or _TEXT.fullmatch(kind)) is not None


def _is_fine(constant: str) -> bool:
    words = constant.lower().split("_")
    turned = _NOT.intersection(words[:-1]) or words[-1:] == ["unknown"]
    return _FINE.fullmatch(constant) is not None or (words[-1] in _WELL and not turned)


def _fields(message_type: Any) -> dict[str, str]:
    """Return the fields of a message and their types, without its header."""
    fields: Mapping[str, str] = message_type.get_fields_and_field_types()
    return {name: kind for name, kind in fields.items() if kind != "std_msgs/Header"}


def _message(kind: str) -> Any:
    """Return the type of a field that is a message; None for what is none."""
    if not _MESSAGE.fullmatch(kind):
        return None
    package, last = kind.split("/")
    return load_interface(f"{package}/msg/{last}")


def constants_of(message_type: Any, kind: type = int) -> dict[str, Any]:
    """Return the constants of a kind that a type names, by their values."""
    found = {name: value for name, value in _constants(message_type) if type(value) is kind}
    return dict(sorted(found.items(), key=lambda pair: pair[1]))


def _constants(message_type: Any) -> list[tuple[str, Number]]:
    names = [name for name in dir(type(message_type)) if name.isupper() and not name.startswith("_")]
    values = [(name, getattr(message_type, name)) for name in names]
    return [(name, value) for name, value in values if isinstance(value, Number)]


def constants_below(message_type: Any) -> dict[str, Number]:
    """Return the constants of a type and of all messages in it; without names that mean several values."""
    found: dict[str, set[Number]] = {}
    for each in _types_below(message_type, set()):
        for name, value in _constants(each):
            found.setdefault(name, set()).add(value)
    return {name: values.pop() for name, values in found.items() if len(values) == 1}


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


def _last_words(path: str) -> frozenset[str]:
    return _parts(path.rpartition(".")[2])


def _parts(name: str) -> frozenset[str]:
    return frozenset(name.lower().split("_"))
