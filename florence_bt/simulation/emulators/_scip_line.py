"""The way out of a scanner that is slow: bytes that wait for their moment."""

from __future__ import annotations

from collections import deque


class SlowLine:
    """Bytes leave in their order, each not before its time."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._free = 0.0

    def put(self, data: bytes, now: float, delay_s: float, bytes_per_second: float | None) -> None:
        """Send bytes.

        Args:
            data: The bytes.
            now: The time.
            delay_s: They leave so much later.
            bytes_per_second: How fast they leave; None for all at once.
        """
        if not data:
            return
        self._free = max(self._free, now + delay_s)
        if bytes_per_second is None:
            self._waiting.append((self._free, data))
            return
        for byte in data:
            self._free += 1.0 / bytes_per_second
            self._waiting.append((self._free, bytes([byte])))

    def take(self, now: float) -> bytes:
        """What leaves now."""
        out = []
        while self._waiting and self._waiting[0][0] <= now:
            out.append(self._waiting.popleft()[1])
        return b"".join(out)

    def take_all(self) -> bytes:
        """Everything that waits: the line is fast again."""
        out = b"".join(data for _, data in self._waiting)
        self.clear()
        return out

    def next_time(self) -> float | None:
        """When something leaves next, or None."""
        return self._waiting[0][0] if self._waiting else None

    def clear(self) -> None:
        """Lose what waits."""
        self._waiting.clear()
        self._free = 0.0
