"""Which arguments each command has and in which ranges; how to find its end (REFERENCE 1.3)."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from florence_bt.drivers.turtlebot.codec.models import CREATE, Model
from florence_bt.drivers.turtlebot.codec.packets import OiMode

MAX_WHEEL_SPEED_MMPS = 500
MAX_RADIUS_MM = 2000
MAX_PWM = 255
MAX_NOTES = 16
MAX_SCRIPT_BYTES = 100
MAX_DUTY = 128
"""A low side driver that is wholly on."""


class Opcode(enum.IntEnum):
    """The first byte of each command."""

    SOFT_RESET = 7
    START = 128
    BAUD = 129
    CONTROL = 130
    SAFE = 131
    FULL = 132
    POWER = 133
    SPOT = 134
    COVER = 135
    DEMO = 136
    DRIVE = 137
    LOW_SIDE_DRIVERS = 138
    LEDS = 139
    SONG = 140
    PLAY_SONG = 141
    SENSORS = 142
    COVER_AND_DOCK = 143
    PWM_LOW_SIDE_DRIVERS = 144
    DRIVE_DIRECT = 145
    DRIVE_PWM = 146
    DIGITAL_OUTPUTS = 147
    STREAM = 148
    QUERY_LIST = 149
    PAUSE_RESUME_STREAM = 150
    SEND_IR = 151
    SCRIPT = 152
    PLAY_SCRIPT = 153
    SHOW_SCRIPT = 154
    WAIT_TIME = 155
    WAIT_DISTANCE = 156
    WAIT_ANGLE = 157
    WAIT_EVENT = 158
    SCHEDULING_LEDS = 162
    DIGIT_LEDS_RAW = 163
    DIGIT_LEDS_ASCII = 164
    BUTTONS = 165
    SCHEDULE = 167
    SET_DAY_TIME = 168
    STOP = 173


class Tail(enum.Enum):
    """What follows the fixed arguments: a count, then that many of these."""

    NOTHING = 0
    BYTES = 1
    NOTES = 2
    """Pairs of a note and its duration."""


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument of a command.

    Attributes:
        name: What it is.
        code: Its type as a ``struct`` character, big-endian.
        lowest: The smallest value.
        highest: The largest value.
        special: Further values with a meaning of their own.
    """

    name: str
    code: str
    lowest: int
    highest: int
    special: tuple[int, ...] = ()

    def accepts(self, value: int) -> bool:
        """Whether the command may carry this value."""
        return self.lowest <= value <= self.highest or value in self.special


@dataclass(frozen=True, slots=True)
class Layout:
    """What follows an opcode.

    Attributes:
        arguments: In the order of the wire.
        tail: What follows the arguments.
        longest_tail: How many items the tail may have.
        lowest_mode: The base obeys in this mode and those above it.
    """

    arguments: tuple[Argument, ...] = ()
    tail: Tail = Tail.NOTHING
    longest_tail: int = 0
    lowest_mode: OiMode = OiMode.PASSIVE


STRAIGHT, ALSO_STRAIGHT = -0x8000, 0x7FFF
SPIN_CLOCKWISE, SPIN_COUNTER_CLOCKWISE = -1, 1
"""Radii of the Drive command with a meaning of their own."""

WAIT_EVENTS = (*range(-22, 0), *range(1, 23))
"""REFERENCE 1.4; a negative number waits for the event's end."""


def _byte(name: str, highest: int = 255) -> Argument:
    return Argument(name, "B", 0, highest)


def _word(name: str, limit: int, special: tuple[int, ...] = ()) -> Argument:
    return Argument(name, "h", -limit, limit, special)


_DRIVING = OiMode.SAFE
_COMMON: dict[Opcode, Layout] = {
    Opcode.SOFT_RESET: Layout(lowest_mode=OiMode.OFF),
    Opcode.START: Layout(lowest_mode=OiMode.OFF),
    Opcode.BAUD: Layout((_byte("code", 11),)),
    Opcode.CONTROL: Layout(),
    Opcode.SAFE: Layout(),
    Opcode.FULL: Layout(),
    Opcode.SPOT: Layout(),
    Opcode.COVER: Layout(),
    Opcode.DRIVE: Layout(
        (
            _word("velocity", MAX_WHEEL_SPEED_MMPS),
            _word("radius", MAX_RADIUS_MM, (STRAIGHT, ALSO_STRAIGHT)),
        ),
        lowest_mode=_DRIVING,
    ),
    Opcode.LEDS: Layout((_byte("bits"), _byte("colour"), _byte("intensity")), lowest_mode=_DRIVING),
    Opcode.SENSORS: Layout((_byte("packet"),)),
    Opcode.COVER_AND_DOCK: Layout(),
    Opcode.DRIVE_DIRECT: Layout(
        (_word("right", MAX_WHEEL_SPEED_MMPS), _word("left", MAX_WHEEL_SPEED_MMPS)), lowest_mode=_DRIVING
    ),
    Opcode.STREAM: Layout(tail=Tail.BYTES, longest_tail=255),
    Opcode.QUERY_LIST: Layout(tail=Tail.BYTES, longest_tail=255),
    Opcode.PAUSE_RESUME_STREAM: Layout((_byte("resume", 1),)),
}
_CREATE: dict[Opcode, Layout] = _COMMON | {
    Opcode.DEMO: Layout((Argument("demo", "b", -1, 9),)),
    Opcode.LOW_SIDE_DRIVERS: Layout((_byte("bits", 7),), lowest_mode=_DRIVING),
    Opcode.SONG: Layout((_byte("number", 15),), Tail.NOTES, MAX_NOTES),
    Opcode.PLAY_SONG: Layout((_byte("number", 15),), lowest_mode=_DRIVING),
    Opcode.PWM_LOW_SIDE_DRIVERS: Layout(
        (_byte("driver 2", MAX_DUTY), _byte("driver 1", MAX_DUTY), _byte("driver 0", MAX_DUTY)),
        lowest_mode=_DRIVING,
    ),
    Opcode.DIGITAL_OUTPUTS: Layout((_byte("bits", 7),), lowest_mode=_DRIVING),
    Opcode.SEND_IR: Layout((_byte("code"),), lowest_mode=_DRIVING),
    Opcode.SCRIPT: Layout(tail=Tail.BYTES, longest_tail=MAX_SCRIPT_BYTES),
    Opcode.PLAY_SCRIPT: Layout(),
    Opcode.SHOW_SCRIPT: Layout(),
    Opcode.WAIT_TIME: Layout((_byte("tenths"),)),
    Opcode.WAIT_DISTANCE: Layout((_word("millimetres", 32767),)),
    Opcode.WAIT_ANGLE: Layout((_word("degrees", 32767),)),
    Opcode.WAIT_EVENT: Layout((Argument("event", "b", 1, 22, tuple(range(-22, 0))),)),
}
_CREATE_2: dict[Opcode, Layout] = _COMMON | {
    Opcode.POWER: Layout(),
    Opcode.DEMO: Layout(),
    Opcode.LOW_SIDE_DRIVERS: Layout((_byte("bits", 31),), lowest_mode=_DRIVING),
    Opcode.SONG: Layout((_byte("number", 4),), Tail.NOTES, MAX_NOTES),
    Opcode.PLAY_SONG: Layout((_byte("number", 4),), lowest_mode=_DRIVING),
    Opcode.PWM_LOW_SIDE_DRIVERS: Layout(
        (
            Argument("main brush", "b", -127, 127),
            Argument("side brush", "b", -127, 127),
            Argument("vacuum", "b", 0, 127),
        ),
        lowest_mode=_DRIVING,
    ),
    Opcode.DRIVE_PWM: Layout((_word("right", MAX_PWM), _word("left", MAX_PWM)), lowest_mode=_DRIVING),
    Opcode.SCHEDULING_LEDS: Layout((_byte("days"), _byte("bits")), lowest_mode=_DRIVING),
    Opcode.DIGIT_LEDS_RAW: Layout(tuple(_byte(f"digit {n}") for n in (3, 2, 1, 0)), lowest_mode=_DRIVING),
    Opcode.DIGIT_LEDS_ASCII: Layout(
        tuple(Argument(f"digit {n}", "B", 32, 126) for n in (3, 2, 1, 0)), lowest_mode=_DRIVING
    ),
    Opcode.BUTTONS: Layout((_byte("bits"),)),
    Opcode.SCHEDULE: Layout(tuple(_byte(f"byte {n}") for n in range(15))),
    Opcode.SET_DAY_TIME: Layout((_byte("day", 6), _byte("hour", 23), _byte("minute", 59))),
    Opcode.STOP: Layout(),
}


def layouts(model: Model = CREATE) -> dict[Opcode, Layout]:
    """The commands of a base. Opcode 136 is Demo with a number on a Create, Max without one on a Create 2."""
    return _CREATE if model is CREATE else _CREATE_2
