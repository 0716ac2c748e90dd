"""A process dies on a robot that a person has stopped: nothing drives off until somebody asks for it."""

from __future__ import annotations

from datetime import timedelta

import pytest

from florence_bt.core.outcome import success
from florence_bt.core.skill import BaseRun, Event
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import RequestRefused
from florence_bt.runtime.run import RunStatus, TriggerPolicy
from tests.unit.runtime.recovery_bench import DATE, Process, crash, missions, trip


def paused_crash(folder, policy, queued=0):
    """A process that dies while a round trip is paused; gives the run's id."""
    missions(folder, policy)
    first = Process(folder)
    run = first.executor.trigger(trip())
    for _ in range(queued):
        first.executor.trigger(trip(policy=TriggerPolicy.QUEUE))
    first.clock.advance(2.0)
    first.executor.pause("a visitor")
    first.clock.advance(1.0)
    return run.run_id


def stands_paused(process):
    """Nothing starts by itself; gives the run that is paused."""
    before = [len(skill.runs) for skill in process.skills.values()]
    process.clock.advance(600.0)
    assert [len(skill.runs) for skill in process.skills.values()] == before
    run = process.executor.current
    assert run is not None, process.told
    assert (run.status, run.paused) == (RunStatus.PAUSED, "a visitor")
    assert process.past(run.run_id).state == "PAUSED"
    return run


def goes_on(process, run):
    """Somebody asks for it."""
    process.executor.resume()
    process.clock.advance(60.0)
    assert run.status is RunStatus.SUCCEEDED, run.reason


@pytest.mark.parametrize("policy", ["restart", "resume"])
@pytest.mark.parametrize("crashes", [1, 2, 3])
def test_a_pause_outlives_crashes(tmp_path, policy, crashes):
    paused_crash(tmp_path, policy)
    for number in range(crashes):
        last = Process(tmp_path, name=f"B{number}", start=1000.0 * number)
        run = stands_paused(last)
    goes_on(last, run)


@pytest.mark.parametrize("policy", ["restart", "resume"])
def test_a_resume_ends_the_pause_for_the_next_process_too(tmp_path, policy):
    paused_crash(tmp_path, policy)
    second = Process(tmp_path, name="B", start=1000.0)
    second.executor.resume()
    second.clock.advance(0.1)
    third = Process(tmp_path, name="C", start=2000.0)
    third.clock.advance(60.0)
    assert third.executor.last.status is RunStatus.SUCCEEDED, third.told


def test_a_pause_that_was_asked_for_twice_keeps_its_first_reason(tmp_path):
    missions(tmp_path, "restart")
    first = Process(tmp_path)
    first.executor.trigger(trip())
    first.clock.advance(2.0)
    first.executor.pause("a visitor")
    first.executor.pause("another one")
    stands_paused(Process(tmp_path, name="B"))


def test_a_run_that_was_paused_before_its_first_tick(tmp_path):
    missions(tmp_path, "restart")
    first = Process(tmp_path)
    first.executor.trigger(trip())
    first.executor.pause("a visitor")
    second = Process(tmp_path, name="B")
    goes_on(second, stands_paused(second))


def test_a_resume_that_still_waits_for_a_skill_to_stop_does_not_count(tmp_path):
    missions(tmp_path, "restart")
    first = Process(tmp_path, drive=[Step(None, cancel_takes=9.0)])
    first.executor.trigger(trip())
    first.clock.advance(2.0)
    first.executor.pause("a visitor")
    first.executor.resume()
    first.clock.advance(1.0)
    stands_paused(Process(tmp_path, name="B"))


@pytest.mark.parametrize("policy", ["abort", "restart", "resume"])
def test_who_waits_behind_a_paused_run_does_not_drive_off_in_its_place(tmp_path, policy):
    gone = paused_crash(tmp_path, policy, queued=2)
    second = Process(tmp_path, name="B")
    run = stands_paused(second)
    assert (run.run_id == gone) is (policy == "resume")
    assert len(second.executor.waiting) == (1 if policy == "abort" else 2)
    third = Process(tmp_path, name="C")
    run = stands_paused(third)
    goes_on(third, run)


def test_the_next_run_stays_paused_when_the_one_that_was_paused_cannot_be_resumed(tmp_path):
    paused_crash(tmp_path, "resume", queued=1)
    missions(tmp_path, "restart")
    (tmp_path / "home.yaml").write_text((tmp_path / "home.yaml").read_text().replace("home.", "home now."))
    second = Process(tmp_path, name="B")
    goes_on(second, stands_paused(second))


# ---- before it is decided what becomes of the runs ---------------------------------------------------------


class Braking(BaseRun):
    """A robot that stands when the test says so."""

    def __init__(self):
        super().__init__("braking")

    def cancel(self):
        pass

    def stand(self):
        self.handle(Event.FINISHED, success())


@pytest.mark.parametrize("policy", ["restart", "resume"])
def test_a_pause_that_is_asked_for_before_the_robot_is_safe(tmp_path, policy):
    crash(tmp_path, at=2.0, policy=policy)
    braking = Braking()
    second = Process(tmp_path, name="B", make_safe=lambda: braking)
    with pytest.raises(RequestRefused):
        second.executor.pause("a visitor", "another run")
    assert second.executor.pause("a visitor").paused == "a visitor"
    assert second.executor.pause("somebody else").paused == "a visitor"
    braking.stand()
    goes_on(second, stands_paused(second))


def test_a_stop_that_is_asked_for_before_the_robot_is_safe(tmp_path):
    run_id = crash(tmp_path, policy="restart")
    braking = Braking()
    second = Process(tmp_path, name="B", make_safe=lambda: braking)
    assert second.executor.stop("enough", "another run") is None
    assert second.executor.stop("enough").run_id == run_id
    assert second.past(run_id).state == "ABORTED" and "enough" in second.past(run_id).reason
    braking.stand()
    second.clock.advance(60.0)
    assert second.executor.current is None and not second.skills["drive"].runs


# ---- the override -----------------------------------------------------------------------------------------


def recovered(folder, overridden):
    missing = Braking()
    process = Process(folder, name="B", make_safe=lambda: missing, overridden=lambda: overridden)
    missing.stand()
    process.clock.advance(60.0)
    return process


@pytest.mark.parametrize("policy", ["abort", "restart", "resume"])
def test_no_run_comes_back_from_an_override_that_came_and_went_without_a_mission_server(tmp_path, policy):
    missions(tmp_path, policy)
    first = Process(tmp_path)
    runs = [first.executor.trigger(trip(policy=TriggerPolicy.QUEUE)) for _ in range(3)]
    first.clock.advance(2.0)
    second = recovered(tmp_path, DATE + timedelta(seconds=1.0))
    assert second.executor.current is None and not second.executor.waiting
    for run in runs:
        assert second.past(run.run_id).state == "ABORTED"
        assert "manual override" in second.past(run.run_id).reason
    assert not any(skill.runs for skill in second.skills.values())


def test_an_override_before_the_run_was_triggered_does_not_count(tmp_path):
    crash(tmp_path, policy="restart")
    second = recovered(tmp_path, DATE - timedelta(seconds=1.0))
    assert second.executor.last.status is RunStatus.SUCCEEDED


@pytest.mark.parametrize("policy", ["restart", "resume"])
def test_a_run_that_the_override_was_stopping_does_not_come_back(tmp_path, policy):
    missions(tmp_path, policy)
    first = Process(tmp_path, drive=[Step(None, cancel_takes=9.0)])
    run = first.executor.trigger(trip())
    first.clock.advance(2.0)
    first.executor.override("Anna")
    first.clock.advance(0.1)
    assert run.status is RunStatus.ENDING
    second = Process(tmp_path, name="B")
    second.clock.advance(60.0)
    assert second.executor.current is None and not any(skill.runs for skill in second.skills.values())
