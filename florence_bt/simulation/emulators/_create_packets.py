"""Sensor packets as a base sends them; written from the manual (REFERENCE 1.5), not from the driver."""

from __future__ import annotations

import struct

from florence_bt.simulation.emulators._create_models import EmulatedModel

_UNSIGNED_BYTES = (*range(7, 19), 21, 32, 34, 35, 36, 37, 38, 45, 52, 53, 58)
_SIGNED_BYTES = (24,)
_UNSIGNED_WORDS = (22, *range(25, 32), 33, 43, 44, *range(46, 52))
_SIGNED_WORDS = (19, 20, 23, *range(39, 43), *range(54, 58))

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


def packets_of(number: int, model: EmulatedModel) -> range | None:
    """The packets that a requested number stands for, or None when the base does not know it."""
    if number in model.groups:
        first, last = model.groups[number]
        return range(first, last + 1)
    return range(number, number + 1) if 7 <= number <= model.last_packet else None


def size_of(number: int, model: EmulatedModel) -> int:
    """Bytes of data that a requested number brings."""
    return sum(FORMATS[packet].size for packet in packets_of(number, model) or ())
