"""Any command as a value, to bytes and back, by the table of layouts (REFERENCE 1.3).

``commands.py`` has a function for each command; here is what they share, and the way back: what a script of a
Create holds, or what went over a line, is read with :class:`CommandDecoder`.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.turtlebot.codec.layouts import Layout, Opcode, Tail, layouts
from florence_bt.drivers.turtlebot.codec.models import CREATE, Model


@dataclass(frozen=True, slots=True)
class Command:
    """One command.

    Attributes:
        opcode: Which.
        arguments: Its fixed arguments in the order of the wire.
        tail: What follows their count: packet numbers, a script's bytes, or notes and durations in turn.
    """

    opcode: Opcode
    arguments: tuple[int, ...] = ()
    tail: tuple[int, ...] = ()

    def __str__(self) -> str:
        """The command for people, e.g. ``DRIVE_DIRECT 150 -150``."""
        return " ".join([self.opcode.name, *map(str, self.arguments), *map(str, self.tail)])


def encode(command: Command, model: Model = CREATE) -> bytes:
    """A command as bytes.

    Raises:
        ConfigError: The base has no such command, or an argument is out of its range.
    """
    layout = layouts(model).get(command.opcode)
    if layout is None:
        raise ConfigError(f"{model.name} has no command {command.opcode} ({command.opcode.name})")
    problem = _problem(command, layout)
    if problem:
        raise ConfigError(f"{command.opcode.name}: {problem}")
    codes = ">B" + "".join(argument.code for argument in layout.arguments)
    out = struct.pack(codes, command.opcode, *command.arguments)
    if layout.tail is Tail.NOTHING:
        return out
    items = len(command.tail) // 2 if layout.tail is Tail.NOTES else len(command.tail)
    return out + bytes([items, *command.tail])


class CommandDecoder:
    """Cuts bytes into commands, in pieces of any size.

    Attributes:
        unknown_bytes: Bytes so far that begin no command of this model.
        refused: Commands so far whose arguments were out of range; they are left out.
    """

    def __init__(self, model: Model = CREATE) -> None:
        self._layouts = layouts(model)
        self._buffer = bytearray()
        self.unknown_bytes = 0
        self.refused = 0

    def feed(self, data: bytes) -> list[Command]:
        """Take bytes and give back the commands that they complete, in order."""
        self._buffer += data
        commands = []
        while self._buffer:
            opcode = self._buffer[0]
            layout = self._layouts.get(opcode)  # type: ignore[call-overload]
            if layout is None:
                self.unknown_bytes += 1
                del self._buffer[0]
                continue
            length = _length(layout, self._buffer)
            if length is None or len(self._buffer) < length:
                break
            command = _cut(Opcode(opcode), layout, bytes(self._buffer[:length]))
            del self._buffer[:length]
            if _problem(command, layout):
                self.refused += 1
            else:
                commands.append(command)
        return commands


def _problem(command: Command, layout: Layout) -> str:
    """What is wrong with a command's arguments; empty when nothing is."""
    if len(command.arguments) != len(layout.arguments):
        return f"{len(layout.arguments)} arguments are needed, not {len(command.arguments)}"
    for argument, value in zip(layout.arguments, command.arguments, strict=True):
        if not argument.accepts(value):
            return f"{argument.name} must be {argument.lowest} to {argument.highest}, not {value}"
    if layout.tail is Tail.NOTES and len(command.tail) % 2:
        return "each note needs a duration"
    longest = layout.longest_tail * (2 if layout.tail is Tail.NOTES else 1)
    if len(command.tail) > longest:
        return f"at most {longest} bytes may follow, not {len(command.tail)}"
    wrong = [value for value in command.tail if not 0 <= value <= 255]
    return f"{wrong[0]} is no byte" if wrong else ""


def _fixed_size(layout: Layout) -> int:
    return 1 + struct.calcsize(">" + "".join(argument.code for argument in layout.arguments))


def _length(layout: Layout, data: bytearray) -> int | None:
    """How long the command at the front is; None while its count is not there."""
    fixed = _fixed_size(layout)
    if layout.tail is Tail.NOTHING:
        return fixed
    if len(data) <= fixed:
        return None
    return fixed + 1 + data[fixed] * (2 if layout.tail is Tail.NOTES else 1)


def _cut(opcode: Opcode, layout: Layout, data: bytes) -> Command:
    fixed = _fixed_size(layout)
    codes = ">" + "".join(argument.code for argument in layout.arguments)
    return Command(opcode, struct.unpack(codes, data[1:fixed]), tuple(data[fixed + 1 :]))
