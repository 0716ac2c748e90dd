"""Bytes that must be sent with waits between them, as deadlines instead of sleeps."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a script.

    Attributes:
        data: What to send.
        wait_s: Seconds before the next step.
        rts: Level of the line RTS from now on; None leaves it.
    """

    data: bytes = b""
    wait_s: float = 0.0
    rts: bool | None = None


class Script:
    """A list of steps, sent one by one.

    Attributes:
        rts: The level of the line RTS that the last step asked for; None when none did.
    """

    def __init__(self) -> None:
        self._steps: deque[Step] = deque()
        self._due: float | None = None
        self._waits_since = 0.0
        self.rts: bool | None = None

    @property
    def due(self) -> float | None:
        """When the next step (or the end of the last wait) is due; None when the script is over."""
        return self._due

    @property
    def busy(self) -> bool:
        """Whether something is left to send or to wait for."""
        return self._due is not None

    def begin(self, steps: Iterable[Step], now: float) -> None:
        """Start anew; whatever was left of an older script is forgotten."""
        self._steps = deque(steps)
        self._due = self._waits_since = now

    def take(self, now: float) -> bytes:
        """The bytes that are due by now."""
        out = b""
        if self._due is not None and now < self._waits_since:  # the clock was set back
            self._due += now - self._waits_since
            self._waits_since = now
        while self._due is not None and now >= self._due:
            if not self._steps:
                self._due = None
                break
            step = self._steps.popleft()
            self._waits_since = now
            out += step.data
            if step.rts is not None:
                self.rts = step.rts
                # The line changes after the bytes are out: whoever sends must look before the next step.
                self._due = now + step.wait_s
                break
            # From now on, not from when it was due: a late call must not shorten the wait.
            self._due = now + step.wait_s
        return out
