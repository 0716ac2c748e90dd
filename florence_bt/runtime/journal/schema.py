"""The tables of the journal, and how an older file becomes one of this version.

``PRAGMA user_version`` holds the version. A change of the tables adds a step to :data:`STEPS`; a file of a
later version is not touched.
"""

from __future__ import annotations

import sqlite3

from florence_bt.core.errors import FlorenceError

JOURNAL_FILE = "journal.sqlite"
"""The name of the file in a folder of runs."""

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


class JournalTooNew(FlorenceError):
    """The file was written by a later version of this program."""


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
    """The version of a file, at most this program's.

    Raises:
        JournalTooNew: The file is of a later version.
        sqlite3.Error: The file cannot be read.
    """
    version = int(connection.execute("PRAGMA user_version").fetchone()[0])
    if version > VERSION:
        raise JournalTooNew(
            f"the journal has version {version}, this program knows up to {VERSION}; use a newer florence"
        )
    return version
