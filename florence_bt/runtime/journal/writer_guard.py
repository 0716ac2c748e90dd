"""Writes jobs to the store and handles its errors: what cannot be written waits and is tried again."""

from __future__ import annotations

import sqlite3
from collections import Counter
from dataclasses import replace
from typing import Any

from florence_bt.core.errors import FlorenceError
from florence_bt.runtime.journal.schema import JournalBroken, is_damage
from florence_bt.runtime.journal.store import EventRow, Job, LastEntry, NewRun, RunUpdate, Store

_NOT_TO_BE_KEPT = (sqlite3.IntegrityError, sqlite3.DataError, sqlite3.ProgrammingError)
"""One of the jobs is wrong, not the disk."""


class WriterGuard:
    """Writes to a store.

    Args:
        store: The store.
        max_waiting: How many jobs may wait for a disk that works again; beyond, events are dropped, then the
            oldest runs.

    Attributes:
        trouble: What is wrong with the disk, empty when all is well.
        prune_error: Why old runs cannot be dropped, empty when all is well; new runs are kept anyway.
        done: How many jobs were taken so far, written or not.
    """

    def __init__(self, store: Store, max_waiting: int) -> None:
        self.trouble = ""
        self.prune_error = ""
        self.done = 0
        self._store = store
        self._max_waiting = max_waiting
        self._waiting: list[Job] = []
        self._lost: Counter[str] = Counter()
        self._open: dict[str, NewRun] = {}
        """The runs that began here and have no end yet: a file that begins again needs their rows."""

    def put(self, jobs: list[Job], *, try_again: bool) -> None:
        """Write jobs, those first that still wait.

        Args:
            jobs: What is new.
            try_again: Whether to try although the disk was in trouble the last time.
        """
        self._waiting += jobs
        self.done += len(jobs)
        for job in jobs:
            if isinstance(job, NewRun):
                self._open[job.run_id] = job
        if not self.trouble or try_again:
            self._write()
        if len(self._waiting) > self._max_waiting:
            self._make_room()

    def close(self) -> None:
        """Write what waits, if possible, and close the file."""
        if self._waiting:
            self._write()
        self._store.close()

    def _write(self) -> None:
        try:
            self._store.apply(self._with_losses())
        except _NOT_TO_BE_KEPT as error:
            self._write_one_by_one(error)
        except (sqlite3.DatabaseError, UnicodeDecodeError, JournalBroken) as error:
            self.trouble = f"the journal {self._store.path} cannot be written: {error}"
            if isinstance(error, JournalBroken) or is_damage(error):
                self.begin_again(str(error))
        except (OSError, FlorenceError) as error:
            self.trouble = f"the journal {self._store.path} cannot be written: {error}"
        except Exception as error:
            # Whatever it is, the thread that writes must live on.
            self._write_one_by_one(error)
        else:
            self._written()
            self.trouble = ""
            self._prune()

    def _write_one_by_one(self, problem: Exception) -> None:
        """Keep the other jobs when one cannot be kept."""
        jobs, self._waiting = self._with_losses(), []
        for index, job in enumerate(jobs):
            try:
                self._store.apply([job])
            except _NOT_TO_BE_KEPT as error:
                problem = error
            except (OSError, sqlite3.Error, FlorenceError) as error:
                # That is the disk: the rest waits for it.
                self._waiting = jobs[index:]
                self.trouble = f"the journal {self._store.path} cannot be written: {error}"
                return
            except Exception as error:
                problem = error
        what = f"{type(problem).__name__}: {problem}"
        self.trouble = f"the journal {self._store.path} cannot keep an event: {what}"

    def _written(self) -> None:
        for job in self._waiting:
            if isinstance(job, RunUpdate) and job.final:
                self._open.pop(job.run_id, None)
        self._waiting.clear()

    def _prune(self) -> None:
        try:
            if self._store.prune():
                self.prune_error = ""
        except (OSError, sqlite3.Error) as error:
            self.prune_error = f"old runs cannot be dropped from {self._store.folder}: {error}"

    def begin_again(self, broken: str) -> None:
        """Move a damaged file out of the way and begin a new one; says so in :attr:`trouble`.

        Args:
            broken: What is wrong with the file.
        """
        try:
            aside = self._store.set_aside()
            waiting = self._with_losses()
            rows = [row for row in self._open.values() if row not in waiting]
            self._store.apply([*rows, *waiting])
        except (OSError, sqlite3.Error) as error:
            self.trouble = f"the journal {self._store.path} is broken and cannot be replaced: {error}"
        else:
            self._written()
            self.trouble = f"the journal was broken ({broken}); it was moved to {aside}, a new one began"

    def _make_room(self) -> None:
        """Keep of each run its row and its last state, and the last date; the latest runs of all."""
        last: dict[Any, Job] = {}
        for job in self._waiting:
            match job:
                case EventRow(run_id=run_id):
                    self._lost[run_id] += 1
                case RunUpdate(run_id=run_id):
                    last[run_id] = job
                case LastEntry():
                    last[LastEntry] = job
                case _:
                    last[id(job)] = job
        self._waiting = list(last.values())[-self._max_waiting :]

    def _with_losses(self) -> list[Job]:
        """Return what waits; the last change of a run says how many of its events were dropped."""
        if not self._lost:
            return self._waiting
        return [
            replace(job, values=(*job.values[:-1], job.values[-1] + self._lost[job.run_id]))
            if isinstance(job, RunUpdate)
            else job
            for job in self._waiting
        ]
