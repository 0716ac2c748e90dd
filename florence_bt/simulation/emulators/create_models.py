"""The Create and the Create 2 by their manuals, and their sensor packets (REFERENCE 1.1 to 1.5)."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass

WITH_COUNT, WITH_PAIRS = -1, -2
"""Commands that carry their length: a count and as many bytes; a number, a count and as many pairs."""

_BOTH: dict[int, int] = (
    dict.fromkeys((7, 128, 130, 131, 132, 134, 135, 143), 0)
    | dict.fromkeys((129, 138, 141, 142, 150), 1)
    | dict.fromkeys((139, 144), 3)
    | dict.fromkeys((137, 145), 4)
    | dict.fromkeys((148, 149), WITH_COUNT)
    | {140: WITH_PAIRS}
)
_CREATE_COMMANDS = (
    _BOTH
    | dict.fromkeys((153, 154), 0)
    | dict.fromkeys((136, 147, 151, 155, 158), 1)
    | dict.fromkeys((156, 157), 2)
    | {152: WITH_COUNT}
)
_CREATE_2_COMMANDS = (
    _BOTH | dict.fromkeys((133, 136, 173), 0) | {146: 4, 162: 2, 163: 4, 164: 4, 165: 1, 167: 15, 168: 3}
)
_GROUP_ENDS = {0: (7, 26), 1: (7, 16), 2: (17, 20), 3: (21, 26), 4: (27, 34), 5: (35, 42), 6: (7, 42)}


@dataclass(frozen=True, slots=True)
class EmulatedModel:
    """One kind of base.

    Attributes:
        name: What people call it.
        baud_rate: Bits per second after power-on.
        commands: Bytes after each opcode.
        last_packet: The highest sensor packet; the lowest is 7.
        groups: First and last packet of each group.
        songs: How many songs it stores.
        longest_stream: How many packets a stream may have.
        header_in_checksum: The header 19 counts for the checksum of a stream frame.
        wheel_separation_mm: Between the wheels.
        metres_per_tick: Travel per count of an encoder; None when the encoders cannot be read.
        cargo_bay: Has the connector with the digital and analog inputs and outputs.
        dock_infrared: What they say on the home base: the force field and both beams on a Create, the force
            field of a base of series 600 on a Create 2 (REFERENCE 1.7).
        boot_texts: What it prints after a reset or when it is switched on, each with the seconds until then.
    """

    name: str
    baud_rate: int
    commands: Mapping[int, int]
    last_packet: int
    groups: Mapping[int, tuple[int, int]]
    songs: int
    longest_stream: int
    header_in_checksum: bool
    wheel_separation_mm: float
    metres_per_tick: float | None
    cargo_bay: bool
    dock_infrared: int
    boot_texts: tuple[tuple[float, bytes], ...]


MODELS: dict[str, EmulatedModel] = {
    "create": EmulatedModel(
        name="create",
        baud_rate=57600,
        commands=_CREATE_COMMANDS,
        last_packet=42,
        groups=_GROUP_ENDS,
        songs=16,
        longest_stream=43,
        header_in_checksum=False,
        wheel_separation_mm=260.0,
        metres_per_tick=None,
        cargo_bay=True,
        dock_infrared=254,
        boot_texts=(
            (0.5, b"bl-start\r\n2006-09-12-1137-L   \r\n"),
            (2.5, b"RDK by iRobot!\r\nMC9S12E128\r\nbattery-current-zero 510\r\n"),
        ),
    ),
    "create2": EmulatedModel(
        name="create2",
        baud_rate=115200,
        commands=_CREATE_2_COMMANDS,
        last_packet=58,
        groups=_GROUP_ENDS | {100: (7, 58), 101: (43, 58), 106: (46, 51), 107: (54, 58)},
        songs=5,
        longest_stream=108,
        header_in_checksum=True,
        wheel_separation_mm=235.0,
        metres_per_tick=0.000444565,
        cargo_bay=False,
        dock_infrared=161,
        boot_texts=(
            (0.015, b"Soft reset!\n"),
            (1.0, b"\xfe"),
            (3.0, b"Roomba by iRobot!\r\nstm32\r\n"),
        ),
    ),
}
"""By name."""


_UNSIGNED_BYTES = (*range(7, 19), 21, 32, 34, 35, 36, 37, 38, 45, 52, 53, 58)
_SIGNED_BYTES = (24,)
_UNSIGNED_WORDS = (22, *range(25, 32), 33, 43, 44, *range(46, 52))
_SIGNED_WORDS = (19, 20, 23, *range(39, 43), *range(54, 58))
"""Packets by the type of their number. Source: REFERENCE 1.5."""

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
"""Packing of each packet's number: high byte first."""


def packets_of(number: int, model: EmulatedModel) -> range | None:
    """Return the packets that a requested number stands for, or None when the base does not know it."""
    if number in model.groups:
        first, last = model.groups[number]
        return range(first, last + 1)
    return range(number, number + 1) if 7 <= number <= model.last_packet else None


def size_of(number: int, model: EmulatedModel) -> int:
    """Return the bytes of data that a requested number brings."""
    return sum(FORMATS[packet].size for packet in packets_of(number, model) or ())
