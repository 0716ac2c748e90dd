"""Scripts and waits of a Create (REFERENCE 1.3, opcodes 152 to 158, and 1.4)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from florence_bt.simulation.emulators._create_commands import CommandReader

LONGEST = 100
WAIT_TIME, WAIT_DISTANCE, WAIT_ANGLE, WAIT_EVENT = range(155, 159)
PLAY_SCRIPT = 153
WAITS = range(WAIT_TIME, WAIT_EVENT + 1)
COMMANDS_AT_ONCE = 50
"""A script that goes round without a wait would never end otherwise."""

_EVENTS: dict[int, tuple[tuple[int, ...], int]] = {
    1: ((7,), 0x1C),
    2: ((7,), 0x10),
    3: ((7,), 0x08),
    4: ((7,), 0x04),
    5: ((7,), 0x03),
    6: ((7,), 0x02),
    7: ((7,), 0x01),
    8: ((13,), 0xFF),
    9: ((8,), 0xFF),
    10: ((9, 10, 11, 12), 0xFF),
    11: ((9,), 0xFF),
    12: ((10,), 0xFF),
    13: ((11,), 0xFF),
    14: ((12,), 0xFF),
    15: ((34,), 0x02),
    16: ((18,), 0x04),
    17: ((18,), 0x01),
    18: ((32,), 0x01),
    19: ((32,), 0x02),
    20: ((32,), 0x04),
    21: ((32,), 0x08),
}
"""Event -> the packets that tell it, and which of their bits."""

OI_MODE, PASSIVE, PASSIVE_EVENT = 35, 1, 22
DISTANCE, ANGLE = 19, 20


@dataclass(frozen=True, slots=True)
class World:
    """What a wait looks at.

    Attributes:
        value: The count of a sensor packet; those of distance and angle begin anew when they are looked at.
        distance_mm: How far the base has gone since the start.
        angle_deg: How far it has turned since the start, counter-clockwise positive.
    """

    value: Callable[[int], int]
    distance_mm: Callable[[], float]
    angle_deg: Callable[[], float]


class Wait:
    """One wait command that runs."""

    def __init__(self, command: bytes, now: float, world: World) -> None:
        self._opcode = command[0]
        self._world = world
        self._end = now + command[1] / 10.0
        self._goal = int.from_bytes(command[1:], "big", signed=True)
        self._start = 0.0
        if self._opcode == WAIT_DISTANCE:
            self._start = world.distance_mm()
            world.value(DISTANCE)
        elif self._opcode == WAIT_ANGLE:
            self._start = world.angle_deg()
            world.value(ANGLE)

    def is_over(self, now: float) -> bool:
        """Whether what it waits for has come."""
        if self._opcode == WAIT_TIME:
            return now >= self._end
        if self._opcode == WAIT_EVENT:
            return happens(abs(self._goal), self._world.value) is (self._goal > 0)
        gone = self._world.distance_mm() if self._opcode == WAIT_DISTANCE else self._world.angle_deg()
        gone -= self._start
        return gone >= self._goal if self._goal >= 0 else gone <= self._goal


def happens(event: int, value: Callable[[int], int]) -> bool:
    """Whether an event of REFERENCE 1.4 is so now; one that does not exist never is.

    Args:
        event: 1 to 22.
        value: The count of a sensor packet.
    """
    if event == PASSIVE_EVENT:
        return value(OI_MODE) == PASSIVE
    packets, bits = _EVENTS.get(event, ((), 0))
    return any(value(packet) & bits for packet in packets)


class ScriptPlayer:
    """Holds the script, plays it, and waits."""

    def __init__(self, commands: Mapping[int, int], world: World) -> None:
        self._commands = commands
        self._world = world
        self._script = b""
        self._rest: CommandReader | None = None
        self._wait: Wait | None = None

    @property
    def script(self) -> bytes:
        """The stored script."""
        return self._script

    @property
    def waiting(self) -> bool:
        """Whether a wait runs: the base obeys nothing then."""
        return self._wait is not None

    def define(self, script: bytes) -> None:
        """Store a script."""
        self._script = script[:LONGEST]

    def begin(self) -> None:
        """Play the stored script from its start."""
        self._rest = CommandReader(self._commands)
        self._rest.feed(self._script)

    def wait(self, command: bytes, now: float) -> None:
        """Begin to wait."""
        self._wait = Wait(command, now, self._world)

    def end(self) -> None:
        """Forget what plays and what is waited for."""
        self._rest = self._wait = None

    def step(self, now: float, obey: Callable[[bytes], None]) -> None:
        """Go on as far as the waits allow.

        Args:
            now: Seconds.
            obey: Does what a command says; it calls :meth:`wait` and :meth:`begin` for theirs.
        """
        for _ in range(COMMANDS_AT_ONCE):
            if self._wait is not None and not self._wait.is_over(now):
                return
            self._wait = None
            command = None if self._rest is None else self._rest.take()
            if command is None:
                self._rest = None
                return
            obey(command)
