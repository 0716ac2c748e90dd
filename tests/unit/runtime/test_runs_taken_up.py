"""A process dies on its runs and another one takes them up: simulated in one process on manual clocks."""

from __future__ import annotations

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure, success
from florence_bt.core.skill import BaseRun, Event
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import RequestRefused
from florence_bt.runtime.recovery.recovery import MAX_IN_A_ROW, SAFE_LIMIT_S
from florence_bt.runtime.run import RunStatus, TriggerPolicy
from tests.unit.runtime.recovery_bench import (
    Process,
    crash,
    missions,
    trip,
)
from tests.unit.trees.dumps import run_dump


def test_nothing_is_left_after_a_run_that_ended(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path)
    run = first.executor.trigger(trip())
    first.clock.advance(60.0)
    assert run.status is RunStatus.SUCCEEDED, run.reason
    second = Process(tmp_path, name="B")
    assert not second.recovering
    last = second.executor.find()
    assert last.run_id == run.run_id, "people who ask for the last run are shown it"
    assert last.status is RunStatus.SUCCEEDED and "[+] speak" in run_dump(second.executor, last)
    assert second.executor.trigger(trip()).status is RunStatus.RUNNING


def test_abort_closes_the_run_with_what_it_was_doing(tmp_path):
    run_id = crash(tmp_path)
    second = Process(tmp_path, name="B")
    past = second.past(run_id)
    assert (past.state, past.code) == ("ABORTED", "crashed")
    assert "the process died during it" in past.reason and "on_restart says abort" in past.reason
    assert "[+] speak" in past.tree and "[>] wait 2 s" in past.tree
    assert second.executor.current is None and second.told
    assert second.executor.find().run_id == run_id, "people who ask are shown it"
    second.executor.trigger(trip())


def test_what_breaks_when_a_run_is_taken_up_aborts_that_run_only(tmp_path, monkeypatch):
    run_id = crash(tmp_path, policy="resume")

    def breaks(*arguments):
        raise KeyError("a node of somebody else")

    monkeypatch.setattr("florence_bt.runtime.recovery.recovery.replay", breaks)
    second = Process(tmp_path, name="B")
    past = second.past(run_id)
    assert past.state == "ABORTED" and "KeyError: 'a node of somebody else'" in past.reason
    second.executor.trigger(trip())


def test_restart_begins_the_mission_anew_with_the_same_inputs(tmp_path):
    run_id = crash(tmp_path, policy="restart", inputs={"there": "{x: 3 m, y: 4 m, yaw: 0 deg}"}, priority=2)
    second = Process(tmp_path, name="B")
    new = second.executor.current
    assert new.run_id != run_id and new.request.caller == f"restart of {run_id}"
    assert new.inputs == {"there": Pose2(3.0, 4.0, 0.0)} and new.request.priority == 2
    assert second.past(run_id).state == "ABORTED" and new.run_id in second.past(run_id).reason
    second.clock.advance(60.0)
    assert new.status is RunStatus.SUCCEEDED


def test_a_mission_that_kills_its_process_is_not_restarted_for_ever(tmp_path):
    crash(tmp_path, policy="restart")
    for number in range(MAX_IN_A_ROW):
        process = Process(tmp_path, name=f"B{number}")
        assert process.executor.current is not None
        process.clock.advance(1.0)
    last = Process(tmp_path, name="Z")
    assert last.executor.current is None
    assert "in a row" in max(last.all().values(), key=lambda run: run.run_id).reason


def test_queued_runs_survive_in_their_order(tmp_path):
    missions(tmp_path, "abort")
    first = Process(tmp_path)
    first.executor.trigger(trip())
    waiting = [
        first.executor.trigger(trip(policy=TriggerPolicy.QUEUE, priority=p, caller=str(p))) for p in (0, 0, 3)
    ]
    first.clock.advance(1.0)
    second = Process(tmp_path, name="B")
    order = [second.executor.current, *second.executor.waiting]
    # The run that had the robot is aborted, so the first of the queue runs at once.
    assert sorted(run.run_id for run in order) == sorted(run.run_id for run in waiting)
    assert [run.request.caller for run in order] == ["3", "0", "0"]
    second.clock.advance(100.0)
    assert {run.state for run in second.all().values()} == {"ABORTED", "SUCCEEDED"}


def test_a_run_that_was_being_stopped_is_not_taken_up(tmp_path):
    missions(tmp_path, "resume")
    first = Process(tmp_path, drive=[Step(None, cancel_takes=5.0)])
    run = first.executor.trigger(trip())
    first.clock.advance(1.0)
    first.executor.stop("enough")
    first.clock.advance(1.0)
    assert run.status is RunStatus.ENDING
    second = Process(tmp_path, name="B")
    assert second.past(run.run_id).state == "ABORTED" and "being stopped" in second.past(run.run_id).reason


class Brake(BaseRun):
    """Makes safe when it is told to."""

    def __init__(self):
        super().__init__()
        self.calls = 0
        self.cancelled = False

    def __call__(self):
        self.calls += 1
        return self

    def cancel(self):
        self.cancelled = True


def test_the_robot_is_made_safe_before_anything_else(tmp_path):
    crash(tmp_path, policy="restart")
    brake = Brake()
    second = Process(tmp_path, name="B", make_safe=brake)
    assert brake.calls == 1 and second.executor.current is None
    with pytest.raises(RequestRefused, match="made safe after a crash"):
        second.executor.trigger(trip())
    second.clock.advance(1.0)
    assert second.executor.current is None
    brake.handle(Event.FINISHED, success())
    assert second.executor.current is not None
    second.clock.advance(60.0)
    assert second.executor.last.status is RunStatus.SUCCEEDED


@pytest.mark.parametrize("late", [False, True])
def test_nothing_is_taken_up_when_the_robot_cannot_be_made_safe(tmp_path, late):
    run_id = crash(tmp_path, policy="resume")
    brake = Brake()
    second = Process(tmp_path, name="B", make_safe=brake)
    if late:
        second.clock.advance(SAFE_LIMIT_S + 1.0)
        assert brake.cancelled
    else:
        brake.handle(Event.FINISHED, failure("server_lost", "the base does not answer"))
    assert second.executor.current is None
    assert second.past(run_id).state == "ABORTED" and "could not be made safe" in second.past(run_id).reason
    assert second.executor.blocked_by is None


def test_names_of_older_runs_are_not_used_again(tmp_path):
    run_id = crash(tmp_path)
    second = Process(tmp_path)
    assert second.executor.trigger(trip()).run_id not in ("", run_id)
