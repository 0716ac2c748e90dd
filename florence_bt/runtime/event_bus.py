"""Publishes what happens in runs: first to the event log, which must not lose it, then to the listeners.

A listener that raises ends no run: its error is published as an event of its own, once per run.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from florence_bt.core.clock import Clock
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.run import MissionRun

Listener = Callable[[MissionRun, RunEvent], None]

ACKNOWLEDGED = frozenset(
    {
        EventKind.QUEUED,
        EventKind.STARTED,
        EventKind.PAUSED,
        EventKind.RESUMED,
        EventKind.RECOVERED,
        EventKind.STOP_ASKED,
        EventKind.ENDED,
    }
)
"""Kinds that somebody outside relies on: they are safe in the log before any listener gets them."""


class EventLog(Protocol):
    """The log that keeps events (the journal). None of its methods raises or waits for long."""

    @property
    def trouble(self) -> str:
        """Say why events cannot be kept at the moment, empty when all is well."""

    def write(self, run: MissionRun, event: RunEvent) -> None:
        """Take an event; it may be kept in memory until :meth:`commit`."""

    def commit(self) -> None:
        """Bring what was written so far to the disk, perhaps in the background."""

    def flush(self) -> None:
        """Commit as :meth:`commit` does, and return when it is there."""

    def knows(self, run_id: str) -> bool:
        """Tell whether an older process used this name for a run."""


class NoLog:
    """Keeps nothing."""

    trouble = ""

    def write(self, run: MissionRun, event: RunEvent) -> None:
        """Forget the event."""

    def commit(self) -> None:
        """Do nothing: there is nothing to keep."""

    def flush(self) -> None:
        """Do nothing: there is nothing to keep."""

    def knows(self, run_id: str) -> bool:
        """Return False."""
        return False


class EventBus:
    """Publishes events.

    Args:
        clock: Gives the times of the events.
        log: Where they are kept.
    """

    def __init__(self, clock: Clock, log: EventLog) -> None:
        self.log = log
        self._clock = clock
        self._listeners: list[Listener] = []
        self._broken: tuple[str, list[Callable[..., None]]] = ("", [])

    def add_listener(self, listener: Listener) -> None:
        """Call back with the run at every event."""
        self._listeners.append(listener)

    def publish(self, run: MissionRun, kind: EventKind, *, since: float | None = None, **data: Any) -> None:
        """Publish an event of a run.

        Args:
            run: The run.
            kind: What happened.
            since: When the tick began that it belongs to: whatever a tick measures begins no earlier, and
                whatever wakes the next one has ended by its beginning. Now when not given.
            **data: Details.
        """
        if run.status.final and kind is not EventKind.ENDED:
            return  # a skill that reports its end after its run was closed without it
        time = self._clock.now() if since is None else since
        event = RunEvent(time, run.run_id, kind, data, run.ticks)
        self.log.write(run, event)
        self._notify(run, event)

    @contextmanager
    def publishing(self, run: MissionRun, kind: EventKind, **data: Any) -> Iterator[None]:
        """Publish an event around what is urgent: the log has it first, the listeners get it afterwards."""
        event = RunEvent(self._clock.now(), run.run_id, kind, data, run.ticks)
        self.log.write(run, event)
        yield
        self._notify(run, event)

    def publish_error(self, run: MissionRun, error: Exception) -> None:
        """Publish an exception that must not end the executor."""
        self.publish(run, EventKind.BROKEN, detail="".join(traceback.format_exception(error)))

    def call(self, run: MissionRun, callback: Callable[..., None], *arguments: Any) -> None:
        """Call somebody who only listens; an error is published once per run and listener."""
        try:
            callback(run, *arguments)
        except Exception as error:
            run_id, reported = self._broken if self._broken[0] == run.run_id else (run.run_id, [])
            if callback not in reported:
                self._broken = (run_id, [*reported, callback])
                self._publish_listener_error(run, callback, error)

    def _notify(self, run: MissionRun, event: RunEvent) -> None:
        if event.kind in ACKNOWLEDGED:
            self.log.flush()
        for listener in tuple(self._listeners):
            self.call(run, listener, event)

    def _publish_listener_error(
        self, run: MissionRun, callback: Callable[..., None], error: Exception
    ) -> None:
        detail = "".join(traceback.format_exception(error))
        event = RunEvent(self._clock.now(), run.run_id, EventKind.BROKEN, {"detail": detail}, run.ticks)
        self.log.write(run, event)
        for listener in tuple(self._listeners):
            if listener != callback:
                self.call(run, listener, event)
