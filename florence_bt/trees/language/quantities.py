"""Values as people write them (``30 s``, ``45 deg``, ``0.3 m/s``) to SI numbers, and back."""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import Any

from florence_bt.core.declaration import MAGNITUDES, Kind, Port, number_text
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.units import QUANTITY, UNITS, quantity_meant, unit_size

NUMERIC_KINDS = frozenset(UNITS) | {Kind.NUMBER, Kind.INTEGER}

_EXAMPLES = {
    Kind.LENGTH: "0.5 m",
    Kind.ANGLE: "45 deg",
    Kind.DURATION: "30 s",
    Kind.SPEED: "0.3 m/s",
    Kind.NUMBER: "2.5",
    Kind.INTEGER: "3",
    Kind.TEXT: "kitchen",
    Kind.BOOLEAN: "true",
    Kind.POSE: "{x: 1 m, y: 2 m, yaw: 90 deg}",
}
_PART = re.compile(r"(\d{1,9}(?:\.\d{1,9})?)\s*+([^\W\d]++(?:/[^\W\d]++)?|°)")
COMPOUND = r"(?=\d+\s*[a-z]+\s*\d)(?:(\d+)\s*h)?(?:\s*(\d+)\s*min)?(?:\s*(\d+(?:\.\d+)?)\s*s)?"
"""A duration of several parts, ``1 h 30 min`` or ``30 min 10 s``."""
_COMPOUND = re.compile(COMPOUND)
_COMMENT = re.compile("#|//")
"""The beginning of a comment without the space that it needs, or of another language."""
_HOURS = re.compile(r"(\d{1,2}) ?h ?(\d{1,2})")
_CLOCK = re.compile(r"(?:(\d{1,2}):)?(\d{1,2}):(\d{2})")


def with_article(kind: Kind) -> str:
    """Put the article before the name of a kind: ``a length``, ``an angle``."""
    return f"an {kind.value}" if kind.value[0] in "ai" else f"a {kind.value}"


def example_of(kind: Kind) -> str:
    """Return how a value of a kind is written."""
    if kind.item is None:
        return _EXAMPLES[kind]
    return "[kitchen, hall]" if kind.item is Kind.TEXT else f"[{_EXAMPLES[kind.item]}]"


def read_value(text: str, kind: Kind) -> Any:
    """Read a literal of a kind.

    Args:
        text: As written in a mission file, on the command line or in a service call.
        kind: What it must be. A pose cannot be written as a single text.

    Returns:
        The value in SI units.

    Raises:
        ConfigError: The text is not a value of that kind; the error says what would have worked.
    """
    text = text.strip() if kind is not Kind.TEXT else text
    if kind.item is not None:
        return tuple(read_value(part, kind.item) for part in _list_items(text, kind))
    match kind:
        case Kind.TEXT:
            return text
        case Kind.BOOLEAN:
            return _read_boolean(text)
        case Kind.POSE:
            raise ConfigError(f"a pose is needed, not {text!r}", valid=[_EXAMPLES[kind], "$key"])
        case Kind.INTEGER:
            if not re.fullmatch(r"[+-]?\d{1,18}", text):
                raise ConfigError(f"a whole number is needed, not {text!r}", valid=[_EXAMPLES[kind]])
            return int(text)
        case _:
            return _read_quantity(text, kind)


@lru_cache(maxsize=4096)  # a file is looked through several times
def guess_value(text: str) -> tuple[Kind, Any]:
    """Guess the kind and value of a literal where nothing says what it must be: ``30 s`` is a duration."""
    if text in ("true", "false"):
        return Kind.BOOLEAN, text == "true"
    if re.fullmatch(r"[+-]?\d{1,18}", text):
        return Kind.INTEGER, int(text)
    for kind in (Kind.NUMBER, *UNITS):
        match = QUANTITY.fullmatch(text)
        if match and (match[2] in UNITS.get(kind, {}) or (kind is Kind.NUMBER and not match[2])):
            return kind, _read_quantity(text, kind)
    if _COMPOUND.fullmatch(text):
        return Kind.DURATION, _read_quantity(text, Kind.DURATION)
    return Kind.TEXT, text


def _list_items(text: str, kind: Kind) -> list[str]:
    """Return the items of a list that is written with commas, with or without brackets."""
    if kind.item is Kind.POSE and text.strip("[] "):
        raise ConfigError(f"{with_article(kind)} is needed, not {text!r}", valid=[example_of(kind), "$key"])
    inside = text[1:-1] if text.startswith("[") and text.endswith("]") else text
    parts = [part.strip() for part in inside.split(",")]
    return [_unquoted(part) for part in parts if part]


def _unquoted(text: str) -> str:
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] and text[0] in "\"'" else text


def format_value(value: Any, kind: Kind) -> str:
    """Write a value (SI units) as people would: the inverse of :func:`read_value` up to rounding."""
    if kind.item is not None:
        return f"[{', '.join(format_value(each, kind.item) for each in value)}]"
    match kind:
        case Kind.BOOLEAN:
            return "true" if value else "false"
        case Kind.LENGTH | Kind.DURATION | Kind.SPEED | Kind.ANGLE | Kind.NUMBER:
            return number_text(value, kind)
        case Kind.POSE if isinstance(value, Pose2):
            return f"{{x: {value.x:g} m, y: {value.y:g} m, yaw: {math.degrees(value.yaw):g} deg}}"
        case _:
            return str(value)


def out_of_range(value: Any, port: Port) -> str | None:
    """Tell why a value of the right kind is outside the limits of a port, or None when it is inside."""
    for each in value if port.kind.item is not None else (value,):
        if port.choices and each not in port.choices:
            return f"{each!r} is none of its choices"
    if port.kind.item is not None:
        return None
    shown = format_value(value, port.kind)
    if port.minimum is not None and value < port.minimum:
        return f"{shown} is below the minimum of {format_value(port.minimum, port.kind)}"
    if port.maximum is not None and value > port.maximum:
        return f"{shown} is above the maximum of {format_value(port.maximum, port.kind)}"
    return None


def range_of(port: Port) -> tuple[str, ...]:
    """Return the values that a port takes, in words; empty when it has no limits."""
    if port.choices:
        return port.choices
    low, high = (
        None if end is None else format_value(end, port.kind) for end in (port.minimum, port.maximum)
    )
    if low is not None and high is not None:
        return (f"{low} to {high}",)
    return (f"{low} and more",) if low is not None else (f"{high} and less",) if high is not None else ()


_CLOCK_AND_UNIT = re.compile(r"(\d+):(\d{2})\s*(h|min)\b.*")
"""A duration as on a clock, with the unit of its first part: ``1:30 h``."""


def _suggestion(text: str, kind: Kind) -> str:
    """Suggest what is probably meant by ``1,5 s``, ``\N{MINUS SIGN}45 deg``, ``1 min 30 s``, ``00:05:00``."""
    units = UNITS.get(kind, {})
    if kind is Kind.DURATION and text.lower() in ("never", "forever", "infinite", "none"):
        return "the node without it"
    value, *comment = (part.strip() for part in _COMMENT.split(text, maxsplit=1))
    if comment:
        return f"{value if QUANTITY.fullmatch(value) else _suggestion(value, kind)} # {comment[0]}"
    if kind is Kind.DURATION and (clock := _CLOCK_AND_UNIT.fullmatch(text)):
        smaller = {"h": "min", "min": "s"}[clock[3]]
        return f"{int(clock[1])} {clock[3]} {int(clock[2])} {smaller}"
    plain = text.replace(",", ".", 1).replace("\N{MINUS SIGN}", "-").replace("\N{EN DASH}", "-")
    match = QUANTITY.fullmatch(plain)
    if match and match[2] in units:
        return f"{match[1]} {match[2]}".strip()
    parts = _PART.findall(text)
    whole = "".join("".join(part) for part in parts) == re.sub(r"\s|and", "", text)
    sizes = [unit_size(unit.lower(), kind) for _, unit in parts]
    if len(parts) > 1 and whole and None not in sizes:
        return format_value(
            sum(float(part[0]) * (size or 0.0) for part, size in zip(parts, sizes, strict=True)), kind
        )
    long = _HOURS.fullmatch(text)
    if long and kind is Kind.DURATION:
        return f"{int(long[1]) * 60 + int(long[2])} min"
    clock = _CLOCK.fullmatch(text)
    if clock and kind is Kind.DURATION:
        hours, minutes, seconds = (int(part or 0) for part in clock.groups())
        return format_value(3600.0 * hours + 60.0 * minutes + seconds, kind)
    return _EXAMPLES[kind]


def _read_boolean(text: str) -> bool:
    if text not in ("true", "false"):
        word = {"yes": "true", "on": "true", "no": "false", "off": "false"}.get(text.lower())
        raise ConfigError(
            f"true or false is needed, not {text!r}", valid=[word] if word else ["true", "false"]
        )
    return text == "true"


def _within_magnitude(text: str, value: float, kind: Kind) -> float:
    most = MAGNITUDES.get(kind)
    if most is not None and abs(value) > most:
        limits = f"{format_value(-most, kind)} to {format_value(most, kind)}"
        raise ConfigError(f"{text!r} is too large", valid=[limits])
    return value


def _read_quantity(text: str, kind: Kind) -> float:
    if kind is Kind.DURATION and (parts := _COMPOUND.fullmatch(text)):
        hours, minutes, seconds = (float(part or 0.0) for part in parts.groups())
        return _within_magnitude(text, 3600.0 * hours + 60.0 * minutes + seconds, kind)
    match = QUANTITY.fullmatch(text)
    units = UNITS.get(kind, {})
    what = with_article(kind)
    if match is None or re.search(r"[:\d]", match[2]):
        raise ConfigError(f"{what} is needed, not {text!r}", valid=[_suggestion(text, kind)])
    number, unit = float(match[1]), match[2]
    if not math.isfinite(number * units.get(unit, 1.0)):
        raise ConfigError(f"{text!r} is too large", valid=[_EXAMPLES[kind]])
    if unit in units:
        return _within_magnitude(text, number * units[unit], kind)
    if not unit and (kind is Kind.NUMBER or number == 0.0):
        return number
    if not unit:
        raise ConfigError(f"{what} needs a unit: {text!r}", valid=[f"{match[1]} {name}" for name in units])
    if kind is Kind.NUMBER:
        plain = f"{number / 100:g}" if unit == "%" else match[1]
        raise ConfigError(f"a plain number is needed, not {text!r}", valid=[plain])
    meant = quantity_meant(match[1], unit, kind)
    valid = [meant] if meant is not None else [f"{match[1]} {name}" for name in units]
    raise ConfigError(f"{unit!r} is not a unit of {what}", valid=valid)


def is_duration(text: str) -> bool:
    """Tell whether a text is a number of seconds, minutes or hours."""
    return guess_value(text.strip())[0] is Kind.DURATION
