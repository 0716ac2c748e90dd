"""Bytes that must be sent with waits between them, as deadlines instead of sleeps."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable


class Script:
    """A list of (bytes, seconds to wait after them), sent step by step."""

    def __init__(self) -> None:
        self._steps: deque[tuple[bytes, float]] = deque()
        self._due: float | None = None

    @property
    def due(self) -> float | None:
        """When the next step (or the end of the last wait) is due; None when the script is over."""
        return self._due

    @property
    def busy(self) -> bool:
        """Whether something is left to send or to wait for."""
        return self._due is not None

    def begin(self, steps: Iterable[tuple[bytes, float]], now: float) -> None:
        """Start anew; whatever was left of an older script is forgotten."""
        self._steps = deque(steps)
        self._due = now

    def take(self, now: float) -> bytes:
        """The bytes that are due by now."""
        out = b""
        while self._due is not None and now >= self._due:
            if not self._steps:
                self._due = None
                break
            data, wait_s = self._steps.popleft()
            out += data
            # From now on, not from when it was due: a late call must not shorten the wait.
            self._due = now + wait_s
        return out
