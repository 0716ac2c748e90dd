"""Whatever stands in the file of the journal: a start copes with it, says so, and what comes next is kept."""

from __future__ import annotations

import random
import shutil
import sqlite3
from contextlib import suppress

import pytest

from florence_bt.app.runs.journal_view import run_text, runs_table
from florence_bt.core.errors import ConfigError
from florence_bt.runtime.journal import JOURNAL_FILE, JournalReader
from florence_bt.runtime.journal.schema import VERSION
from florence_bt.runtime.run import RunStatus, TriggerPolicy
from tests.sweeps import sweep
from tests.unit.runtime.recovery_bench import Process, missions, trip

TRIES, CHUNK = 40, 8
"""How many seeds there are of each kind of damage, and how many a test has."""
VALUES = (
    None,
    -1,
    2**62,
    1.5,
    float("inf"),
    "",
    "\ud7ff?",
    "[]",
    "{torn",
    "[" * 5000,
    '{"x": 1}',
    b"\xff\xfe",
)
TABLES = {
    "runs": "run_id mission caller policy priority inputs accepted state reason outputs started ticks",
    "events": "seq time tick kind node old new code skill inputs outputs data",
}
ANY = {"runs": "mission", "events": "node"}
"""A column that takes any text."""


@pytest.fixture(scope="module")
def wreck(tmp_path_factory):
    """The files of a journal whose process died on one run while another one waited: name -> bytes."""
    folder = tmp_path_factory.mktemp("wreck")
    missions(folder, "resume")
    first = Process(folder)
    first.executor.trigger(trip())
    first.clock.advance(60.0)
    first.executor.trigger(trip())
    first.executor.trigger(trip(policy=TriggerPolicy.QUEUE))
    first.clock.advance(6.0)
    files = {path.name: path.read_bytes() for path in (folder / "runs").glob(f"{JOURNAL_FILE}*")}
    assert files[f"{JOURNAL_FILE}-wal"]
    return files


def put(wreck, runs):
    runs.mkdir()
    for name, data in wreck.items():
        (runs / name).write_bytes(data)


def overwrite(rng, path, count, length):
    data = bytearray(path.read_bytes())
    for _ in range(count):
        at = rng.randrange(len(data))
        data[at : at + length] = rng.randbytes(len(data[at : at + length]))
    path.write_bytes(data)


def in_one_file(runs):
    """Bring what is in the write-ahead log into the file."""
    connection = sqlite3.connect(runs / JOURNAL_FILE)
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()


def bytes_(rng, runs):
    in_one_file(runs)
    overwrite(rng, runs / JOURNAL_FILE, rng.choice((1, 2, 20, 500)), 1)


def header(rng, runs):
    in_one_file(runs)
    data = bytearray((runs / JOURNAL_FILE).read_bytes())
    data[rng.randrange(120)] = rng.randrange(256)
    (runs / JOURNAL_FILE).write_bytes(data)


def pages(rng, runs):
    in_one_file(runs)
    overwrite(rng, runs / JOURNAL_FILE, rng.choice((1, 3)), 4096)


def log(rng, runs):
    overwrite(rng, runs / f"{JOURNAL_FILE}-wal", rng.choice((1, 2, 20)), rng.choice((1, 4096)))


def truncation(rng, runs):
    in_one_file(runs)
    data = (runs / JOURNAL_FILE).read_bytes()
    (runs / JOURNAL_FILE).write_bytes(data[: rng.randrange(len(data))])


def values(rng, runs):
    table = rng.choice(list(TABLES))
    column = rng.choice(TABLES[table].split())
    connection = sqlite3.connect(runs / JOURNAL_FILE)
    connection.execute("PRAGMA ignore_check_constraints = ON")
    try:
        rows = connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
        which = "seq" if table == "events" else "id"
        if rng.random() < 0.5:
            bad = rng.choice(VALUES)
            connection.execute(f"UPDATE {table} SET {column} = ? WHERE {which} = ?", (bad, rng.randint(1, 3)))
        else:  # text that is not UTF-8
            connection.execute(f"UPDATE {table} SET {column} = CAST(x'fffe41' AS TEXT) WHERE {which} = 2")
        assert rows
    except (sqlite3.IntegrityError, OverflowError):  # a value that even SQLite refuses
        damaged = connection.execute(f"UPDATE {table} SET {ANY[table]} = CAST(x'fffe41' AS TEXT)").rowcount
        assert damaged
    connection.commit()
    connection.close()


def schema(rng, runs):
    connection = sqlite3.connect(runs / JOURNAL_FILE)
    connection.execute("PRAGMA writable_schema = ON")
    word = rng.choice(("run_id", "priority", "WITHOUT ROWID", "TEXT NOT NULL UNIQUE", "runs", "notes", "seq"))
    new = rng.choice(("other", "", "x'", "seq"))
    connection.execute("UPDATE sqlite_master SET sql = replace(sql, ?, ?)", (word, new))
    connection.commit()
    connection.close()


@pytest.mark.parametrize("damage", [bytes_, header, pages, log, truncation, values, schema])
@pytest.mark.parametrize("first", sweep(range(0, TRIES, CHUNK), every=5))
def test_a_damaged_journal_stops_no_start_and_nothing_is_lost_in_silence(tmp_path, wreck, damage, first):
    for seed in range(first, first + CHUNK):
        folder = tmp_path / str(seed)
        folder.mkdir()
        missions(folder, "resume")
        runs = folder / "runs"
        put(wreck, runs)
        damage(random.Random(seed), runs)
        with suppress(ConfigError):
            shown(runs)
        second = Process(folder, name="B")
        run = second.executor.trigger(trip(policy=TriggerPolicy.QUEUE))
        second.clock.advance(200.0)
        assert run.status is RunStatus.SUCCEEDED, (seed, run.reason)
        second.journal.close()
        assert not list(runs.glob("*.broken-*")) or second.told or second.troubles, seed
        with JournalReader(runs) as reader:
            kept = reader.run(run.run_id)
            assert kept is not None and kept.state == "SUCCEEDED" and reader.events(run.run_id), (
                seed,
                second.told,
                second.troubles,
            )
        shutil.rmtree(folder)


def shown(runs):
    """What ``florence runs`` and ``florence status --folder`` show."""
    return [*runs_table(runs, mission="", state="", limit=100), run_text(runs, "", events=True)]


def test_a_journal_of_another_version_is_moved_aside_and_a_new_one_begins(tmp_path, wreck):
    missions(tmp_path, "resume")
    runs = tmp_path / "runs"
    put(wreck, runs)
    in_one_file(runs)
    connection = sqlite3.connect(runs / JOURNAL_FILE)
    connection.execute(f"PRAGMA user_version = {VERSION + 1}")
    connection.close()
    before = (runs / JOURNAL_FILE).read_bytes()
    with pytest.raises(ConfigError, match="version"):
        shown(runs)
    second = Process(tmp_path, name="B")
    run = second.executor.trigger(trip())
    second.clock.advance(60.0)
    second.journal.close()
    assert run.status is RunStatus.SUCCEEDED and any("version" in line for line in second.told)
    assert (runs / f"{JOURNAL_FILE}.broken-1").read_bytes() == before
    third = Process(tmp_path, name="C")
    assert third.told == [] and third.executor.find().run_id == run.run_id
    assert run.run_id in "".join(shown(runs))
