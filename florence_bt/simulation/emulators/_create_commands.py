"""Where a command ends and the next begins; written from the manual (REFERENCE 1.3), not from the driver."""

from __future__ import annotations

from collections.abc import Mapping

from florence_bt.simulation.emulators._create_models import COUNTED, SONG


class CommandReader:
    """Collects bytes and gives whole commands; what is no opcode is dropped.

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
        """The next whole command, opcode first; None when there is none yet."""
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
        """Forget the command whose end is ignored; what comes after the wait is no part of it."""
        whole = []
        while (command := self.take()) is not None:
            whole.append(command)
        self._input[:] = b"".join(whole)

    def _length(self) -> int | None:
        """How long the first command is with its opcode; None while its count is not there."""
        arguments = self._commands[self._input[0]]
        if arguments == COUNTED:
            return 2 + self._input[1] if len(self._input) > 1 else None
        if arguments == SONG:
            return 3 + 2 * self._input[2] if len(self._input) > 2 else None
        return 1 + arguments
