"""A robot drives off after a start only when its mission server has just died, and when all has booted."""

from __future__ import annotations

from math import inf

import pytest

from florence_bt.app.runs.journal_view import left_runs, outcomes_of
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure, success
from florence_bt.core.skill import FinishedRun
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.recovery.recovery import BOOT_LIMIT_S, FRESH_S
from florence_bt.runtime.requests import same_again
from florence_bt.runtime.run import MissionRequest, RunStatus, TriggerPolicy
from tests.unit.runtime.recovery_bench import Process, after, crash, trip

HOME = [Step(success(pose=Pose2(0.5, 0.0, 0.0)), after=3.0)]


@pytest.mark.parametrize("policy", ["restart", "resume"])
@pytest.mark.parametrize("age", [FRESH_S + 1.0, 3 * 86400.0, -3600.0])
def test_nothing_drives_off_after_a_power_cut(tmp_path, policy, age):
    run_id = crash(tmp_path, policy=policy)
    second = Process(tmp_path, name="B", date=after(age))
    past = second.past(run_id)
    assert second.executor.current is None and (past.state, past.code) == ("ABORTED", "crashed")
    assert f"florence run {run_id}" in past.reason and any(run_id in text for text in second.told)


def test_runs_that_wait_do_not_drive_off_either(tmp_path):
    crash(tmp_path, policy="restart")
    first = Process(tmp_path, name="B")
    waiting = first.executor.trigger(trip(policy=TriggerPolicy.QUEUE))
    second = Process(tmp_path, name="C", date=after(1000.0))
    assert second.executor.current is None and second.past(waiting.run_id).state == "ABORTED"


@pytest.mark.parametrize("options", [{"date": after(FRESH_S - 1.0)}, {"date": after(1e6), "fresh_s": inf}])
def test_a_mission_server_that_has_just_died_goes_on(tmp_path, options):
    run_id = crash(tmp_path, policy="resume")
    second = Process(tmp_path, name="B", drive=HOME, **options)
    assert second.executor.current.run_id == run_id
    second.clock.advance(60.0)
    assert second.past(run_id).state == "SUCCEEDED"


def test_what_was_given_up_is_shown_and_starts_again_with_the_same_inputs(tmp_path):
    run_id = crash(tmp_path, policy="restart", inputs={"there": "{x: 3 m, y: 4 m, yaw: 0 deg}"})
    runs = tmp_path / "runs"
    assert left_runs(runs) == [run_id] and left_runs(tmp_path) == []
    second = Process(tmp_path, name="20240501T101500Z", date=after(1000.0))
    (line,) = outcomes_of(runs, [run_id])
    assert run_id in line and "ABORTED" in line and "limit is 60 s" in line
    run = second.executor.trigger(trip(inputs={"there": "{x: 5 m, y: 4 m, yaw: 0 deg}"}))
    second.executor.stop("enough")
    second.clock.advance(1.0)
    again = same_again(MissionRequest(run.run_id, {}, "Anna"), second.executor.library, runs)
    assert again == MissionRequest("round_trip", {"there": Pose2(5.0, 4.0, 0.0)}, "Anna")
    assert second.executor.trigger(again).inputs == run.inputs
    with pytest.raises(ConfigError, match="inputs that it had"):
        same_again(MissionRequest(run.run_id, {"there": "1"}, "Anna"), second.executor.library, runs)
    with pytest.raises(ConfigError, match="no run"):
        same_again(MissionRequest("20240501T101500Z-077-round_trip"), second.executor.library, runs)


class Boot:
    """A robot whose drivers boot; it can be made safe only when the base is there."""

    def __init__(self):
        self.missing = ["action spin", "the robot's pose"]
        self.stops = 0

    def make_safe(self):
        self.stops += 1
        return FinishedRun(failure("timed_out", "no odometry") if self.missing else success())


@pytest.mark.parametrize("policy", ["restart", "resume"])
def test_a_run_waits_for_drivers_that_are_still_booting(tmp_path, policy):
    run_id = crash(tmp_path, policy=policy)
    boot = Boot()
    second = Process(tmp_path, name="B", make_safe=boot.make_safe, missing=lambda: boot.missing, drive=HOME)
    second.clock.advance(BOOT_LIMIT_S - 1.0)
    assert second.executor.current is None and second.recovery.going_on and boot.stops == 1
    boot.missing = []
    second.clock.advance(1.0)
    assert second.executor.current is not None and not second.recovery.going_on and boot.stops == 2
    second.clock.advance(60.0)
    assert second.executor.last.status is RunStatus.SUCCEEDED
    assert (second.past(run_id).state == "SUCCEEDED") == (policy == "resume")


def test_what_does_not_boot_is_named(tmp_path):
    run_id = crash(tmp_path, policy="resume")
    boot = Boot()
    second = Process(tmp_path, name="B", make_safe=boot.make_safe, missing=lambda: boot.missing)
    second.clock.advance(BOOT_LIMIT_S + 1.0)
    past = second.past(run_id)
    assert past.state == "ABORTED" and "action spin, the robot's pose: not there after 60 s" in past.reason
    assert second.executor.blocked_by is None


def test_nobody_waits_for_drivers_when_no_run_goes_on(tmp_path):
    run_id = crash(tmp_path, policy="abort")
    second = Process(tmp_path, name="B", missing=lambda: ["action spin"])
    assert second.past(run_id).state == "ABORTED" and not second.recovery.going_on
