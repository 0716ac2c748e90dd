"""Where a command ends and the next begins; written from the manual (REFERENCE 1.3), not from the driver."""

from __future__ import annotations

_COUNTED, _SONG = -1, -2
_ARGUMENTS: dict[int, int] = (
    dict.fromkeys((7, 128, 130, 131, 132, 134, 135, 143, 153, 154), 0)
    | dict.fromkeys((129, 136, 138, 141, 142, 147, 150, 151, 155, 158), 1)
    | dict.fromkeys((156, 157), 2)
    | dict.fromkeys((139, 144), 3)
    | dict.fromkeys((137, 145), 4)
    | dict.fromkeys((148, 149, 152), _COUNTED)
    | {140: _SONG}
)
"""Bytes after each opcode; counted: a count and as many bytes; song: its number, a count, as many pairs."""


class CommandReader:
    """Collects bytes and gives whole commands; what is no opcode is dropped.

    Attributes:
        unknown_bytes: Bytes that were dropped so far.
    """

    def __init__(self) -> None:
        self._input = bytearray()
        self.unknown_bytes = 0

    def feed(self, data: bytes) -> None:
        """Take bytes from the line, in pieces of any size."""
        self._input += data

    def clear(self) -> None:
        """Forget what is waiting."""
        self._input.clear()

    def take(self) -> bytes | None:
        """The next whole command, opcode first; None when there is none yet."""
        while self._input and self._input[0] not in _ARGUMENTS:
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

    def _length(self) -> int | None:
        """How long the first command is with its opcode; None while its count is not there."""
        arguments = _ARGUMENTS[self._input[0]]
        if arguments == _COUNTED:
            return 2 + self._input[1] if len(self._input) > 1 else None
        if arguments == _SONG:
            return 3 + 2 * self._input[2] if len(self._input) > 2 else None
        return 1 + arguments
