"""The SQLite file behind the journal: opens it, writes batches, drops old runs.

One thread uses a store after it was made. A batch is one transaction: all of it is in the file or nothing.
The write-ahead log survives the death of the process at any moment; ``synchronous = NORMAL`` also keeps the
file whole when the power fails (https://www.sqlite.org/wal.html, "Performance considerations").
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from florence_bt.runtime.events import RunEvent
from florence_bt.runtime.journal.rows import CHANGED_COLUMNS, EVENT_COLUMNS, RUN_COLUMNS, event_values
from florence_bt.runtime.journal.schema import JOURNAL_FILE, WRITTEN, check_version, make_tables
from florence_bt.runtime.run import FINAL, RunStatus

_NEW_RUN = f"INSERT INTO runs ({RUN_COLUMNS}) VALUES ({', '.join('?' * len(RUN_COLUMNS.split(',')))})"
_CHANGE = f"UPDATE runs SET {', '.join(f'{name} = ?' for name in CHANGED_COLUMNS)}, lost = ? WHERE run_id = ?"
_NUMBER = "SELECT id FROM runs WHERE run_id = ?"
_EVENT = (
    f"INSERT INTO events (run, {EVENT_COLUMNS}) VALUES (?, {', '.join('?' * len(EVENT_COLUMNS.split(',')))})"
)
_LAST_ENTRY = (
    "INSERT INTO notes (name, value) VALUES (?, ?) ON CONFLICT (name) DO UPDATE SET value = excluded.value"
)
_TEXT = "INSERT OR IGNORE INTO texts (hash, text) VALUES (?, ?)"
_RUN_TEXT = "INSERT OR REPLACE INTO run_texts (run, file, hash) SELECT id, ?, ? FROM runs WHERE run_id = ?"
_FINAL = ", ".join(f"'{name}'" for name in sorted(status.value for status in FINAL))


@dataclass(frozen=True, slots=True)
class NewRun:
    """A run was accepted; values of the columns of a run."""

    values: tuple[Any, ...]

    @property
    def run_id(self) -> str:
        """The run's name."""
        return str(self.values[0])


@dataclass(frozen=True, slots=True)
class RunUpdate:
    """The state of a run has changed; values of the columns."""

    run_id: str
    values: tuple[Any, ...]

    @property
    def final(self) -> bool:
        """Tell whether the run is over."""
        return RunStatus(self.values[0]) in FINAL


@dataclass(frozen=True, slots=True)
class RunTexts:
    """A run has begun; the texts of the files that it rests on, by file."""

    run_id: str
    texts: Mapping[Path, str]


@dataclass(frozen=True, slots=True)
class EventRow:
    """An event of a run."""

    run_id: str
    seq: int
    event: RunEvent


@dataclass(frozen=True, slots=True)
class LastEntry:
    """The date of the last entry; steady clocks do not outlive the machine."""

    date: str


Job = NewRun | RunUpdate | RunTexts | EventRow | LastEntry


class Store:
    """The file.

    Args:
        folder: The folder of the runs; made when needed.
        keep_runs: How many runs that ended are kept, with their folders.
        busy_s: Seconds to wait when another process locks the file.

    Attributes:
        path: The file.
    """

    def __init__(self, folder: Path, keep_runs: int, busy_s: float) -> None:
        self.folder = folder
        self.path = folder / JOURNAL_FILE
        self._keep_runs = keep_runs
        self._busy_s = busy_s
        self._connection: sqlite3.Connection | None = None
        self._inode = 0
        self._new_runs = keep_runs  # what older processes left counts too

    def apply(self, jobs: Iterable[Job]) -> None:
        """Write a batch.

        Raises:
            OSError: The folder or the file is out of reach.
            sqlite3.Error: The file is locked, full or broken; nothing of the batch was written.
        """
        jobs = list(jobs)
        connection = self._opened(fresh=any(isinstance(job, NewRun) for job in jobs))
        connection.execute("BEGIN IMMEDIATE")
        try:
            self._write(connection, jobs)
            connection.execute("COMMIT")
        except BaseException:
            if connection.in_transaction:
                connection.execute("ROLLBACK")
            raise
        self._new_runs += sum(isinstance(job, NewRun) for job in jobs)

    def set_aside(self) -> Path:
        """Move a file that is broken out of the way, so that a new one can begin.

        Raises:
            OSError: It cannot be moved.
        """
        self.close()
        number = 1
        while (target := self.path.with_name(f"{self.path.name}.broken-{number}")).exists():
            number += 1
        for suffix in ("", "-wal", "-shm"):
            file = self.path.with_name(self.path.name + suffix)
            if file.exists():
                file.rename(target.with_name(target.name + suffix))
        return target

    def close(self) -> None:
        """Close the file."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _opened(self, *, fresh: bool) -> sqlite3.Connection:
        """Return the connection, opened again if the file was removed; each new run checks that."""
        if self._connection is not None and fresh and not self._in_place():
            self.close()
        if self._connection is None:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._connection = self._connect()
            self._inode = self.path.stat().st_ino
        return self._connection

    def _connect(self) -> sqlite3.Connection:
        connection = sqlite3.connect(
            self.path, timeout=self._busy_s, isolation_level=None, check_same_thread=False
        )
        try:
            check_version(connection)  # before anything is written into a file of another version
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("PRAGMA synchronous = NORMAL")
            connection.execute("PRAGMA foreign_keys = ON")
            make_tables(connection)
        except BaseException:
            connection.close()
            raise
        return connection

    def _in_place(self) -> bool:
        try:
            return os.stat(self.path).st_ino == self._inode
        except FileNotFoundError:
            return False

    def _write(self, connection: sqlite3.Connection, jobs: list[Job]) -> None:
        numbers: dict[str, int | None] = {}
        for happened, some in groupby(jobs, _is_event):
            if happened:
                connection.executemany(_EVENT, _event_rows(connection, some, numbers))
                continue
            for job in some:
                match job:
                    case NewRun(values=values):
                        connection.execute(_NEW_RUN, values)
                    case RunUpdate(run_id=run_id, values=values):
                        connection.execute(_CHANGE, (*values, run_id))
                    case RunTexts(run_id=run_id, texts=texts):
                        for file, text in texts.items():
                            _write_text(connection, run_id, file, text)
                    case LastEntry(date=date):
                        connection.execute(_LAST_ENTRY, (WRITTEN, date))

    def prune(self) -> bool:
        """Drop the oldest runs that ended, beyond the number that is kept; once in many new runs.

        Returns:
            Whether it was time to do so.

        Raises:
            OSError: A folder cannot be removed; that run is kept, the others are dropped.
            sqlite3.Error: The file is locked or broken.
        """
        if self._connection is None or self._new_runs <= max(1, self._keep_runs // 10):
            return False
        self._new_runs = 0
        connection, problem = self._connection, None
        rows = connection.execute(
            f"SELECT id, run_id FROM runs WHERE state IN ({_FINAL}) ORDER BY id DESC LIMIT -1 OFFSET ?",
            (self._keep_runs,),
        ).fetchall()
        for number, run_id in rows:
            folder = self.folder / run_id
            try:
                if folder.parent == self.folder and folder.is_dir():
                    shutil.rmtree(folder)
            except OSError as error:
                problem = problem or error
            else:
                connection.execute("DELETE FROM runs WHERE id = ?", (number,))
        connection.execute("DELETE FROM texts WHERE hash NOT IN (SELECT hash FROM run_texts)")
        if problem is not None:
            raise problem
        return True


def _write_text(connection: sqlite3.Connection, run_id: str, file: Path, text: str) -> None:
    """Write that a run rests on a text, which is kept once for all runs."""
    fingerprint = hashlib.sha256(text.encode()).hexdigest()
    connection.execute(_TEXT, (fingerprint, text))
    connection.execute(_RUN_TEXT, (str(file), fingerprint, run_id))


def _is_event(job: Job) -> bool:
    return isinstance(job, EventRow)


def _event_rows(
    connection: sqlite3.Connection, jobs: Iterable[Job], numbers: dict[str, int | None]
) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of events; none for those of runs that are in the file no more.

    Args:
        connection: Where the numbers of the runs are looked up.
        jobs: The events.
        numbers: Name -> number of the runs that were looked up before in the same transaction.
    """
    for job in jobs:
        assert isinstance(job, EventRow)
        if job.run_id not in numbers:
            row = connection.execute(_NUMBER, (job.run_id,)).fetchone()
            numbers[job.run_id] = row[0] if row is not None else None
        number = numbers[job.run_id]
        if number is not None:
            yield number, *event_values(job.seq, job.event)
