"""The units in which people write quantities, in mission files and in files of settings."""

from __future__ import annotations

import math
import re

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
