"""Writes what happens in runs. Never raises, never blocks the caller for long, reports an error once.

With ``background`` a thread of its own writes, so that a slow disk holds no tick up; ``flush`` then waits for
it, but only for a limited time. Without it everything is written within the call, for the rig and tests.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from queue import SimpleQueue
from typing import Annotated

from florence_bt.core.errors import ConfigError
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.journal.reader import JournalReader
from florence_bt.runtime.journal.rows import run_changes, run_values
from florence_bt.runtime.journal.schema import JOURNAL_FILE
from florence_bt.runtime.journal.store import (
    EventRow,
    Job,
    LastEntry,
    NewRun,
    RunTexts,
    RunUpdate,
    Store,
)
from florence_bt.runtime.journal.writer_guard import WriterGuard
from florence_bt.runtime.run import MissionRun

STATE_KINDS = frozenset(
    {
        EventKind.STARTED,
        EventKind.PAUSED,
        EventKind.RESUMED,
        EventKind.RECOVERED,
        EventKind.STOP_ASKED,
        EventKind.ENDED,
    }
)
"""Kinds that change the state of a run."""


HANGING_S = 0.05
"""Wait for an acknowledgement when the disk did not answer the last time."""


@dataclass(frozen=True, slots=True)
class JournalParameters(CheckedParameters):
    """The parameters of the journal.

    Attributes:
        keep_runs: How many runs that ended are kept, with their folders.
        events_per_run: How many events of one run are kept; what comes later is counted, not kept.
        max_waiting: How many jobs may wait in memory for a disk in trouble.
        flush_limit_s: Seconds that an acknowledgement waits for the disk at most.
        busy_s: Seconds to wait when another process locks the file.
    """

    keep_runs: Annotated[int, Limits(1)] = 1000
    events_per_run: Annotated[int, Limits(1)] = 200_000
    max_waiting: Annotated[int, Limits(1)] = 20_000
    flush_limit_s: NotNegative = 1.0
    busy_s: NotNegative = 0.5


class Journal:
    """Keeps events in ``journal.sqlite`` of a folder of runs.

    Args:
        folder: The folder of the runs; made when needed.
        parameters: How it is kept.
        background: Whether a thread of its own writes.
        date: Gives the date of an acceptance and of the last entry as text; now in UTC when not given.
        on_trouble: Told in one sentence that the journal cannot be written, and when it can again.
    """

    def __init__(
        self,
        folder: Path,
        parameters: JournalParameters | None = None,
        *,
        background: bool = False,
        date: Callable[[], str] | None = None,
        on_trouble: Callable[[str], None] | None = None,
    ) -> None:
        self.folder = folder
        self._parameters = parameters or JournalParameters()
        self._date = date or _utc_now
        self._on_trouble = on_trouble or (lambda text: None)
        store = Store(folder, self._parameters.keep_runs, self._parameters.busy_s)
        self._guard = WriterGuard(store, self._parameters.max_waiting)
        self._seq: dict[str, int] = {}
        self._batch: list[Job] = []
        self._handed = 0
        self._reported = ""
        self._slow = ""
        self._ended = ("", 0)
        self._older: frozenset[str] | None = None
        self._dropped: dict[str, int] = {}
        self._together = 0
        self._closed = False
        self._writer = _Writer(self._guard) if background else None

    @property
    def trouble(self) -> str:
        """Say what is wrong with the disk, empty when all is well."""
        return self._guard.trouble or self._slow or self._guard.prune_error

    def write(self, run: MissionRun, event: RunEvent) -> None:
        """Take an event; it is in the file after the next :meth:`commit`."""
        if self._closed:
            return
        run_id = run.run_id
        if run_id not in self._seq:
            self._open(run)
        seq = self._seq[run_id] = self._seq[run_id] + 1
        new_state = event.kind in STATE_KINDS
        if new_state or self._has_room(seq):
            self._batch.append(EventRow(run_id, seq, event))
        else:
            self._dropped[run_id] = self._dropped.get(run_id, 0) + 1
        if new_state:
            self._batch.append(RunUpdate(run_id, run_changes(run, self._dropped.get(run_id, 0))))
        if event.kind is EventKind.STARTED and run.texts:
            self._batch.append(RunTexts(run_id, run.texts))
        if event.kind is EventKind.ENDED or run_id == self._ended[0]:
            self._ended = run_id, self._seq.pop(run_id)
            self._dropped.pop(run_id, None)

    def continue_run(self, run_id: str, seq: int) -> None:
        """Go on with a run that is in the journal already; ``seq`` is the number of its last event."""
        self._seq[run_id] = seq

    def knows(self, run_id: str) -> bool:
        """Tell whether a run of this name was in the journal when this process began."""
        if self._older is None:
            self._older = self._read_ids()
        return run_id in self._older

    def exists(self) -> bool:
        """Tell whether there is a file already."""
        return (self.folder / JOURNAL_FILE).is_file()

    def set_aside(self, broken: str) -> None:
        """Move a file that cannot be read out of the way and begin a new one; only before the first write.

        Args:
            broken: What is wrong with the file.
        """
        self._guard.begin_again(broken)
        self._report()

    @contextmanager
    def together(self) -> Iterator[None]:
        """Bring everything that is written inside to the disk in one transaction, at the end."""
        self._together += 1
        try:
            yield
        finally:
            self._together -= 1
            self.flush()

    def commit(self) -> None:
        """Bring what was written so far to the disk."""
        if self._batch and not self._together:
            self._hand_over(try_again=False)
            self._report()

    def flush(self) -> None:
        """Commit as :meth:`commit` does, and return when it is there or the disk is in trouble."""
        if self._together or self._closed:
            return
        self._hand_over(try_again=True)
        if self._writer is not None and not self._guard.trouble:
            self._wait_for(self._writer)
        self._report()

    def close(self) -> None:
        """Write what is left and close the file; later events are not kept."""
        if self._closed:
            return
        self.flush()
        self._closed = True
        if self._writer is not None:
            self._writer.close()
        self._guard.close()

    def _open(self, run: MissionRun) -> None:
        """Begin with a run that is new, or go on with the last that ended: a listener of its end raised."""
        ended, seq = self._ended
        if run.run_id == ended:
            self._seq[ended] = seq
            return
        self._seq[run.run_id] = 0
        self._batch.append(NewRun(run_values(run, self._date())))

    def _wait_for(self, writer: _Writer) -> None:
        """Wait until all is written, for a limited time, and hardly at all while a disk is known to hang."""
        limit_s = self._parameters.flush_limit_s
        if writer.wait(min(limit_s, HANGING_S) if self._slow else limit_s):
            self._slow = ""
        else:
            self._slow = (
                f"the journal in {self.folder} was not written within {limit_s:g} s; "
                "if the process dies now, it lacks the latest events"
            )

    def _read_ids(self) -> frozenset[str]:
        if not self.exists():
            return frozenset()
        try:
            with JournalReader(self.folder) as reader:
                return frozenset(reader.run_ids())
        except ConfigError:
            return frozenset()  # writing will say what is wrong with the file

    def _has_room(self, seq: int) -> bool:
        waiting = self._handed + len(self._batch) - self._guard.done
        return seq <= self._parameters.events_per_run and waiting < self._parameters.max_waiting

    def _hand_over(self, *, try_again: bool) -> None:
        if self._closed:
            return
        batch, self._batch = self._batch, []
        if batch:
            batch.append(LastEntry(self._date()))
        self._handed += len(batch)
        if self._writer is not None:
            self._writer.put(batch, try_again=try_again)
        elif batch or self._guard.trouble:
            self._guard.put(batch, try_again=try_again)

    def _report(self) -> None:
        """Tell a trouble once, and its end."""
        trouble = self.trouble
        if trouble != self._reported:
            self._reported = trouble
            self._on_trouble(trouble or "the journal can be written again")


class _Writer:
    """The thread that writes."""

    def __init__(self, guard: WriterGuard) -> None:
        self._guard = guard
        self._queue: SimpleQueue[tuple[list[Job], bool] | threading.Event | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="journal", daemon=True)
        self._thread.start()

    def put(self, jobs: list[Job], *, try_again: bool) -> None:
        self._queue.put((jobs, try_again))

    def wait(self, limit_s: float) -> bool:
        reached = threading.Event()
        self._queue.put(reached)
        return reached.wait(limit_s)

    def close(self) -> None:
        self._queue.put(None)
        self._thread.join(timeout=5.0)

    def _work(self) -> None:
        while (item := self._queue.get()) is not None:
            if isinstance(item, threading.Event):
                item.set()
            else:
                self._guard.put(item[0], try_again=item[1])


def _utc_now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
