"""The boot loader of an emulated base: it prints its texts and hears nothing for a while (REFERENCE 1.1)."""

from __future__ import annotations

from collections.abc import Sequence

BOOT_S = 3.0
"""How long it runs after a reset: input is ignored and the digital outputs are high."""


class BootLoader:
    """Runs after power-on and after a reset."""

    def __init__(self, texts: Sequence[tuple[float, bytes]]) -> None:
        """Take what it prints.

        Args:
            texts: Each with the seconds from the start until it is printed.
        """
        self._texts = texts
        self._end: float | None = None
        self._waiting: list[tuple[float, bytes]] = []

    @property
    def running(self) -> bool:
        """Whether the base hears nothing because of it."""
        return self._end is not None

    def start(self, now: float) -> None:
        """Begin."""
        self._end = now + BOOT_S
        self._waiting = [(now + after_s, text) for after_s, text in self._texts]

    def stop(self) -> None:
        """The power went."""
        self._end = None
        self._waiting = []

    def ends(self, now: float) -> bool:
        """Whether it has come to its end by now; true once."""
        over = self._end is not None and now >= self._end
        if over:
            self._end = None
        return over

    def take(self, now: float) -> bytes:
        """What it has printed since the last call."""
        due = [text for when, text in self._waiting if now >= when]
        self._waiting = self._waiting[len(due) :]
        return b"".join(due)
