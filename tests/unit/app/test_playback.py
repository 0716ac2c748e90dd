"""A recorded run that is looked at step by step; the list of runs in parts."""

from __future__ import annotations

import json

import pytest
from py_trees.common import Status

from florence_bt.app.runs.film import Film
from florence_bt.app.runs.playback import read_playback, read_runs
from florence_bt.app.runs.recorded_mission import read_recorded_mission
from florence_bt.behaviours.why import Why
from florence_bt.core.errors import ConfigError
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus
from tests.recorded_runs import record_run, resumable_missions

WAY = [[100.0, 0.0, 0.0, 0.0], [101.0, 1.0, 0.0, 0.0], [102.0, 2.0, 0.0, 0.0], [103.0, 3.0, 0.0, 0.0]]


def record(folder, number=1, mission="fetch", failed=True):
    """Record a run: it looks, drives for three seconds, and is blocked."""
    journal = Journal(folder, date=lambda: f"2026-05-01T10:00:{number % 60:02d}.000Z")
    run = MissionRun(f"T-{number:05d}-{mission}", MissionRequest(mission, {}, "Anna"), {})

    def happen(at, kind, **data):
        journal.write(run, RunEvent(at, run.run_id, kind, data, 1))

    itself = {"cause": "fetch/drive"}
    run.status, run.started = RunStatus.RUNNING, 100.0
    happen(100.0, EventKind.STARTED)
    happen(100.0, EventKind.NODE, node="fetch/look", old="INVALID", new="SUCCESS")
    happen(100.0, EventKind.NODE, node="fetch/drive", old="INVALID", new="RUNNING")
    happen(100.0, EventKind.NODE, node="fetch", old="INVALID", new="RUNNING")
    happen(
        103.5, EventKind.NODE, node="fetch/drive", old="RUNNING", new="FAILURE", reason="a chair", **itself
    )
    happen(103.5, EventKind.NODE, node="fetch", old="RUNNING", new="FAILURE")
    run.status, run.ended = (RunStatus.FAILED if failed else RunStatus.SUCCEEDED), 103.5
    run.why = Why("fetch/drive", "blocked", "a chair") if failed else None
    happen(103.5, EventKind.ENDED, status=run.status.value, reason="a chair")
    journal.close()
    (folder / run.run_id).mkdir()
    (folder / run.run_id / "result.json").write_text(json.dumps({"path": WAY}))
    return run.run_id


def test_a_run_is_looked_at_step_by_step(tmp_path):
    run = read_playback(tmp_path, record(tmp_path))
    marks = [{row.name: row.mark for row in run.moment(number).rows} for number in range(len(run))]
    ways = [run.moment(number).points for number in range(len(run))]
    assert [(row.name, row.depth) for row in run.moment(0).rows] == [("fetch", 0), ("look", 1), ("drive", 1)]
    assert set(marks[0].values()) == {"[ ]"} and marks[3] == {"fetch": "[>]", "look": "[+]", "drive": "[>]"}
    assert marks[-1] == {"fetch": "[x]", "look": "[+]", "drive": "[x]"}
    assert ways == sorted(ways) and set(range(1, 5)) <= set(ways), "each point of the way is a step"
    driving = run.moment(ways.index(2))
    assert driving.at == 1.0 and {row.name: row.mark for row in driving.rows} == marks[3]
    assert run.moment(-5).at == 0.0 and run.moment(10_000).at == 3.5
    assert "a chair" in run.moment(len(run) - 1).text
    assert run.cause == 2 and run.without, "nobody has recorded the text of its mission"
    (mark,) = run.marks
    assert mark.kind == "failure" and "a chair" in run.moment(mark.step).text
    assert all("a chair" not in run.moment(step).text for step in range(mark.step))


def test_a_run_that_can_be_run_again_shows_its_keys_and_its_whole_tree(tmp_path):
    resumable_missions(tmp_path / "missions")
    recorded, _ = record_run(tmp_path / "missions", tmp_path / "runs", "goto_user", 3)
    run = read_playback(tmp_path / "runs", recorded.run_id)
    film = Film(read_recorded_mission(tmp_path / "runs", recorded.run_id))
    moments = [run.moment(step) for step in range(len(run))]
    assert not run.without and [each.keys for each in moments] == [frame.keys for frame in frames(film)]
    assert [each.rows for each in moments] == [frame.rows for frame in frames(film)]
    assert [each.said for each in moments] == [["", *frame.said][-1] for frame in frames(film)]
    assert {mark.step for mark in run.marks if mark.kind == "failure"} == set(film.failures)
    assert any(mark.kind == "stop" for mark in run.marks), "its process was killed"
    assert moments[-1].rows[run.cause].status is Status.FAILURE
    assert recorded.reason.startswith(moments[-1].rows[run.cause].says)


def frames(film):
    return [film.frame(number) for number in range(len(film))]


def test_the_person_is_shown_from_the_look_on_that_found_somebody(tmp_path):
    resumable_missions(tmp_path / "missions")
    recorded, _ = record_run(tmp_path / "missions", tmp_path / "runs", "goto_user", 5)
    run = read_playback(tmp_path / "runs", recorded.run_id)
    moments = [run.moment(step) for step in range(len(run))]
    found = next(step for step, each in enumerate(moments) if each.person is not None)
    assert "look_for_user ends, ok" in moments[found].text
    assert all(each.person is not None for each in moments[found:])


@pytest.mark.parametrize("result", ["", "[]", '{"path": [[1, 2]]}', '{"path": 3}'])
def test_a_damaged_result_says_so(tmp_path, result):
    run_id = record(tmp_path)
    (tmp_path / run_id / "result.json").write_text(result)
    if result == "[]":
        assert read_playback(tmp_path, run_id).path == []
    else:
        with pytest.raises(ConfigError, match="result"):
            read_playback(tmp_path, run_id)


def test_a_run_without_a_result_has_no_way(tmp_path):
    run_id = record(tmp_path)
    (tmp_path / run_id / "result.json").unlink()
    assert len(read_playback(tmp_path, run_id)) == 7


@pytest.mark.parametrize("run_id", ["", "other", "../T-00001-fetch", "T-00001-fetch/../../x"])
def test_another_run_is_not_found(tmp_path, run_id):
    record(tmp_path)
    with pytest.raises(ConfigError, match="no run"):
        read_playback(tmp_path, run_id)


def test_the_list_comes_in_parts(tmp_path):
    for number in range(1, 8):
        record(tmp_path, number, mission="fetch" if number % 2 else "carry", failed=number > 3)
    first = read_runs(tmp_path, skip=0, limit=3)
    assert [run.run_id[2:7] for run in first.runs] == ["00007", "00006", "00005"] and first.more
    last = read_runs(tmp_path, skip=6, limit=3)
    assert [run.run_id[2:7] for run in last.runs] == ["00001"] and not last.more
    only = read_runs(tmp_path, skip=0, limit=9, mission="carry", state="failed")
    assert [run.run_id[2:7] for run in only.runs] == ["00006", "00004"]
