from __future__ import annotations

import sqlite3
import threading

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.journal import JOURNAL_FILE, Journal, JournalParameters, JournalReader
from florence_bt.runtime.journal.schema import VERSION, JournalBroken
from florence_bt.runtime.journal.store import Store
from florence_bt.runtime.journal.text import journal_text, timeline
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus


def make_run(number=1, **inputs):
    return MissionRun(f"R-{number:03d}", MissionRequest("drive", inputs, "test"), inputs)


def happen(journal, run, kind, time=1.0, **data):
    journal.write(run, RunEvent(time, run.run_id, kind, data, run.ticks))


def whole_run(journal, number, nodes=3):
    run = make_run(number)
    run.status = RunStatus.RUNNING
    run.started = 1.0
    happen(journal, run, EventKind.STARTED)
    for index in range(nodes):
        happen(
            journal,
            run,
            EventKind.NODE,
            node=f"drive/{index}",
            old="INVALID",
            new="RUNNING",
            reason="x" * 500,
        )
    run.status = RunStatus.SUCCEEDED
    run.ended = 2.0
    happen(journal, run, EventKind.ENDED, status="SUCCEEDED", code="ok", reason="")
    journal.flush()
    return run


@pytest.mark.parametrize("background", [False, True])
def test_runs_and_events_read_back(tmp_path, background):
    journal = Journal(tmp_path / "runs", background=background, date=lambda: "2024-01-01T00:00:00Z")
    run = make_run(goal=Pose2(1.0, 2.0, 0.5), speed=0.3)
    run.status, run.started, run.version = RunStatus.RUNNING, 5.0, "abc"
    happen(journal, run, EventKind.STARTED, 5.0, inputs=dict(run.inputs), caller="test")
    run.ticks = 1
    happen(
        journal,
        run,
        EventKind.SKILL_STARTED,
        5.0,
        node="drive/go",
        skill="go",
        inputs={"goal": Pose2(1, 2, 0.5)},
    )
    happen(
        journal,
        run,
        EventKind.NODE,
        5.5,
        node="drive/go",
        old="INVALID",
        new="FAILURE",
        code="x",
        reason="why",
    )
    journal.flush()
    with JournalReader(tmp_path / "runs") as reader:
        (row,) = reader.runs()
        assert (row.run_id, row.mission, row.caller, row.state) == ("R-001", "drive", "test", "RUNNING")
        assert row.inputs == {"goal": {"x": 1.0, "y": 2.0, "yaw": 0.5}, "speed": 0.3}
        assert (row.version, row.accepted, row.started) == ("abc", "2024-01-01T00:00:00Z", 5.0)
        events = reader.events("R-001")
        assert [event.seq for event in events] == [1, 2, 3]
        assert events[1].inputs == {"goal": {"x": 1.0, "y": 2.0, "yaw": 0.5}} and events[1].tick == 1
        assert (events[2].old, events[2].new, events[2].code, events[2].reason) == (
            "INVALID",
            "FAILURE",
            "x",
            "why",
        )
        assert reader.events("nothing") == [] and reader.run("nothing") is None
        assert [left.run_id for left in reader.unfinished()] == ["R-001"]
    journal.close()
    happen(journal, run, EventKind.NODE)  # after the end nothing is kept, and nothing breaks
    journal.flush()


def test_runs_are_filtered_and_the_latest_come_first(tmp_path):
    journal = Journal(tmp_path)
    for number in range(1, 6):
        whole_run(journal, number)
    with JournalReader(tmp_path) as reader:
        assert [run.run_id for run in reader.runs(limit=2)] == ["R-005", "R-004"]
        assert len(reader.runs(mission="drive", state="succeeded")) == 5
        assert reader.runs(mission="other") == [] and reader.runs(state="failed") == []


def test_a_batch_is_on_the_disk_after_the_tick_and_not_before(make_bench, tmp_path):
    # The two ticks of the start and of drive's end are two batches.
    bench = make_bench(log=Journal(tmp_path / "runs"))
    run = bench.executor.trigger(MissionRequest("drive_and_work"))
    with JournalReader(tmp_path / "runs") as reader:
        assert [event.kind for event in reader.events(run.run_id)] == ["started"]
        bench.clock.advance(0.0)
        assert "skill_started" in [event.kind for event in reader.events(run.run_id)]
        bench.clock.advance(10.0)
        assert reader.run(run.run_id).state == "SUCCEEDED" and reader.run(run.run_id).outputs == {"pay": "7"}


def test_who_listens_hears_of_nothing_that_is_not_safe_yet(make_bench, tmp_path):
    journal = Journal(tmp_path / "runs", background=True)
    bench = make_bench(log=journal)
    seen = []

    def look(run, event):
        if event.kind in (EventKind.STARTED, EventKind.PAUSED, EventKind.RESUMED, EventKind.ENDED):
            with JournalReader(tmp_path / "runs") as reader:
                seen.append(
                    (event.kind.value, reader.events(run.run_id)[-1].kind, reader.run(run.run_id).state)
                )

    bench.executor.add_listener(look)
    bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    bench.executor.resume()
    bench.clock.advance(5.0)
    assert [(kind, state) for kind, _, state in seen] == [
        ("started", "RUNNING"),
        ("paused", "PAUSED"),
        ("resumed", "RUNNING"),
        ("ended", "SUCCEEDED"),
    ]
    journal.close()


def test_a_locked_file_costs_nothing_but_time(tmp_path):
    told = []
    journal = Journal(tmp_path, JournalParameters(busy_s=0.01), on_trouble=told.append)
    whole_run(journal, 1)
    other = sqlite3.connect(tmp_path / JOURNAL_FILE, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    whole_run(journal, 2)
    whole_run(journal, 3)
    assert len(told) == 1 and "locked" in told[0] and journal.trouble
    other.execute("ROLLBACK")
    other.close()
    whole_run(journal, 4)
    assert len(told) == 2 and "again" in told[1] and not journal.trouble
    with JournalReader(tmp_path) as reader:
        assert len(reader.runs()) == 4 and len(reader.events("R-002")) == 5


def test_a_full_disk_is_told_once_and_the_run_is_closed_when_there_is_room_again(tmp_path):
    told = []
    journal = Journal(tmp_path, JournalParameters(max_waiting=100), on_trouble=told.append)
    whole_run(journal, 1)
    connection = journal._guard._store._connection
    pages = connection.execute("PRAGMA page_count").fetchone()[0]
    connection.execute(f"PRAGMA max_page_count = {pages}")
    whole_run(journal, 2, nodes=300)
    assert len(told) == 1 and "full" in told[0]
    connection.execute("PRAGMA max_page_count = 100000")
    whole_run(journal, 3)
    with JournalReader(tmp_path) as reader:
        assert [run.state for run in reader.runs()] == ["SUCCEEDED"] * 3
        assert reader.run("R-002").lost >= 200 and reader.run("R-003").lost == 0


@pytest.mark.parametrize("garbage", [b"this is no database, whatever its name says" * 200, b"\0" * 9000])
def test_a_broken_file_is_moved_aside_and_a_new_one_begins(tmp_path, garbage):
    (tmp_path / JOURNAL_FILE).write_bytes(garbage)
    told = []
    journal = Journal(tmp_path, on_trouble=told.append)
    whole_run(journal, 1)
    whole_run(journal, 2)
    with JournalReader(tmp_path) as reader:
        assert len(reader.runs()) == 2
    if b"no database" in garbage:
        assert (tmp_path / f"{JOURNAL_FILE}.broken-1").read_bytes() == garbage
        assert "moved to" in told[0]


def test_a_run_that_goes_on_while_the_file_breaks_is_in_the_new_file(tmp_path):
    journal = Journal(tmp_path)
    whole_run(journal, 1)
    run = make_run(2)
    run.status, run.started = RunStatus.RUNNING, 1.0
    happen(journal, run, EventKind.STARTED)
    run.status = RunStatus.PAUSED
    happen(journal, run, EventKind.PAUSED)
    journal.flush()
    journal.set_aside("a page is torn")
    run.status = RunStatus.RUNNING
    happen(journal, run, EventKind.RESUMED)
    run.status, run.ended = RunStatus.SUCCEEDED, 2.0
    happen(journal, run, EventKind.ENDED)
    journal.close()
    with JournalReader(tmp_path) as reader:
        assert [(row.run_id, row.state) for row in reader.runs()] == [("R-002", "SUCCEEDED")]
        assert [event.kind for event in reader.events("R-002")] == ["resumed", "ended"]


def test_a_file_that_was_taken_away_is_made_anew_with_the_next_run(tmp_path):
    journal = Journal(tmp_path)
    whole_run(journal, 1)
    for file in tmp_path.glob(f"{JOURNAL_FILE}*"):
        file.unlink()
    whole_run(journal, 2)
    with JournalReader(tmp_path) as reader:
        assert [run.run_id for run in reader.runs()] == ["R-002"]


def test_a_folder_that_cannot_be_made_is_told_once(tmp_path):
    (tmp_path / "runs").write_text("a file where the folder should be")
    told = []
    journal = Journal(tmp_path / "runs", on_trouble=told.append)
    whole_run(journal, 1)
    whole_run(journal, 2)
    journal.close()
    assert len(told) == 1 and "cannot be written" in told[0]


def test_a_disk_that_hangs_holds_an_acknowledgement_up_only_so_long(tmp_path, monkeypatch):
    journal = Journal(tmp_path, JournalParameters(flush_limit_s=0.05), background=True)
    whole_run(journal, 1)
    hung = threading.Event()
    apply = Store.apply
    monkeypatch.setattr(Store, "apply", lambda disk, jobs: (hung.wait(300.0), apply(disk, jobs)))
    whole_run(journal, 2)  # two acknowledgements: returns after 0.1 s, not after 300
    hung.set()
    journal.close()
    with JournalReader(tmp_path) as reader:
        assert len(reader.runs()) == 2


def test_what_cannot_be_kept_does_not_take_the_rest_away(tmp_path):
    told = []
    journal = Journal(tmp_path, on_trouble=told.append)
    run = make_run()
    happen(journal, run, EventKind.STARTED)
    happen(
        journal, run, EventKind.NODE, node="a lone \ud800 surrogate", old="INVALID", new="RUNNING", reason=""
    )
    happen(journal, run, EventKind.NODE, node="good", old="INVALID", new="RUNNING", reason="")
    journal.flush()
    with JournalReader(tmp_path) as reader:
        assert [event.node for event in reader.events(run.run_id)] == ["", "good"]
    assert len(told) == 1 and "cannot keep an event" in told[0]


def test_old_runs_are_dropped_with_their_folders(tmp_path):
    journal = Journal(tmp_path, JournalParameters(keep_runs=10))
    for number in range(1, 41):
        (tmp_path / f"R-{number:03d}").mkdir()
        whole_run(journal, number)
    with JournalReader(tmp_path) as reader:
        kept = [run.run_id for run in reader.runs(limit=100)]
    assert 10 <= len(kept) <= 13 and kept[0] == "R-040"
    assert sorted(folder.name for folder in tmp_path.iterdir() if folder.is_dir()) == sorted(kept)
    connection = sqlite3.connect(tmp_path / JOURNAL_FILE)
    assert connection.execute("SELECT count(DISTINCT run) FROM events").fetchone()[0] == len(kept)
    connection.close()


def test_a_run_without_end_is_never_dropped(tmp_path):
    journal = Journal(tmp_path, JournalParameters(keep_runs=2))
    happen(journal, make_run(0), EventKind.STARTED)
    for number in range(1, 12):
        whole_run(journal, number)
    with JournalReader(tmp_path) as reader:
        assert [run.run_id for run in reader.unfinished()] == ["R-000"]


def test_the_events_of_one_run_are_bounded_and_its_end_is_kept(tmp_path):
    journal = Journal(tmp_path, JournalParameters(events_per_run=10))
    whole_run(journal, 1, nodes=50)
    with JournalReader(tmp_path) as reader:
        assert reader.run("R-001").state == "SUCCEEDED" and reader.run("R-001").lost == 41
        assert reader.events("R-001")[-1].kind == "ended"


def test_a_file_of_another_version_is_moved_aside_and_said(tmp_path):
    whole_run(Journal(tmp_path), 1)
    connection = sqlite3.connect(tmp_path / JOURNAL_FILE)
    connection.execute(f"PRAGMA user_version = {VERSION + 1}")
    connection.close()
    told = []
    whole_run(Journal(tmp_path, on_trouble=told.append), 2)
    aside = tmp_path / f"{JOURNAL_FILE}.broken-1"
    assert any(str(aside) in line for line in told)
    with JournalReader(tmp_path) as reader:
        assert [run.run_id for run in reader.runs()] == ["R-002"]
    connection = sqlite3.connect(aside)
    assert connection.execute("SELECT count(*) FROM runs").fetchone() == (1,)
    connection.close()


def test_what_is_no_journal_is_refused_in_words(tmp_path):
    with pytest.raises(ConfigError, match=f"no journal.*{JOURNAL_FILE}"):
        JournalReader(tmp_path)
    (tmp_path / JOURNAL_FILE).write_text("nonsense " * 1000)
    with pytest.raises(JournalBroken, match="cannot be read"):
        JournalReader(tmp_path)


def test_a_write_ahead_log_that_was_torn_gives_what_is_whole(tmp_path):
    journal = Journal(tmp_path / "a")
    for number in range(1, 9):
        whole_run(journal, number)
    (tmp_path / "b").mkdir()
    log = (tmp_path / "a" / f"{JOURNAL_FILE}-wal").read_bytes()
    counts = []
    for cut in range(0, len(log), len(log) // 7):
        (tmp_path / "b" / JOURNAL_FILE).write_bytes((tmp_path / "a" / JOURNAL_FILE).read_bytes())
        (tmp_path / "b" / f"{JOURNAL_FILE}-wal").write_bytes(log[:cut])
        try:
            with JournalReader(tmp_path / "b") as reader:
                runs = reader.runs()
                counts.append(len(runs))
                assert all(len(reader.events(run.run_id)) == 5 for run in runs if run.status.final)
        except ConfigError:
            counts.append(0)  # not even the tables were there yet
        (tmp_path / "b" / f"{JOURNAL_FILE}-shm").unlink(missing_ok=True)
    assert counts == sorted(counts) and counts[-1] > 0


@pytest.mark.parametrize("field", ["keep_runs", "events_per_run", "max_waiting"])
def test_bad_parameters_are_refused(field):
    with pytest.raises(ConfigError, match=field):
        JournalParameters(**{field: 0})
    with pytest.raises(ConfigError, match="busy_s"):
        JournalParameters(busy_s=-1.0)


def test_the_text_of_a_run_and_its_timeline(make_bench, tmp_path):
    bench = make_bench(log=Journal(tmp_path / "runs"))
    run = bench.executor.trigger(MissionRequest("drive_and_work", caller="test"))
    bench.clock.advance(1.0)
    bench.executor.pause("a child")
    bench.clock.advance(5.0)
    with JournalReader(tmp_path / "runs") as reader:
        text = journal_text(reader.run(run.run_id), reader.events(run.run_id))
        assert "drive_and_work: PAUSED" in text and "[>] drive" in text
        assert text.endswith("paused because: a child; go on with: florence resume")
    bench.executor.resume()
    bench.clock.advance(10.0)
    with JournalReader(tmp_path / "runs") as reader:
        text = journal_text(reader.run(run.run_id), reader.events(run.run_id))
        assert text.splitlines()[0].startswith("drive_and_work: SUCCEEDED · 9.0 s · run ")
        assert timeline(reader.events(run.run_id)) == [
            "    +0.0 s  started",
            "    +0.0 s  drive way=1 at drive_and_work/drive: cancelled: cancelled on request after 1.0 s",
            "    +1.0 s  paused: a child",
            "    +6.0 s  resumed",
            "    +6.0 s  drive way=1 at drive_and_work/drive: ok after 2.0 s",
            "    +8.0 s  work at drive_and_work/work: ok after 1.0 s -> pay=7",
            "    +9.0 s  ended: SUCCEEDED",
        ]
