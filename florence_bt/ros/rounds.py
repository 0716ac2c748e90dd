"""A process that falls behind serves the newest of each topic, and says that it is late.

The events executor puts each message that comes into a queue without a bound, in the order of what comes in.
A process that has less time than its callbacks need would be later and later with everything in it, requests
and goals too. So its loop works in rounds: what had come in when one began is served, then its last entry
comes up in the queue and it ends. Within a round a topic of readings gets so many callbacks and no more; of
what comes beyond them the newest is served at its end, and the rest is left out. So a round takes no longer
than one callback of everything there is, and the queue stays as short.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

LATE_S = 1.0
"""A round that takes longer is late: then a process does not answer either (``SILENT_S`` of its heartbeats)."""


class Rounds:
    """The rounds of one loop.

    Args:
        later: Calls back when all is served that has come in so far.
        on_late: Is told how long a round took that was late, in steady seconds.
        now: Steady seconds.
    """

    def __init__(
        self,
        later: Callable[[Callable[[], None]], object],
        on_late: Callable[[float], object],
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.number = 0
        self._later = later
        self._on_late = on_late
        self._now = now
        self._began: float | None = None
        self._waiting: list[NewestReadings] = []

    def join(self) -> None:
        """Begin a round, unless there is one."""
        if self._began is None:
            self._began = self._now()
            self._later(self._end)

    def wait_for_end(self, readings: NewestReadings) -> None:
        """Serve what a topic has kept when the round ends."""
        self._waiting.append(readings)

    def _end(self) -> None:
        assert self._began is not None
        took_s, self._began = self._now() - self._began, None
        self.number += 1
        waiting, self._waiting = self._waiting, []
        for readings in waiting:
            readings.serve_kept(self)
        if took_s > LATE_S:
            self._on_late(took_s)


class NewestReadings:
    """The messages of one topic, of which the newest count.

    Args:
        callback: Takes a message, and what rclpy says about it.
        most: How many a round may serve.

    Attributes:
        left_out: How many were left out so far.
    """

    def __init__(self, callback: Callable[..., None], most: int = 1) -> None:
        self.left_out = 0
        self._callback = callback
        self._most = most
        self._kept: deque[tuple[Any, ...]] = deque(maxlen=most)
        self._round, self._served = -1, 0

    def take(self, rounds: Rounds, *message: Any) -> None:
        """Serve a message now, or keep it until the round has ended, if none that is newer comes."""
        rounds.join()
        if self._round != rounds.number:
            self._round, self._served = rounds.number, 0
        if self._served < self._most:
            self._served += 1
            self._callback(*message)
            return
        if not self._kept:
            rounds.wait_for_end(self)
        self.left_out += len(self._kept) == self._most
        self._kept.append(message)

    def serve_kept(self, rounds: Rounds) -> None:
        """Serve what was kept: it is the first of the next round."""
        kept = tuple(self._kept)
        self._kept.clear()
        for message in kept:
            self.take(rounds, *message)
