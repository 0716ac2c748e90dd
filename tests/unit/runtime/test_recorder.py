from __future__ import annotations

import itertools
import json

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure
from florence_bt.runtime.recorder import RunRecorder
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
