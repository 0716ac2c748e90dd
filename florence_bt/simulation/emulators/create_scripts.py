"""Bounds of a Create's commands, and its scripts and waits (REFERENCE 1.3, 1.4)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from florence_bt.simulation.emulators.create_body import Body
from florence_bt.simulation.emulators.create_models import WITH_COUNT, WITH_PAIRS


class CommandReader:
    """Collects bytes and gives whole commands; what is not an opcode is dropped.

    Attributes:
        unknown_bytes: Bytes that were dropped so far.
    """

    def __init__(self, commands: Mapping[int, int], keeps_input: bool = False) -> None:
        """Take the table of commands.

        Args:
            commands: Bytes after each opcode.
            keeps_input: What comes while a wait runs is kept for afterwards, not ignored.
        """
        self._commands = commands
        self._keeps_input = keeps_input
        self._input = bytearray()
        self.unknown_bytes = 0

    def feed(self, data: bytes, *, waiting: bool = False) -> None:
        """Take bytes from the line, in pieces of any size.

        Args:
            data: The bytes.
            waiting: Whether a wait command runs: serial input is ignored (REFERENCE 1.4).
        """
        if self._keeps_input or not waiting:
            self._input += data
        elif data:
            self._drop_unfinished()

    def clear(self) -> None:
        """Forget what is waiting."""
        self._input.clear()

    def take(self) -> bytes | None:
        """Return the next whole command, opcode first; None when there is none yet."""
        while self._input and self._input[0] not in self._commands:
            self.unknown_bytes += 1
            del self._input[0]
        if not self._input:
            return None
        length = self._length()
        if length is None or len(self._input) < length:
            return None
        command = bytes(self._input[:length])
        del self._input[:length]
        return command

    def _drop_unfinished(self) -> None:
        """Forget the command whose end is ignored; what comes after the wait does not belong to it."""
        whole = []
        while (command := self.take()) is not None:
            whole.append(command)
        self._input[:] = b"".join(whole)

    def _length(self) -> int | None:
        """Return how long the first command is with its opcode; None while its count is not there."""
        arguments = self._commands[self._input[0]]
        if arguments == WITH_COUNT:
            return 2 + self._input[1] if len(self._input) > 1 else None
        if arguments == WITH_PAIRS:
            return 3 + 2 * self._input[2] if len(self._input) > 2 else None
        return 1 + arguments


LONGEST_SCRIPT = 100
"""Bytes. Source: REFERENCE 1.3, opcode 152."""
WAIT_TIME, WAIT_DISTANCE, WAIT_ANGLE = range(155, 158)
WAITS = range(WAIT_TIME, WAIT_ANGLE + 1)
"""Opcodes; the one that waits for an event (158) is passed over."""
COMMANDS_AT_ONCE = 50
"""A script that goes round without a wait would never end otherwise."""

DISTANCE, ANGLE = 19, 20
"""Packets that begin at 0 when a wait for them begins."""


class WaitCommand:
    """One wait command that runs."""

    def __init__(self, command: bytes, now: float, body: Body) -> None:
        self._opcode = command[0]
        self._body = body
        self._end = now + command[1] / 10.0
        self._goal = int.from_bytes(command[1:], "big", signed=True)
        self._start = 0.0
        if self._opcode == WAIT_DISTANCE:
            self._start = body.distance_mm()
            body.value(DISTANCE)
        elif self._opcode == WAIT_ANGLE:
            self._start = body.angle_deg()
            body.value(ANGLE)

    def is_over(self, now: float) -> bool:
        """Tell whether what it waits for has come."""
        if self._opcode == WAIT_TIME:
            return now >= self._end
        gone = self._body.distance_mm() if self._opcode == WAIT_DISTANCE else self._body.angle_deg()
        gone -= self._start
        return gone >= self._goal if self._goal >= 0 else gone <= self._goal


class ScriptPlayer:
    """Holds the script, plays it, and waits."""

    def __init__(self, commands: Mapping[int, int], body: Body) -> None:
        self._commands = commands
        self._body = body
        self._script = b""
        self._rest: CommandReader | None = None
        self._wait: WaitCommand | None = None

    @property
    def script(self) -> bytes:
        """The stored script."""
        return self._script

    @property
    def waiting(self) -> bool:
        """Tell whether a wait runs: the base executes nothing then."""
        return self._wait is not None

    def define(self, script: bytes) -> None:
        """Store a script."""
        self._script = script[:LONGEST_SCRIPT]

    def begin(self) -> None:
        """Play the stored script from its start."""
        self._rest = CommandReader(self._commands)
        self._rest.feed(self._script)

    def wait(self, command: bytes, now: float) -> None:
        """Begin to wait."""
        self._wait = WaitCommand(command, now, self._body)

    def end(self) -> None:
        """Forget what plays and what is waited for."""
        self._rest = self._wait = None

    def step(self, now: float, execute: Callable[[bytes], None]) -> None:
        """Go on as far as the waits allow.

        Args:
            now: Seconds.
            execute: Does what a command says; it calls :meth:`wait` and :meth:`begin` for theirs.
        """
        for _ in range(COMMANDS_AT_ONCE):
            if self._wait is not None and not self._wait.is_over(now):
                return
            self._wait = None
            command = None if self._rest is None else self._rest.take()
            if command is None:
                self._rest = None
                return
            execute(command)
