"""The tables of the journal. ``PRAGMA user_version`` holds their version; a file of another one is broken."""

from __future__ import annotations

import sqlite3

from florence_bt.core.errors import ConfigError

JOURNAL_FILE = "journal.sqlite"
"""The name of the file in a folder of runs."""

WRITTEN = "written"
"""The name of the date of the last entry in the table ``notes``."""

_TABLES = """
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

_LATER_TABLES = """
CREATE TABLE IF NOT EXISTS texts (hash TEXT PRIMARY KEY, text TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS run_texts (
    run INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,
    file TEXT NOT NULL,
    hash TEXT NOT NULL,
    PRIMARY KEY (run, file)
) WITHOUT ROWID;
"""
"""Tables that a file of this version may lack: older programs wrote it, and need not know them to read it."""

VERSION = 1
"""The version of these tables."""

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
"""Reports of SQLite about a disk or a lock; the file may be whole (https://www.sqlite.org/rescode.html)."""


class JournalBroken(ConfigError):
    """The content of the file is damaged, or of another version: reading it again does not help."""


def is_damage(error: Exception) -> bool:
    """Tell whether an error of SQLite means that the file is damaged, not that it is out of reach.

    Text that is not UTF-8 comes as ``UnicodeDecodeError`` when it is in a message of SQLite itself.
    """
    if isinstance(error, UnicodeDecodeError):
        return True
    code = getattr(error, "sqlite_errorcode", None)
    return code is not None and code & 0xFF not in _UNREACHABLE


def make_tables(connection: sqlite3.Connection) -> None:
    """Make the tables of a new file, and those that an older program has not made.

    Raises:
        JournalBroken: The file is of another version.
        sqlite3.Error: The file cannot be changed.
    """
    if not check_version(connection):
        connection.executescript(f"BEGIN IMMEDIATE; {_TABLES} PRAGMA user_version = {VERSION}; COMMIT;")
    connection.executescript(_LATER_TABLES)


def check_version(connection: sqlite3.Connection) -> int:
    """Return the version of a file, 0 before it has tables.

    Raises:
        JournalBroken: It is none of this program's.
        sqlite3.Error: The file cannot be read.
    """
    version = int(connection.execute("PRAGMA user_version").fetchone()[0])
    if version not in (0, VERSION):
        raise JournalBroken(f"the journal has version {version}, this program has version {VERSION}")
    return version
