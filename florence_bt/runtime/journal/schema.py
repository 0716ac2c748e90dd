"""The tables of the journal, and how an older file becomes one of this version.

``PRAGMA user_version`` holds the version. A change of the tables adds a step to :data:`STEPS`; a file of a
later version is not touched: this version keeps a file of its own beside it.
"""

from __future__ import annotations

import sqlite3

from florence_bt.core.errors import ConfigError

JOURNAL_FILE = "journal.sqlite"
"""The name of the file in a folder of runs."""

WRITTEN = "written"
"""The name of the date of the last entry in the table ``notes``."""

_FIRST = """
CREATE TABLE runs (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    run_id TEXT NOT NULL UNIQUE,
    mission TEXT NOT NULL,
    caller TEXT NOT NULL,
    policy TEXT NOT NULL,
    priority INTEGER NOT NULL,
    inputs TEXT NOT NULL,
    version TEXT NOT NULL,
    accepted TEXT NOT NULL,
    state TEXT NOT NULL,
    note TEXT NOT NULL DEFAULT '',
    code TEXT NOT NULL DEFAULT '',
    reason TEXT NOT NULL DEFAULT '',
    cause TEXT NOT NULL DEFAULT '',
    outputs TEXT NOT NULL DEFAULT '{}',
    started REAL,
    ended REAL,
    ticks INTEGER NOT NULL DEFAULT 0,
    tree TEXT NOT NULL DEFAULT '',
    lost INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE events (
    run INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,
    seq INTEGER NOT NULL,
    time REAL NOT NULL,
    tick INTEGER NOT NULL,
    kind TEXT NOT NULL,
    node TEXT,
    old TEXT,
    new TEXT,
    code TEXT,
    reason TEXT,
    skill TEXT,
    inputs TEXT,
    outputs TEXT,
    data TEXT,
    PRIMARY KEY (run, seq)
) WITHOUT ROWID;
CREATE TABLE notes (name TEXT PRIMARY KEY, value TEXT NOT NULL);
"""

STEPS: tuple[str, ...] = (_FIRST,)
"""The script that leads from version n to version n + 1."""
VERSION = len(STEPS)
OWN_FILE = f"journal-v{VERSION}.sqlite"
"""The name of the file when :data:`JOURNAL_FILE` is of a later version."""

_UNREACHABLE = frozenset(
    {
        sqlite3.SQLITE_AUTH,
        sqlite3.SQLITE_BUSY,
        sqlite3.SQLITE_CANTOPEN,
        sqlite3.SQLITE_FULL,
        sqlite3.SQLITE_INTERRUPT,
        sqlite3.SQLITE_IOERR,
        sqlite3.SQLITE_LOCKED,
        sqlite3.SQLITE_NOLFS,
        sqlite3.SQLITE_NOMEM,
        sqlite3.SQLITE_PERM,
        sqlite3.SQLITE_PROTOCOL,
        sqlite3.SQLITE_READONLY,
    }
)
"""What SQLite reports of a disk or a lock; the file may be whole (https://www.sqlite.org/rescode.html)."""


class JournalTooNew(ConfigError):
    """The file was written by a later version of this program."""


class JournalBroken(ConfigError):
    """The content of the file is damaged: reading it again does not help."""


def is_damage(error: Exception) -> bool:
    """Tell whether an error of SQLite means that the file is damaged, not that it is out of reach.

    Text that is not UTF-8 comes as ``UnicodeDecodeError`` when it is in a message of SQLite itself.
    """
    if isinstance(error, UnicodeDecodeError):
        return True
    code = getattr(error, "sqlite_errorcode", None)
    return code is not None and code & 0xFF not in _UNREACHABLE


def bring_up_to_date(connection: sqlite3.Connection) -> None:
    """Make the tables of a new file, or change those of an older one.

    Raises:
        JournalTooNew: The file is of a later version.
        sqlite3.Error: The file cannot be changed.
    """
    version = check_version(connection)
    for number in range(version, VERSION):
        script = f"BEGIN IMMEDIATE; {STEPS[number]} PRAGMA user_version = {number + 1}; COMMIT;"
        connection.executescript(script)


def check_version(connection: sqlite3.Connection) -> int:
    """Return the version of a file, at most this program's.

    Raises:
        JournalTooNew: The file is of a later version.
        JournalBroken: The version is below zero.
        sqlite3.Error: The file cannot be read.
    """
    version = int(connection.execute("PRAGMA user_version").fetchone()[0])
    if version > VERSION:
        raise JournalTooNew(
            f"the journal has version {version}, this program knows up to {VERSION}",
            valid=["a newer florence"],
        )
    if version < 0:
        raise JournalBroken(f"the journal has the version {version}")
    return version
