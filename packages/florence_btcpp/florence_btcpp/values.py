"""Values in XML attributes (SI units, no kinds) and in mission files (units, quotes), in both directions."""

from __future__ import annotations

import math
import re
from typing import Any

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.trees.language import model
from florence_bt.trees.language.model import ListItems, Literal, PoseParts, Reference, Template, Value
from florence_bt.trees.language.quantities import UNITS, guess_value, read_value
from florence_bt.trees.language.values import tree_value
from florence_btcpp.mission_text import Quoted, read_flow, write_flow
from florence_btcpp.vocabulary import PREFIX

_NEUTRAL = {Kind.TEXT: "", Kind.BOOLEAN: False, Kind.INTEGER: 0, Kind.POSE: Pose2(0.0, 0.0, 0.0)}
_TRUE, _FALSE = ("true", "1"), ("false", "0")
_WHOLE = re.compile(r"\s*[+-]?[0-9]{1,18}\s*")


def neutral_value(kind: Kind) -> Any:
    """Return what stands for a value that is not given: nothing, in SI units."""
    return _NEUTRAL.get(kind, 0.0)


def quantity_text(value: float, kind: Kind) -> str:
    """Write a value in SI units as the shortest text that :func:`read_value` reads back exactly.

    Args:
        value: In SI units.
        kind: A kind with units.
    """
    texts = []
    for unit, size in UNITS[kind].items():
        if unit != "°":
            text = f"{_plain(value / size)} {unit}"
            if len(text) <= 16 and read_value(text, kind) == value:
                texts.append(text)
    return (
        min(texts, key=len)
        if texts
        else f"{value!r} {next(u for u, size in UNITS[kind].items() if size == 1.0)}"
    )


def si_text(value: Any) -> str:
    """Write a value in SI units as the text of an XML attribute."""
    match value:
        case bool():
            return "true" if value else "false"
        case tuple():
            return ";".join(map(si_text, value))
        case Pose2():
            return ";".join(_plain(part) for part in (value.x, value.y, value.yaw))
        case float():
            return _plain(value)
    return str(value)


def script_number(value: Any) -> str:
    """Write a number or truth value for a script; a quantity gets a point, as ``2`` makes an integer key."""
    text = si_text(value)
    return f"{text}.0" if isinstance(value, float) and text.lstrip("-").isdecimal() else text


def read_number(text: str) -> int | float | None:
    """Read a finite number as C++ reads it, None when the text is not one."""
    if _WHOLE.fullmatch(text):
        return int(text)
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) and "_" not in text else None


def read_truth(text: str) -> bool | None:
    """Read a truth value as BehaviorTree.CPP reads it, None when the text is not one."""
    word = text.strip().lower()
    return True if word in _TRUE else False if word in _FALSE else None


def guess_kind(text: str) -> Kind:
    """Return the kind of a literal of which nothing else is known."""
    if text.strip().lower() in ("true", "false"):
        return Kind.BOOLEAN
    number = read_number(text)
    if number is None:
        return Kind.TEXT
    return Kind.INTEGER if isinstance(number, int) else Kind.NUMBER


def _plain(number: float) -> str:
    short = f"{number:.12g}"
    return short if float(short) == number else repr(float(number))


def written_value(text: str, kind: Kind | None) -> tuple[Any, str]:
    """Write a literal as it is written in a mission.

    Args:
        text: The attribute.
        kind: What it must be; None when nothing is known.

    Returns:
        The value, and what is wrong with it (empty when nothing is). A wrong value is kept as a text.
    """
    if text.startswith(PREFIX):
        try:
            return read_flow(text.removeprefix(PREFIX)), ""
        except ConfigError as error:
            return text_value(text, kind), error.problem
    if text.startswith("json:"):
        return text_value(text, kind), "a value in JSON is kept as text"
    match kind or guess_kind(text):
        case Kind.TEXT:
            return text_value(text, kind), ""
        case Kind.BOOLEAN:
            truth = read_truth(text)
            return (si_text(truth), "") if truth is not None else _wrong_value(text, Kind.BOOLEAN)
        case Kind.POSE:
            return _pose(text)
        case wanted:
            number = read_number(text)
            if number is not None and not (wanted is Kind.INTEGER and isinstance(number, float)):
                return literal_text(number, wanted), ""
            return _quantity(text, wanted)


def literal_text(number: int | float, kind: Kind | None) -> str:
    """Write a number with the unit of its kind."""
    if kind in UNITS:
        return quantity_text(float(number), kind)
    text = si_text(number)
    whole = text.lstrip("-").isdecimal()
    return f"{text}.0" if whole and (kind is Kind.NUMBER or isinstance(number, float)) else text


def text_value(text: str, kind: Kind | None) -> str:
    """Write a text; in quotes where it would be read as something else, and with its dollar signs doubled."""
    escaped = text.replace("$", "$$")
    return (
        escaped
        if (kind is Kind.TEXT or _reads_as_text(text))
        and escaped.strip() == escaped
        and escaped not in ("", "~", "null")
        else Quoted(escaped)
    )


def _reads_as_text(text: str) -> bool:
    try:
        return guess_value(text)[0] is Kind.TEXT
    except ConfigError:  # a number that is too large
        return False


def _quantity(text: str, kind: Kind) -> tuple[Any, str]:
    """Read a value that is written with its unit, as people do."""
    try:
        read_value(text, kind)
    except ConfigError:
        return _wrong_value(text, kind)
    return text.strip(), ""


def _pose(text: str) -> tuple[Any, str]:
    numbers = [read_number(part) for part in text.split(";")]
    if len(numbers) != 3 or None in numbers:
        return _wrong_value(text, Kind.POSE)
    kinds = (("x", Kind.LENGTH), ("y", Kind.LENGTH), ("yaw", Kind.ANGLE))
    pairs = zip(kinds, numbers, strict=True)
    return {name: literal_text(number, kind) for (name, kind), number in pairs if number is not None}, ""


def _wrong_value(text: str, kind: Kind) -> tuple[Any, str]:
    return text_value(text, None), f"{text!r} is not of the kind {kind.value}"


def port_attribute(value: Value, kind: Kind | None) -> str:
    """Write a value of a port.

    Literals are written in SI units and references as ``{key}``. What BehaviorTree.CPP cannot say stands in
    the mission language behind ``florence:``.

    Args:
        value: The value.
        kind: What it must be; None when anything will do.
    """
    if isinstance(value, Reference):
        return f"{{{value.key}}}"
    if isinstance(value, Literal | PoseParts):
        resolved = tree_value(value, kind)
        if isinstance(resolved, str | bool | int | float | Pose2):
            text = si_text(resolved)
            if not isinstance(resolved, str) or _stays(text, kind):
                return text
    return PREFIX + own_value(value)


def case_text(case: Literal, declared: Kind | None) -> str:
    """Write a case of a ``Switch`` as keys are compared there: SI number, or 1 or 0 for a truth value.

    Args:
        case: The case as written.
        declared: The kind of the key, None when it is not declared.
    """
    kind, value = guess_value(case.text)
    if declared is Kind.TEXT:
        return case.text
    if kind is Kind.BOOLEAN:
        return str(int(bool(value)))
    return si_text(float(value)) if kind in UNITS else case.text


def own_value(value: Value | dict[str, Value]) -> str:
    """Write a value in the mission language, on one line."""
    if isinstance(value, dict):
        return write_flow({key: flow_value(item) for key, item in value.items()})
    return write_flow(flow_value(value))


def flow_value(value: Value) -> Any:
    """Return a value as it is written in a mission."""
    match value:
        case Literal(text=text, quoted=quoted):
            return Quoted(text.replace("$", "$$")) if quoted else text_value(text, Kind.TEXT)
        case PoseParts(x=x, y=y, yaw=yaw):
            return {"x": flow_value(x), "y": flow_value(y), "yaw": flow_value(yaw)}
        case ListItems(items=items):
            return [flow_value(item) for item in items]
        case Template(parts=parts):
            return Quoted(
                "".join(p.replace("$", "$$") if isinstance(p, str) else f"${{{p.key}}}" for p in parts)
            )
    return model.show(value)


def _stays(text: str, kind: Kind | None) -> bool:
    """Tell whether a text is read back as the same text."""
    if text.strip().startswith("{") and text.strip().endswith("}"):
        return False
    read, problem = written_value(text, kind)
    return (
        not problem
        and str(read) == text.replace("$", "$$")
        and (kind is Kind.TEXT or not isinstance(read, Quoted))
    )
