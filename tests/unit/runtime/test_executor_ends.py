"""Ends that do not come by themselves: stubborn and broken skills, missions with errors."""

from __future__ import annotations

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import success
from florence_bt.core.skill import BaseRun
from florence_bt.core.skill import Event as SkillEvent
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.executor import END_LIMIT_S, RequestRefused
from florence_bt.runtime.run import MissionRequest, RunStatus, TriggerPolicy


class Stubborn:
    """A skill that never reports an end, whatever it is told."""

    def __init__(self):
        self.state = BaseRun("driving on")
        self.cancels = 0

    def start(self, inputs):
        self.state = BaseRun("driving on")
        return self

    @property
    def feedback(self):
        return self.state.feedback

    def poll(self):
        return self.state.result

    def cancel(self):
        self.cancels += 1

    def on_change(self, callback):
        self.state.on_change(callback)


def params(bench, **skills):
    bench.skills.update(skills)


def test_a_skill_that_never_ends_holds_the_run_up_only_so_long(bench):
    stubborn = Stubborn()
    params(bench, drive=stubborn)
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    queued = bench.executor.trigger(MissionRequest("work_with_limit", policy=TriggerPolicy.QUEUE))
    bench.executor.stop("enough")
    bench.clock.advance(END_LIMIT_S - 0.1)
    assert run.status is RunStatus.ENDING and stubborn.cancels == 1
    bench.clock.advance(0.2)
    assert run.status is RunStatus.STOPPED and run.ended == 101.0 + END_LIMIT_S
    assert run.reason == "enough (was at 'drive'); not known to have ended: drive"
    bench.clock.advance(2.0)
    assert queued.status is RunStatus.SUCCEEDED
    # What it says after all changes nothing any more.
    before = len(bench.events)
    stubborn.state.handle(SkillEvent.FINISHED, success())
    bench.clock.advance(1.0)
    assert len(bench.events) == before and run.status is RunStatus.STOPPED


def test_the_limit_of_one_run_does_not_end_the_next(bench):
    params(bench, drive=Stubborn())
    first = bench.executor.trigger(MissionRequest("drive_once"))
    bench.executor.stop("before it began")
    bench.clock.advance(1.0)
    assert first.status is RunStatus.STOPPED
    second = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(END_LIMIT_S + 5.0)
    assert second.status is RunStatus.RUNNING


def test_abandoning_ends_everything_at_once_and_cancels_the_skill(bench):
    bench.script(Step(None, cancel_takes=1.0))
    first = bench.executor.trigger(MissionRequest("drive_once"))
    second = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE))
    bench.clock.advance(1.0)
    bench.executor.abandon("shutting down")
    assert first.status is second.status is RunStatus.STOPPED
    assert bench.drive.runs[0].cancelled and bench.executor.current is None
    assert "not known to have ended: drive" in first.reason
    bench.executor.abandon("twice does no harm")


@pytest.mark.parametrize("policy", list(TriggerPolicy))
def test_a_mission_with_an_error_in_its_file_is_refused_and_blocks_nothing(bench, tmp_path, policy):
    file = tmp_path / "wrong.yaml"
    file.write_text("mission: wrong\ndescription: Wrong.\ntree:\n  sequence:\n    - driv: {way: 1 m}\n")
    bench.executor.library.add_file(file)
    with pytest.raises(ConfigError, match=r"wrong\.yaml:5"):
        bench.executor.trigger(MissionRequest("wrong", policy=policy))
    assert bench.executor.current is None and not bench.events
    running = bench.executor.trigger(MissionRequest("drive_once"))
    with pytest.raises((ConfigError, RequestRefused)):
        bench.executor.trigger(MissionRequest("wrong", policy=policy))
    bench.clock.advance(5.0)
    assert running.status is RunStatus.SUCCEEDED


@pytest.mark.parametrize("broken", ["cancel", "poll"])
def test_a_skill_that_breaks_when_it_is_stopped_does_not_hold_the_run(bench, broken):
    class Broken(Stubborn):
        def cancel(self):
            super().cancel()
            if broken == "cancel":
                raise RuntimeError("cannot cancel")

        def poll(self):
            if self.cancels and broken == "poll":
                raise RuntimeError("cannot say")

    params(bench, drive=Broken())
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    assert bench.executor.stop("enough") is run
    # Who cannot say whether it has ended is not waited for.
    bench.clock.advance(0.0 if broken == "poll" else END_LIMIT_S + 0.1)
    assert run.status is RunStatus.STOPPED and bench.executor.current is None
    told = [event.data["detail"] for event in bench.events if event.kind is EventKind.BROKEN]
    why = "cannot cancel" if broken == "cancel" else "cannot say"
    assert told and all(f"RuntimeError: {why}" in detail for detail in told)


def test_a_skill_that_answers_nonsense_fails_its_run_and_nothing_else(bench):
    class Nonsense(Stubborn):
        def poll(self):
            return 5

    params(bench, drive=Nonsense())
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(END_LIMIT_S + 0.1)
    assert (run.status, run.code) == (RunStatus.FAILED, "internal_error")
    assert "'drive'" in run.reason and "5" in run.reason and "must be a Result" in run.reason
    assert bench.executor.current is None


def test_a_clean_up_that_takes_long_is_waited_for(bench, tmp_path):
    file = tmp_path / "tidy.yaml"
    file.write_text(
        "mission: tidy\ndescription: Drives and tidies up.\ntree:\n"
        "  sequence:\n    - drive: {way: 1 m}\n  finally:\n    wait: 40 s\n"
    )
    bench.executor.library.add_file(file)
    bench.script(Step(None))
    run = bench.executor.trigger(MissionRequest("tidy"))
    bench.clock.advance(1.0)
    bench.executor.stop("enough")
    bench.clock.advance(39.0)
    assert run.status is RunStatus.ENDING
    bench.clock.advance(10.0)
    assert run.status is RunStatus.STOPPED and run.ended == pytest.approx(141.0)
    assert run.reason.startswith("enough") and "not known" not in run.reason
