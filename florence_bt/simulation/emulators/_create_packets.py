"""Sensor packets as a Create sends them; written from the manual (REFERENCE 1.5), not from the driver."""

from __future__ import annotations

import struct

MAX_STREAM_PACKETS = 43

_UNSIGNED_BYTES = (*range(7, 19), 21, 32, 34, 35, 36, 37, 38)
_SIGNED_BYTES = (24,)
_UNSIGNED_WORDS = (22, 25, 26, 27, 28, 29, 30, 31, 33)
_SIGNED_WORDS = (19, 20, 23, 39, 40, 41, 42)

FORMATS: dict[int, struct.Struct] = {
    number: struct.Struct(layout)
    for numbers, layout in (
        (_UNSIGNED_BYTES, ">B"),
        (_SIGNED_BYTES, ">b"),
        (_UNSIGNED_WORDS, ">H"),
        (_SIGNED_WORDS, ">h"),
    )
    for number in numbers
}
"""How each packet's number is packed: high byte first."""

_GROUP_ENDS = {0: (7, 26), 1: (7, 16), 2: (17, 20), 3: (21, 26), 4: (27, 34), 5: (35, 42), 6: (7, 42)}


def packets_of(number: int) -> range | None:
    """The packets that a requested number stands for, or None when the base does not know it."""
    if number in _GROUP_ENDS:
        first, last = _GROUP_ENDS[number]
        return range(first, last + 1)
    return range(number, number + 1) if number in FORMATS else None
