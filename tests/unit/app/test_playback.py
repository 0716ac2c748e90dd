"""A recorded run that is looked at step by step; the list of runs in parts."""

from __future__ import annotations

import json

import pytest

from florence_bt.app.runs.playback import read_playback, read_runs
from florence_bt.behaviours.why import Why
from florence_bt.core.errors import ConfigError
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus

WAY = [[100.0, 0.0, 0.0, 0.0], [101.0, 1.0, 0.0, 0.0], [102.0, 2.0, 0.0, 0.0], [103.0, 3.0, 0.0, 0.0]]


def record(folder, number=1, mission="fetch", failed=True):
    """Record a run: it looks, drives for three seconds, and is blocked."""
    journal = Journal(folder, date=lambda: f"2026-05-01T10:00:{number % 60:02d}.000Z")
    run = MissionRun(f"T-{number:05d}-{mission}", MissionRequest(mission, {}, "Anna"), {})

    def happen(at, kind, **data):
        journal.write(run, RunEvent(at, run.run_id, kind, data, 1))

    run.status, run.started = RunStatus.RUNNING, 100.0
    happen(100.0, EventKind.STARTED)
    happen(100.0, EventKind.NODE, node="fetch/look", old="INVALID", new="SUCCESS")
    happen(100.0, EventKind.NODE, node="fetch/drive", old="INVALID", new="RUNNING")
    happen(100.0, EventKind.NODE, node="fetch", old="INVALID", new="RUNNING")
    happen(103.5, EventKind.NODE, node="fetch/drive", old="RUNNING", new="FAILURE", reason="a chair")
    happen(103.5, EventKind.NODE, node="fetch", old="RUNNING", new="FAILURE")
    run.status, run.ended = (RunStatus.FAILED if failed else RunStatus.SUCCEEDED), 103.5
    run.why = Why("fetch/drive", "blocked", "a chair") if failed else None
    happen(103.5, EventKind.ENDED, status=run.status.value, reason="a chair")
    journal.close()
    (folder / run.run_id).mkdir()
    (folder / run.run_id / "result.json").write_text(json.dumps({"path": WAY, "person": {"x": 4, "y": 5}}))
    return run.run_id


def test_a_run_is_looked_at_step_by_step(tmp_path):
    run = read_playback(tmp_path, record(tmp_path))
    marks = [{node.name: node.mark for node in run.moment(number).nodes} for number in range(len(run))]
    ways = [run.moment(number).points for number in range(len(run))]
    assert [node.path for node in run.nodes] == ["fetch", "fetch/look", "fetch/drive"]
    assert marks[0] == {} and marks[3] == {"fetch": "[>]", "look": "[+]", "drive": "[>]"}
    assert marks[-1] == {"fetch": "[x]", "look": "[+]", "drive": "[x]"}
    assert ways == sorted(ways) and set(range(1, 5)) <= set(ways), "each point of the way is a step"
    driving = run.moment(ways.index(2))
    assert driving.at == 1.0 and {node.name: node.mark for node in driving.nodes} == marks[3]
    assert run.moment(-5).at == 0.0 and run.moment(10_000).at == 3.5
    assert "a chair" in run.moment(len(run) - 1).text
    assert run.person == (4.0, 5.0) and run.run.cause == "fetch/drive"


@pytest.mark.parametrize("result", ["", "[]", '{"path": [[1, 2]]}', '{"path": 3}', '{"person": {"x": "a"}}'])
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
