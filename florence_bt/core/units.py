"""The units in which people write quantities, in mission files and in files of settings."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from difflib import get_close_matches

from florence_bt.core.declaration import Kind

UNITS: dict[Kind, dict[str, float]] = {
    Kind.LENGTH: {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0},
    Kind.ANGLE: {"deg": math.pi / 180.0, "°": math.pi / 180.0, "rad": 1.0},
    Kind.DURATION: {"s": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0},
    Kind.SPEED: {"m/s": 1.0, "cm/s": 0.01, "km/h": 1.0 / 3.6},
}
"""Kind -> unit -> its size in the SI unit."""
# Possessive, so that a text of ten thousand digits is read once, not ten thousand times.
QUANTITY = re.compile(r"([+-]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d++)?)\s*+(\S*)")
"""A number and its unit, which may be missing."""


_OTHER_UNITS: dict[Kind, dict[str, tuple[float, str]]] = {
    Kind.LENGTH: {
        **dict.fromkeys(("meter", "meters", "metre", "metres"), (1.0, "m")),
        **dict.fromkeys(("centimeter", "centimeters", "centimetre", "centimetres"), (1.0, "cm")),
        **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), (1.0, "mm")),
        **dict.fromkeys(("kilometer", "kilometers", "kilometre", "kilometres"), (1.0, "km")),
        **dict.fromkeys(("ft", "foot", "feet"), (0.3048, "m")),
        **dict.fromkeys(("in", "inch", "inches"), (2.54, "cm")),
        **dict.fromkeys(("yd", "yard", "yards"), (0.9144, "m")),
    },
    Kind.ANGLE: {
        **dict.fromkeys(("degree", "degrees", "grad"), (1.0, "deg")),
        **dict.fromkeys(("radian", "radians"), (1.0, "rad")),
        **dict.fromkeys(("turn", "turns", "rev", "revolution", "revolutions"), (360.0, "deg")),
    },
    Kind.DURATION: {
        **dict.fromkeys(("sec", "secs", "second", "seconds"), (1.0, "s")),
        **dict.fromkeys(("msec", "millis", "millisecond", "milliseconds"), (1.0, "ms")),
        **dict.fromkeys(("m", "mins", "minute", "minutes"), (1.0, "min")),
        **dict.fromkeys(("hr", "hrs", "hour", "hours"), (1.0, "h")),
        **dict.fromkeys(("d", "day", "days"), (24.0, "h")),
        **dict.fromkeys(("week", "weeks"), (168.0, "h")),
    },
    Kind.SPEED: {
        **dict.fromkeys(("mps", "m/sec", "metres/second", "meters/second"), (1.0, "m/s")),
        **dict.fromkeys(("kmh", "kph", "km/hour"), (1.0, "km/h")),
        **dict.fromkeys(("m/min",), (1.0 / 60.0, "m/s")),
        **dict.fromkeys(("mph",), (1.609344, "km/h")),
    },
}
"""Kind -> unit as people also write it, in lower case -> how many of which of :data:`UNITS` it is."""


def unit_size(unit: str, kind: Kind) -> float | None:
    """Return the size of a unit in the SI unit of a kind, also of one that is written out; None of others."""
    if unit in UNITS.get(kind, {}):
        return UNITS[kind][unit]
    count, name = _OTHER_UNITS.get(kind, {}).get(unit, (0.0, ""))
    return count * UNITS[kind][name] if name else None


def quantity_meant(number: str, unit: str, kind: Kind) -> str | None:
    """Write a quantity whose unit is not one of :data:`UNITS` as it would have worked: ``90 min``.

    Args:
        number: The number as it was written.
        unit: Such as ``minutes``, ``M`` or ``days``.
        kind: What it must be; a duration in ``m`` is one in minutes.

    Returns:
        The number with a unit; None when nobody can tell what was meant.
    """
    words = {**_OTHER_UNITS.get(kind, {}), **{name.lower(): (1.0, name) for name in UNITS.get(kind, {})}}
    spelt = unit.lower() if unit.lower() in words else next(iter(_misspelt(unit.lower(), words)), None)
    if spelt is None:
        return None
    size, name = words[spelt]
    return f"{number if size == 1.0 else format(float(number) * size, 'g')} {name}"


def _misspelt(word: str, words: Iterable[str]) -> list[str]:
    """Return the words that one of more than two letters looks like: ``minuts``."""
    return get_close_matches(word, words, n=1, cutoff=0.8) if len(word) > 2 else []
