"""Songs that a base stores and plays (REFERENCE 1.3, opcodes 140 and 141)."""

from __future__ import annotations

LONGEST = 16
TICKS_PER_S = 64.0


class Songs:
    """Stores songs and plays one at a time.

    Attributes:
        number: The song that was played last.
        played: Every song that was begun, by its number, in order.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._notes: dict[int, bytes] = {}
        self._end: float | None = None
        self.number = 0
        self.played: list[int] = []

    @property
    def playing(self) -> bool:
        """Whether a song plays now."""
        return self._end is not None

    def define(self, arguments: bytes) -> bool:
        """Store a song: its number, its length, notes and durations in turn.

        Returns:
            Whether it was stored: the number and the length must be possible.
        """
        number, length = arguments[0], arguments[1]
        if number >= self._count or not 1 <= length <= LONGEST:
            return False
        self._notes[number] = arguments[2:]
        return True

    def notes(self, number: int) -> bytes:
        """Notes and durations of a song in turn; none when it is not stored."""
        return self._notes.get(number, b"")

    def play(self, number: int, now: float) -> bool:
        """Play a song; nothing happens while another one plays, or when there is none of that number."""
        if self.playing or number not in self._notes:
            return False
        self.number = number
        self.played.append(number)
        self._end = now + sum(self._notes[number][1::2]) / TICKS_PER_S
        return True

    def update(self, now: float) -> None:
        """Let the time pass."""
        if self._end is not None and now >= self._end:
            self._end = None

    def forget(self) -> None:
        """The power went."""
        self._notes.clear()
        self._end = None
        self.number = 0
