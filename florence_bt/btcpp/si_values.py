"""Numbers in SI units, which the XML has, to quantities as people write them, which missions have."""

from __future__ import annotations

import math
import re
from typing import Any

from florence_bt.core.declaration import Kind
from florence_bt.core.geometry import Pose2
from florence_bt.trees.language.quantities import UNITS, read_value

_TRUE, _FALSE = ("true", "1"), ("false", "0")
_WHOLE = re.compile(r"\s*[+-]?[0-9]{1,18}\s*")


def quantity_text(value: float, kind: Kind) -> str:
    """A value in SI units as the shortest text that :func:`read_value` reads back to exactly that value.

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
    """A value in SI units as the text of an XML attribute."""
    match value:
        case bool():
            return "true" if value else "false"
        case Pose2():
            return ";".join(_plain(part) for part in (value.x, value.y, value.yaw))
        case float():
            return _plain(value)
    return str(value)


def script_number(value: Any) -> str:
    """A number or truth value in a script; a quantity has a point, for ``2`` makes a key of whole numbers."""
    text = si_text(value)
    return f"{text}.0" if isinstance(value, float) and text.lstrip("-").isdecimal() else text


def read_number(text: str) -> int | float | None:
    """A finite number as C++ reads it, None when the text is none."""
    if _WHOLE.fullmatch(text):
        return int(text)
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) and "_" not in text else None


def read_truth(text: str) -> bool | None:
    """A truth value as BehaviorTree.CPP reads it, None when the text is none."""
    word = text.strip().lower()
    return True if word in _TRUE else False if word in _FALSE else None


def guess_kind(text: str) -> Kind:
    """The kind of a literal of which nothing else is known."""
    if text.strip().lower() in ("true", "false"):
        return Kind.BOOLEAN
    number = read_number(text)
    if number is None:
        return Kind.TEXT
    return Kind.INTEGER if isinstance(number, int) else Kind.NUMBER


def _plain(number: float) -> str:
    short = f"{number:.12g}"
    return short if float(short) == number else repr(float(number))
