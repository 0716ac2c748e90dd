from __future__ import annotations

import itertools
import json

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure
from florence_bt.runtime.recorder import RunRecorder, read_record
from florence_bt.runtime.run import Request
from florence_bt.runtime.status import status_text
from florence_bt.testing.mocks import Step


def record(bench, folder, mission="drive_and_work"):
    done = []
    recorder = RunRecorder(
        bench.executor, folder, bench.clock, lambda: Pose2(bench.clock.now(), 2.0, 0.5), done.append
    )
    run = bench.executor.trigger(Request(mission, caller="test"))
    bench.clock.advance(10.0)
    return run, recorder.folder_of(run.run_id), done


def test_a_run_leaves_journal_tree_and_result(bench, tmp_path):
    run, folder, done = record(bench, tmp_path / "runs")
    events = [json.loads(line) for line in (folder / "journal.jsonl").read_text().splitlines()]
    assert next(event["event"] for event in events) == "started" and events[-1]["event"] == "ended"
    assert {event["run"] for event in events} == {run.run_id}
    assert [event["time"] for event in events] == sorted(event["time"] for event in events)
    ended = next(event for event in events if event["event"] == "skill_ended" and event["skill"] == "work")
    assert ended["outputs"] == {"pay": 7} and ended["node"].endswith("work")
    assert "[+] drive" in (folder / "tree.txt").read_text()
    result = json.loads((folder / "result.json").read_text())
    assert (result["status"], result["outputs"], result["caller"]) == ("SUCCEEDED", {"pay": 7}, "test")
    assert [record.folder for record in done] == [folder]


def test_the_path_is_noted_from_start_to_end_and_no_longer(bench, tmp_path):
    run, _folder, done = record(bench, tmp_path / "runs")
    times = [time for time, _ in done[0].path]
    assert times[0] == run.started and times[-1] == run.ended
    assert all(0.0 <= later - earlier < 0.21 for earlier, later in itertools.pairwise(times))
    assert bench.clock.next_time() is None  # nothing goes on ticking once the run is over


def test_the_journal_holds_what_happened_before_a_crash(bench, tmp_path):
    recorder = RunRecorder(bench.executor, tmp_path, bench.clock, lambda: None)
    run = bench.executor.trigger(Request("drive_once"))
    bench.clock.advance(1.0)
    lines = (tmp_path / run.run_id / "journal.jsonl").read_text().splitlines()
    assert json.loads(lines[-1])["run"] == run.run_id and len(lines) >= 3
    recorder.close()
    assert bench.executor.stop("after the records were closed") is run  # and nothing is written any more


def test_the_final_tree_tells_why(bench, tmp_path):
    bench.script(Step(failure("blocked", "a chair is in the way"), after=1.0))
    _run, folder, _ = record(bench, tmp_path, "drive_once")
    text = (folder / "tree.txt").read_text()
    assert "drive_once: FAILED · 1.0 s" in text
    assert "failed because: a chair is in the way [blocked] at drive_once/" in text


def test_the_status_of_nothing_is_said_in_words(bench):
    assert status_text(None, "", 0.0) == "no mission has run yet"


def test_a_folder_that_cannot_be_written_to_stops_no_mission_and_is_told_once(bench, tmp_path):
    (tmp_path / "runs").write_text("a file where the folder should be")
    told = []
    RunRecorder(bench.executor, tmp_path / "runs", bench.clock, lambda: None, on_trouble=told.append)
    run = bench.executor.trigger(Request("drive_and_work"))
    bench.clock.advance(10.0)
    assert run.status.value == "SUCCEEDED"
    assert len(told) == 1 and run.run_id in told[0] and "not recorded" in told[0]
    assert bench.clock.next_time() is None


def test_a_disk_that_is_full_for_a_while_costs_only_the_run_of_that_time(bench, tmp_path):
    told = []
    recorder = RunRecorder(bench.executor, tmp_path, bench.clock, lambda: None, on_trouble=told.append)
    first = bench.executor.trigger(Request("drive_once"))
    bench.clock.advance(0.5)
    recorder._open[first.run_id][1].close()
    recorder._open[first.run_id] = (recorder._open[first.run_id][0], open("/dev/full", "w"))  # noqa: SIM115
    bench.clock.advance(5.0)
    assert first.status.value == "SUCCEEDED" and len(told) == 1 and "No space left" in told[0]
    second = bench.executor.trigger(Request("drive_once"))
    bench.clock.advance(5.0)
    assert read_record(tmp_path, second.run_id).status == "SUCCEEDED"
    assert len(told) == 1


def test_without_anybody_to_tell_the_error_is_raised(bench, tmp_path):
    (tmp_path / "runs").write_text("")
    RunRecorder(bench.executor, tmp_path / "runs", bench.clock, lambda: None)
    with pytest.raises(OSError):
        bench.executor.trigger(Request("drive_once"))


def test_a_record_reads_back(bench, tmp_path):
    bench.script(Step(failure("blocked", "a chair is in the way"), after=1.0))
    run, folder, _ = record(bench, tmp_path, "drive_once")
    past = read_record(tmp_path, run.run_id)
    assert (past.run_id, past.mission, past.status) == (run.run_id, "drive_once", "FAILED")
    assert (past.code, past.reason) == ("blocked", "a chair is in the way")
    assert past.text == (folder / "tree.txt").read_text().rstrip("\n")


@pytest.mark.parametrize("run_id", ["", "..", ".", "nothing", "../secret", "a/b", "/etc", "broken", "\0"])
def test_what_is_no_record_is_not_found(tmp_path, run_id):
    (tmp_path / "secret").mkdir()
    (tmp_path / "runs" / "broken").mkdir(parents=True)
    (tmp_path / "runs" / "broken" / "result.json").write_text("[1, 2")
    assert read_record(tmp_path / "runs", run_id) is None
