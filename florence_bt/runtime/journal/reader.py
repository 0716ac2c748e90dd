"""Reads a journal: while it is being written, after a crash, and without the right to write."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from florence_bt.core.closing import Closing
from florence_bt.core.errors import ConfigError
from florence_bt.runtime.journal.rows import (
    EVENT_COLUMNS,
    RUN_COLUMNS,
    JournaledEvent,
    JournaledRun,
    event_from_row,
    run_from_row,
)
from florence_bt.runtime.journal.schema import (
    JOURNAL_FILE,
    WRITTEN,
    JournalBroken,
    check_version,
    is_damage,
    make_tables,
)
from florence_bt.runtime.run import FINAL

T = TypeVar("T")

WRITER_WAIT_S = 2.0
"""Seconds to wait for a writer. Chosen."""
_NOT_WRITABLE = frozenset({sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_PERM})


class JournalReader(Closing):
    """Reads the journal of a folder of runs. Use as a context manager.

    Args:
        folder: The folder of the runs.

    Every method raises :class:`ConfigError` when the file cannot be read, :class:`JournalBroken` when what
    it reads is damaged.

    Raises:
        JournalBroken: The file is not a journal, or it is damaged.
        ConfigError: The folder has no journal, or it is out of reach.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / JOURNAL_FILE
        if not self.path.is_file():
            raise ConfigError(
                f"there is no journal in {str(folder)!r}", valid=[f"a folder with a file {JOURNAL_FILE}"]
            )
        self._connection = self._open()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def runs(
        self, limit: int = 20, mission: str = "", state: str = "", *, skip: int = 0
    ) -> list[JournaledRun]:
        """Return runs, the latest first.

        Args:
            limit: At most this many.
            mission: Only runs of this mission, of all when empty.
            state: Only runs in this state (a name of :class:`RunStatus`), in all when empty.
            skip: Not the latest so many of them.
        """
        wanted = {"mission": mission, "state": state.upper()}
        filters = [f"{name} = :{name}" for name, value in wanted.items() if value]
        where = f"WHERE {' AND '.join(filters)} " if filters else ""
        query = f"SELECT {RUN_COLUMNS} FROM runs {where}ORDER BY id DESC LIMIT :limit OFFSET :skip"
        return self._made(run_from_row, query, {**wanted, "limit": limit, "skip": skip})

    def unfinished(self) -> list[JournaledRun]:
        """Return the runs without an end, the earliest first."""
        final = ", ".join(f"'{status.value}'" for status in sorted(FINAL, key=lambda status: status.value))
        query = f"SELECT {RUN_COLUMNS} FROM runs WHERE state NOT IN ({final}) ORDER BY id"
        return self._made(run_from_row, query, {})

    def run_ids(self) -> list[str]:
        """Return the names of all runs."""
        return [str(row[0]) for row in self._rows("SELECT run_id FROM runs", {})]

    def run(self, run_id: str) -> JournaledRun | None:
        """Return the run with this id, or None."""
        query = f"SELECT {RUN_COLUMNS} FROM runs WHERE run_id = :run_id"
        return next(iter(self._made(run_from_row, query, {"run_id": run_id})), None)

    def events(self, run_id: str, limit: int = -1) -> list[JournaledEvent]:
        """Return what happened in a run, in order.

        Args:
            run_id: The run.
            limit: At most so many events, the first ones; all when negative.
        """
        query = (
            f"SELECT {EVENT_COLUMNS} FROM events WHERE run = (SELECT id FROM runs WHERE run_id = :run_id) "
            "ORDER BY seq LIMIT :limit"
        )
        return self._made(event_from_row, query, {"run_id": run_id, "limit": limit})

    def texts(self, run_id: str) -> dict[Path, str]:
        """Return the texts of the files that a run rested on, as they were when it began, by file.

        Empty for a run that has not begun, or that a program has recorded which did not keep them.
        """
        if not self._rows("SELECT 1 FROM sqlite_master WHERE name = 'run_texts'", {}):
            return {}
        query = (
            "SELECT file, text FROM run_texts JOIN texts USING (hash) "
            "WHERE run = (SELECT id FROM runs WHERE run_id = :run_id) ORDER BY file"
        )
        return {Path(file): text for file, text in self._made(tuple, query, {"run_id": run_id})}

    def last_entry(self) -> str:
        """Return the date and time (UTC) of the last entry, empty when unknown."""
        rows = self._rows("SELECT value FROM notes WHERE name = :name", {"name": WRITTEN})
        return str(rows[0][0]) if rows else ""

    def _made(self, make: Callable[[Any], T], query: str, values: dict[str, Any]) -> list[T]:
        try:
            return [make(row) for row in self._rows(query, values)]
        except ValueError as error:
            raise JournalBroken(
                f"the journal cannot be read: a row is broken: {error}", file=self.path
            ) from error

    def _rows(self, query: str, values: dict[str, Any]) -> list[Any]:
        try:
            return self._connection.execute(query, values).fetchall()
        except (sqlite3.Error, UnicodeDecodeError) as error:
            raise self._unreadable(error) from error

    def _open(self) -> sqlite3.Connection:
        try:
            return _open(self.path)
        except (sqlite3.Error, UnicodeDecodeError) as error:
            raise self._unreadable(error) from error

    def _unreadable(self, error: Exception) -> ConfigError:
        # Text that is not UTF-8 has no code of SQLite, because Python notices it.
        damaged = is_damage(error) or not hasattr(error, "sqlite_errorcode")
        kind = JournalBroken if damaged else ConfigError
        return kind(f"the journal cannot be read: {error}", file=self.path)


def _open(path: Path) -> sqlite3.Connection:
    """Open for reading; a file whose folder cannot be written to is read as it lies there."""
    uri = path.absolute().as_uri()
    for option in ("mode=ro", "immutable=1"):
        connection = sqlite3.connect(f"{uri}?{option}", uri=True, timeout=WRITER_WAIT_S, isolation_level=None)
        try:
            check_version(connection)
            if connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
                connection.execute("SELECT count(*) FROM runs").fetchone()
                return connection
            connection.close()
            return _empty()
        except sqlite3.OperationalError as error:
            connection.close()
            if option == "immutable=1" or error.sqlite_errorcode & 0xFF not in _NOT_WRITABLE:
                raise
        except BaseException:
            connection.close()
            raise
    raise AssertionError("unreachable")


def _empty() -> sqlite3.Connection:
    """Open an empty journal, as left by a writer that died before it made the tables."""
    connection = sqlite3.connect(":memory:", isolation_level=None)
    make_tables(connection)
    return connection
