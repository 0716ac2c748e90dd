"""What goes wrong round the journal and must take neither the journal nor its promise away."""

from __future__ import annotations

import itertools
import sqlite3
import threading
from dataclasses import replace

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.runtime.event_bus import EventBus
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.journal import JOURNAL_FILE, Journal, JournalParameters, JournalReader, store
from florence_bt.runtime.journal.schema import JournalBroken
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus


def begin(tell, number):
    run = MissionRun(
        f"R-{number:03d}", MissionRequest("drive", {}, "test"), {}, RunStatus.RUNNING, started=1.0
    )
    tell(run, EventKind.STARTED)
    return run


def end(tell, run):
    run.status, run.ended = RunStatus.SUCCEEDED, 2.0
    tell(run, EventKind.ENDED, status="SUCCEEDED")


def teller(journal):
    def tell(run, kind, **data):
        journal.write(run, RunEvent(1.0, run.run_id, kind, data, run.ticks))
        journal.flush()

    return tell


def states(folder):
    with JournalReader(folder) as reader:
        return {run.run_id: run.state for run in reader.runs(limit=100_000)}


def test_a_listener_that_breaks_at_the_end_of_a_run_is_kept_behind_the_end(tmp_path):
    told = []
    journal = Journal(tmp_path, on_trouble=told.append)
    event_bus = EventBus(ManualClock(), journal)

    def break_at_the_end(run, event):
        if event.kind is EventKind.ENDED:
            raise RuntimeError("the listener is broken")

    event_bus.add_listener(break_at_the_end)
    for number in range(3):
        end(event_bus.publish, begin(event_bus.publish, number))
    journal.flush()
    assert told == [] and journal._seq == {}
    with JournalReader(tmp_path) as reader:
        kinds = [event.kind for event in reader.events("R-001")]
        assert kinds == ["started", "ended", "broken"] and reader.run("R-001").state == "SUCCEEDED"


def test_a_value_that_cannot_be_written_does_not_end_the_thread_that_writes(tmp_path):
    told = []
    journal = Journal(tmp_path, background=True, on_trouble=told.append)
    tell = teller(journal)
    run = begin(tell, 1)
    endless: list[object] = []
    endless.append(endless)
    tell(run, EventKind.SKILL_STARTED, node="a", skill="s", inputs={"value": endless})
    tell(run, EventKind.SKILL_STARTED, node="b", skill="s", inputs={"value": 1})
    end(tell, run)
    journal.close()
    assert states(tmp_path) == {"R-001": "SUCCEEDED"}
    with JournalReader(tmp_path) as reader:
        assert [event.node for event in reader.events("R-001")] == ["", "b", ""]
    assert any("cannot keep an event" in text and "RecursionError" in text for text in told)


def test_a_disk_that_fails_among_single_jobs_loses_none_of_them(tmp_path, monkeypatch):
    told = []
    journal = Journal(tmp_path, JournalParameters(busy_s=0.0), on_trouble=told.append)
    tell = teller(journal)
    run = begin(tell, 1)
    apply, calls = store.Store.apply, []

    def fails_once(disk, jobs):
        calls.append(len(jobs))
        if len(calls) == 3:
            raise sqlite3.OperationalError("disk I/O error")
        return apply(disk, jobs)

    monkeypatch.setattr(store.Store, "apply", fails_once)
    for node in ("a", "torn \ud800", "b", "c"):
        journal.write(
            run, RunEvent(1.0, run.run_id, EventKind.NODE, {"node": node, "old": "INVALID", "new": "RUNNING"})
        )
    journal.commit()
    assert "disk I/O error" in journal.trouble
    end(tell, run)
    with JournalReader(tmp_path) as reader:
        assert [event.node for event in reader.events("R-001")] == ["", "a", "b", "c", ""]


def test_a_folder_that_cannot_be_removed_costs_no_event(tmp_path, monkeypatch):
    told = []
    journal = Journal(tmp_path, JournalParameters(keep_runs=1), on_trouble=told.append)
    tell = teller(journal)
    remove = store.shutil.rmtree

    def stays(folder):
        if folder.name == "R-001":
            raise PermissionError("it belongs to somebody else")
        remove(folder)

    monkeypatch.setattr(store.shutil, "rmtree", stays)
    for number in range(1, 10):
        (tmp_path / f"R-{number:03d}").mkdir()
        end(tell, begin(tell, number))
    kept = states(tmp_path)
    assert "R-001" in kept and "R-009" in kept and len(kept) <= 4
    assert "cannot be dropped" in told[0] and "somebody else" in told[0] and len(told) == 1
    with JournalReader(tmp_path) as reader:
        assert len(reader.events("R-009")) == 2


def test_old_runs_are_dropped_though_no_process_lives_long(tmp_path):
    for number in range(40):
        journal = Journal(tmp_path, JournalParameters(keep_runs=10))
        tell = teller(journal)
        end(tell, begin(tell, number))
        journal.close()
        assert not [*tmp_path.glob("*-wal")], "the file is closed"
    assert len(states(tmp_path)) <= 11


def test_an_acknowledgement_that_is_not_safe_is_told(tmp_path, monkeypatch):
    told = []
    # A disk that is slow by itself is none that hangs.
    patient = JournalParameters(flush_limit_s=300.0)
    journal = Journal(tmp_path, patient, background=True, on_trouble=told.append)
    tell = teller(journal)
    run = begin(tell, 1)
    hung, apply = threading.Event(), store.Store.apply
    monkeypatch.setattr(store.Store, "apply", lambda disk, jobs: (hung.wait(300.0), apply(disk, jobs)))
    journal._parameters = replace(patient, flush_limit_s=0.02)
    tell(run, EventKind.PAUSED, reason="x")
    tell(run, EventKind.RESUMED)
    assert len(told) == 1 and "was not written within 0.02 s" in told[0] and journal.trouble == told[0]
    hung.set()
    assert journal._writer.wait(300.0)
    journal._parameters = patient
    end(tell, run)
    assert told[1:] == ["the journal can be written again"] and journal.trouble == ""
    journal.close()


def test_memory_stays_bounded_when_the_disk_never_comes_back(tmp_path):
    (tmp_path / "runs").write_text("a file where the folder should be")
    dates = (f"2024-05-01T10:{number // 60:02d}:{number % 60:02d}Z" for number in itertools.count())
    written: list[str] = []
    journal = Journal(
        tmp_path / "runs",
        JournalParameters(max_waiting=100),
        date=lambda: written.append(next(dates)) or written[-1],
    )
    tell = teller(journal)
    for number in range(300):
        end(tell, begin(tell, number))
    assert len(journal._guard._waiting) <= 100
    (tmp_path / "runs").unlink()
    end(tell, begin(tell, 300))
    kept = states(tmp_path / "runs")
    assert len(kept) >= 30 and set(kept.values()) == {"SUCCEEDED"} and "R-300" in kept
    with JournalReader(tmp_path / "runs") as reader:
        assert reader.last_entry() == written[-1]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("inputs = '{torn'", "Expecting property name"),
        ("outputs = '[1]'", "a JSON object was expected"),
        ("outputs = x'ff'", "outputs is b'"),
        ("started = 'soon'", "started is 'soon'"),
        ("started = 9e999", "started is inf"),
        ("priority = 1.5", "priority is 1.5"),
        ("state = 'LOST'", "'LOST' is not a valid RunStatus"),
        ("policy = 'perhaps'", "'perhaps' is not a valid TriggerPolicy"),
    ],
)
def test_a_row_that_is_broken_is_told_in_words(tmp_path, change, told):
    journal = Journal(tmp_path)
    tell = teller(journal)
    end(tell, begin(tell, 1))
    journal.close()
    connection = sqlite3.connect(tmp_path / JOURNAL_FILE)
    connection.execute(f"UPDATE runs SET {change}")
    connection.commit()
    connection.close()
    with JournalReader(tmp_path) as reader, pytest.raises(JournalBroken, match=f"a row is broken: {told}"):
        reader.runs()
