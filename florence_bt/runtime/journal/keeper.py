"""Brings jobs to the store and copes with its troubles: what cannot be written waits and is tried again."""

from __future__ import annotations

import sqlite3
from collections import Counter
from dataclasses import replace

from florence_bt.core.errors import FlorenceError
from florence_bt.runtime.journal.store import Change, Happened, Job, Store

MALFORMED = ("malformed", "not a database", "disk image")
"""What SQLite says about a file that is broken."""


class Keeper:
    """Writes to a store.

    Args:
        store: The store.
        max_waiting: How many jobs may wait for a disk that works again; beyond, events are dropped, not runs.

    Attributes:
        trouble: What is wrong with the disk, empty when all is well.
        done: How many jobs were taken so far, written or not.
    """

    def __init__(self, store: Store, max_waiting: int) -> None:
        self.trouble = ""
        self.done = 0
        self._store = store
        self._max_waiting = max_waiting
        self._waiting: list[Job] = []
        self._lost: Counter[str] = Counter()

    def put(self, jobs: list[Job], *, try_again: bool) -> None:
        """Write jobs, those first that still wait.

        Args:
            jobs: What is new.
            try_again: Whether to try although the disk was in trouble the last time.
        """
        self._waiting += jobs
        self.done += len(jobs)
        if not self.trouble or try_again:
            self._write()
        if len(self._waiting) > self._max_waiting:
            self._drop_events()

    def close(self) -> None:
        """Write what waits, if possible, and close the file."""
        if self._waiting:
            self._write()
        self._store.close()

    def _write(self) -> None:
        try:
            self._store.apply(self._with_losses())
        except (sqlite3.IntegrityError, sqlite3.DataError, sqlite3.ProgrammingError) as error:
            self._write_one_by_one(error)
        except sqlite3.DatabaseError as error:
            self.trouble = f"the journal {self._store.path} cannot be written: {error}"
            if any(word in str(error) for word in MALFORMED):
                self._begin_anew(error)
        except (OSError, FlorenceError) as error:
            self.trouble = f"the journal {self._store.path} cannot be written: {error}"
        except (ValueError, OverflowError) as error:
            self._write_one_by_one(error)
        else:
            self._waiting.clear()
            self.trouble = ""

    def _write_one_by_one(self, problem: Exception) -> None:
        """One of the jobs cannot be kept: keep the others."""
        jobs, self._waiting = self._with_losses(), []
        for job in jobs:
            try:
                self._store.apply([job])
            except (ValueError, OverflowError, OSError, sqlite3.Error, FlorenceError) as error:
                problem = error
        self.trouble = f"the journal {self._store.path} cannot keep an event: {problem}"

    def _begin_anew(self, broken: sqlite3.DatabaseError) -> None:
        try:
            aside = self._store.set_aside()
            self._store.apply(self._with_losses())
        except (OSError, sqlite3.Error) as error:
            self.trouble = f"the journal {self._store.path} is broken and cannot be replaced: {error}"
        else:
            self._waiting.clear()
            self.trouble = f"the journal was broken ({broken}); it was moved to {aside}, a new one began"

    def _drop_events(self) -> None:
        kept: list[Job] = []
        for job in self._waiting:
            if isinstance(job, Happened):
                self._lost[job.run_id] += 1
            else:
                kept.append(job)
        self._waiting = kept

    def _with_losses(self) -> list[Job]:
        """What waits; the last change of a run says how many of its events were dropped."""
        if not self._lost:
            return self._waiting
        return [
            replace(job, values=(*job.values[:-1], job.values[-1] + self._lost[job.run_id]))
            if isinstance(job, Change)
            else job
            for job in self._waiting
        ]
