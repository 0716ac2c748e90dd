"""Runs that go on where their process died: whatever was going on then, and however often."""

from __future__ import annotations

import sqlite3

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.recovery import recovery
from florence_bt.runtime.recovery.recovery import MAX_IN_A_ROW
from florence_bt.runtime.replay.recorded_skills import RecordedRun
from florence_bt.runtime.run import MissionRequest, RunStatus
from tests.sweeps import sweep
from tests.unit.runtime.recovery_bench import (
    THERE,
    Process,
    crash,
    missions,
    trip,
)


def whole_life(folder):
    """An undisturbed round trip: the skill starts with inputs, and the outputs."""
    missions(folder, "resume")
    process = Process(folder)
    run = process.executor.trigger(trip())
    process.clock.advance(60.0)
    assert run.status is RunStatus.SUCCEEDED
    return {name: len(skill.runs) for name, skill in process.skills.items()}, run


@pytest.mark.parametrize("tenth", sweep(range(0, 190, 3), every=3))
def test_a_run_is_resumed_wherever_its_process_died(tmp_path, tenth):
    (tmp_path / "whole").mkdir()
    starts, whole = whole_life(tmp_path / "whole")
    (tmp_path / "died").mkdir()
    died_at = tenth / 10.0 + 0.05
    missions(tmp_path / "died", "resume")
    first = Process(tmp_path / "died")
    run = first.executor.trigger(trip())
    first.clock.advance(died_at)
    if run.status.final:
        return
    done = {name: len(skill.runs) - skill.active for name, skill in first.skills.items()}
    going = {name: skill.active for name, skill in first.skills.items()}
    # The drives that are still to come in the second process.
    script = first.scripts["drive"]
    drive = [script[min(done["drive"] + n, len(script) - 1)] for n in range(5)]
    second = Process(tmp_path / "died", start=5000.0, name="B", drive=drive)
    resumed = second.executor.current
    assert resumed is not None, second.told
    assert resumed.run_id == run.run_id
    second.clock.advance(60.0)
    assert resumed.status is RunStatus.SUCCEEDED, resumed.reason
    assert resumed.outputs == whole.outputs
    # What had ended is not done again; what went on is started again, once.
    for name, count in starts.items():
        assert len(second.skills[name].runs) == count - done[name], (name, going)
    assert second.past(run.run_id).state == "SUCCEEDED"


@pytest.mark.parametrize("seed", range(12))
def test_timers_that_ring_late_do_not_keep_a_run_from_being_resumed(tmp_path, seed):
    missions(tmp_path, "resume")
    first = Process(tmp_path, late=seed)
    run = first.executor.trigger(trip())
    first.clock.advance(1.0 + 1.2 * seed)
    second = Process(tmp_path, start=70.0, name="B", late=seed + 100)
    assert (second.executor.current is None) is run.status.final, second.told


def test_waits_and_limits_go_on_where_they_stood(tmp_path):
    # speak 0.5 s, drive 1 s (blocked), drive 3 s, so the wait of 2 s begins at 4.5 s: the last word of the
    # journal. The time that passed since then is not known to anybody.
    run_id = crash(tmp_path, at=6.0, policy="resume")
    second = Process(tmp_path, start=900.0, name="B")
    assert second.executor.tip() == "wait 2 s" and second.executor.current.run_id == run_id
    second.clock.advance(1.9)
    assert not second.skills["look"].runs
    second.clock.advance(0.2)
    assert second.skills["look"].active == 1


def test_a_run_can_be_resumed_again_and_again_but_not_for_ever(tmp_path):
    run_id = crash(tmp_path, at=2.0, policy="resume")
    for number in range(MAX_IN_A_ROW):
        process = Process(tmp_path, start=1000.0 * (number + 1), name=f"B{number}")
        assert process.executor.current is not None, process.told
        process.clock.advance(0.5)
    last = Process(tmp_path, start=9000.0, name="Z")
    assert last.executor.current is None and "resumed 3 times" in last.past(run_id).reason


def test_a_run_that_was_paused_and_resumed_is_taken_up(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path)
    run = first.executor.trigger(trip())
    first.clock.advance(2.0)
    first.executor.pause("a child")
    first.clock.advance(100.0)
    first.executor.resume()
    first.clock.advance(3.5)
    second = Process(tmp_path, name="B", drive=[Step(success(pose=Pose2(0.0, 0.0, 0.0)), after=3.0)])
    assert second.executor.current is not None, second.told
    assert second.executor.tip() == "wait 2 s"
    second.clock.advance(60.0)
    assert second.past(run.run_id).state == "SUCCEEDED"


def test_a_run_that_was_paused_stays_paused(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path)
    first.executor.trigger(trip())
    first.clock.advance(2.0)
    first.executor.pause("a child")
    second = Process(tmp_path, name="B")
    run = second.executor.current
    assert run is not None and run.status is RunStatus.PAUSED and run.paused == "a child", second.told
    second.clock.advance(50.0)
    assert not second.skills["drive"].runs
    second.executor.resume()
    second.clock.advance(60.0)
    assert run.status is RunStatus.SUCCEEDED


def test_a_run_whose_resume_was_taken_back_stays_paused_for_the_later_reason(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path, drive=[Step(None, cancel_takes=5.0)])
    first.executor.trigger(trip())
    first.clock.advance(1.0)
    first.executor.pause("a child")
    first.executor.resume()
    first.executor.pause("another child")
    first.clock.advance(2.0)
    second = Process(tmp_path, name="B")
    run = second.executor.current
    assert run is not None and run.status is RunStatus.PAUSED and run.paused == "another child", second.told
    second.executor.resume()
    second.clock.advance(60.0)
    assert run.status is RunStatus.SUCCEEDED


def test_a_changed_mission_file_is_not_resumed(tmp_path):
    run_id = crash(tmp_path, policy="resume")
    file = tmp_path / "home.yaml"  # a mission that is called counts as well
    file.write_text(file.read_text().replace("repeat: 2", "repeat: 3"))
    second = Process(tmp_path, name="B")
    assert second.past(run_id).state == "ABORTED" and "changed since" in second.past(run_id).reason


def test_a_journal_that_does_not_fit_the_mission_is_not_resumed(tmp_path):
    run_id = crash(tmp_path, policy="resume")
    with sqlite3.connect(tmp_path / "runs" / "journal.sqlite") as connection:
        connection.execute("UPDATE events SET inputs = '{\"text\":\"I stay\"}' WHERE skill = 'speak'")
    connection.close()
    second = Process(tmp_path, name="B")
    reason = second.past(run_id).reason
    assert second.past(run_id).state == "ABORTED" and "I stay" in reason and "I go" in reason


BRAKES = """
mission: brakes
description: Drives elsewhere while the first drive still brakes, and looks round all the time.
inputs:
  there: {type: pose}
on_restart: resume
tree:
  parallel:
    - selector:
        - timeout: 2 s
          do:
            drive: {goal: $there}
        - drive: {goal: $there}
    - repeat: 12
      do:
        look:
"""


@pytest.mark.parametrize("died_at", [1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5])
def test_a_run_in_which_a_skill_waited_for_its_turn_is_resumed(tmp_path, died_at):
    """Brakes from 2 s to 5 s, drives from there to 7 s."""
    (tmp_path / "brakes.yaml").write_text(BRAKES.strip())
    brakes = Step(None, cancel_takes=3.0)
    arrives = Step(success(pose=Pose2(1.0, 2.0, 0.0)), after=2.0)
    first = Process(tmp_path, drive=[brakes, arrives])
    run = first.executor.trigger(MissionRequest("brakes", THERE))
    first.clock.advance(died_at)
    # Nothing brakes any more after a crash, so who waited drives at once.
    second = Process(tmp_path, start=5000.0, name="B", drive=[brakes] * (died_at < 2.0) + [arrives])
    assert second.executor.current is not None, second.told
    second.clock.advance(0.5)
    assert len(second.skills["drive"].runs) == (died_at < 7.0)
    third = Process(tmp_path, start=9000.0, name="C", drive=[arrives])
    assert third.executor.current is not None, third.told
    third.clock.advance(60.0)
    assert third.past(run.run_id).state == "SUCCEEDED"


LONG = """
mission: long
description: Speaks often.
on_restart: resume
tree:
  repeat: 150
  do:
    sequence:
      - speak: {text: I go}
      - wait: 1 s
"""


def test_the_work_of_a_resume_grows_with_the_journal_and_no_faster(tmp_path, monkeypatch):
    (tmp_path / "long.yaml").write_text(LONG.strip())
    first = Process(tmp_path)
    run = first.executor.trigger(MissionRequest("long"))
    first.clock.advance(200.0)
    asked = []
    release = RecordedRun.release
    monkeypatch.setattr(RecordedRun, "release", lambda self: (asked.append(self), release(self)))
    second = Process(tmp_path, name="B")
    assert second.executor.current.run_id == run.run_id
    events = second.past(run.run_id).ticks
    assert 0 < len(asked) < 3 * events, "runs that have ended are asked again and again"


def test_a_journal_that_is_too_long_to_replay_aborts_the_run(tmp_path, monkeypatch):
    run_id = crash(tmp_path, policy="resume")
    monkeypatch.setattr(recovery, "MAX_REPLAYED", 10)
    second = Process(tmp_path, name="B")
    past = second.past(run_id)
    assert past.state == "ABORTED" and "events, more than 10; start it again with" in past.reason
