from __future__ import annotations

import itertools
import json
from dataclasses import replace

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime import recorder as recorder_module
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.recorder import RunRecorder
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus, TriggerPolicy
from florence_bt.runtime.status import duration_text, status_text

DRIVE = SkillDeclaration("drive", "Drive some way", inputs={"way": Port(Kind.LENGTH, "how far", default=1.0)})


def record(bench, folder, mission="drive_and_work"):
    done = []
    recorder = RunRecorder(
        bench.executor, folder, bench.clock, lambda: Pose2(bench.clock.now(), 2.0, 0.5), done.append
    )
    run = bench.executor.trigger(MissionRequest(mission, caller="test"))
    bench.clock.advance(10.0)
    return run, recorder.folder_of(run.run_id), done


def test_a_run_leaves_tree_and_result(bench, tmp_path):
    run, folder, done = record(bench, tmp_path / "runs")
    assert "[+] drive" in (folder / "tree.txt").read_text()
    result = json.loads((folder / "result.json").read_text())
    assert (result["status"], result["outputs"], result["caller"]) == ("SUCCEEDED", {"pay": 7}, "test")
    assert result["run_id"] == run.run_id
    assert [record.folder for record in done] == [folder]


def test_a_run_that_only_waited_leaves_its_end_and_nothing_to_draw(bench, tmp_path):
    done = []
    recorder = RunRecorder(bench.executor, tmp_path, bench.clock, lambda: None, done.append)
    bench.executor.trigger(MissionRequest("drive_once"))
    waiting = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE))
    bench.executor.stop_all("enough")
    bench.clock.advance(10.0)
    result = json.loads((recorder.folder_of(waiting.run_id) / "result.json").read_text())
    assert result["status"] == "STOPPED" and len(done) == 1


def test_the_path_is_noted_from_start_to_end_and_no_longer(bench, tmp_path):
    run, _folder, done = record(bench, tmp_path / "runs")
    times = [time for time, _ in done[0].path]
    assert times[0] == run.started and times[-1] == run.ended
    assert all(0.0 <= later - earlier < 0.21 for earlier, later in itertools.pairwise(times))
    assert bench.clock.next_time() is None  # nothing goes on ticking once the run is over


def test_nothing_is_recorded_after_the_close(bench, tmp_path):
    recorder = RunRecorder(bench.executor, tmp_path, bench.clock, lambda: Pose2(0.0, 0.0, 0.0))
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    recorder.close()
    bench.clock.advance(10.0)
    assert run.status.value == "SUCCEEDED" and not (tmp_path / run.run_id).exists()
    assert bench.clock.next_time() is None


def test_the_path_of_a_long_run_takes_no_more_room_than_that_of_a_short_one(bench, tmp_path, monkeypatch):
    monkeypatch.setattr(recorder_module, "PATH_LIMIT", 100)
    bench.script(Step(after=400.0))
    done = []
    RunRecorder(bench.executor, tmp_path, bench.clock, lambda: Pose2(0.0, 0.0, 0.0), done.append)
    bench.declarations["drive"] = replace(DRIVE, deadline_s=900.0)
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(500.0)
    path = done[0].path
    assert 40 <= len(path) <= 101 and path[0][0] == run.started and path[-1][0] == run.ended


def test_the_final_tree_tells_why(bench, tmp_path):
    bench.script(Step(failure("blocked", "a chair is in the way"), after=1.0))
    _run, folder, _ = record(bench, tmp_path, "drive_once")
    text = (folder / "tree.txt").read_text()
    assert "drive_once: FAILED · 1.0 s" in text
    assert "failed because: a chair is in the way [blocked] at drive_once/" in text


def test_the_status_tells_the_outputs_and_only_of_a_success(bench):
    run = bench.executor.trigger(MissionRequest("drive_and_work"))
    assert "outputs" not in status_text(run, run.tree, bench.clock.now())
    bench.clock.advance(10.0)
    assert run.outputs == {"pay": 7} and run.output_texts == {"pay": "7"}
    assert status_text(run, run.tree, bench.clock.now()).splitlines()[-1] == "outputs pay: 7"


def test_how_long_a_run_took_is_not_known_when_its_process_died():
    run = MissionRun("R", MissionRequest("m"), {})
    assert duration_text(run, 9.0) == ""
    run.status = RunStatus.ABORTED
    assert duration_text(run, 9.0) == ""
    run.started, run.ended = 1.0, 3.5
    assert duration_text(run, 9.0) == "at least 2.5 s"
    run.status = RunStatus.SUCCEEDED
    assert duration_text(run, 9.0) == "2.5 s"


def test_the_status_of_nothing_is_said_in_words(bench):
    assert status_text(None, "", 0.0) == "no mission has run yet"


def test_the_status_tells_that_the_journal_is_in_trouble_and_missions_run_on(make_bench, tmp_path):
    (tmp_path / "runs").write_text("a file where the folder should be")
    bench = make_bench(log=Journal(tmp_path / "runs"))
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(5.0)
    assert run.status.value == "SUCCEEDED"
    text = status_text(run, run.tree, bench.clock.now(), bench.executor.warnings())
    assert "warning: the journal" in text.splitlines()[-1] and "cannot be written" in text


def test_a_folder_that_cannot_be_written_to_stops_no_mission_and_is_told_once(bench, tmp_path):
    (tmp_path / "runs").write_text("a file where the folder should be")
    told = []
    RunRecorder(bench.executor, tmp_path / "runs", bench.clock, lambda: None, on_trouble=told.append)
    run = bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(10.0)
    assert run.status.value == "SUCCEEDED"
    assert len(told) == 1 and run.run_id in told[0] and "not recorded" in told[0]
    assert bench.clock.next_time() is None


def test_a_folder_out_of_reach_for_a_while_costs_only_the_run_of_that_time(bench, tmp_path):
    told = []
    RunRecorder(bench.executor, tmp_path, bench.clock, lambda: None, on_trouble=told.append)
    first = bench.executor.trigger(MissionRequest("drive_once"))
    (tmp_path / first.run_id).write_text("a file where the folder of the run should be")
    bench.clock.advance(5.0)
    assert first.status.value == "SUCCEEDED" and len(told) == 1 and first.run_id in told[0]
    second = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(5.0)
    assert json.loads((tmp_path / second.run_id / "result.json").read_text())["status"] == "SUCCEEDED"
    assert len(told) == 1


def test_without_anybody_to_tell_the_trouble_is_an_event(bench, tmp_path):
    (tmp_path / "runs").write_text("")
    RunRecorder(bench.executor, tmp_path / "runs", bench.clock, lambda: None)
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(5.0)
    assert run.status.value == "SUCCEEDED"
    (told,) = [event.data["detail"] for event in bench.events if event.kind is EventKind.BROKEN]
    assert str(tmp_path / "runs") in told
