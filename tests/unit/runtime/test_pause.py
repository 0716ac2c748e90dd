"""Pausing: the robot stands still, the tree is not ticked, no time passes for the run."""

from __future__ import annotations

import pytest

from florence_bt.core.outcome import failure, success
from florence_bt.core.skill import BaseRun, Event
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.executor import END_LIMIT_S, RequestRefused
from florence_bt.runtime.run import MissionRequest, RunStatus, TriggerPolicy
from tests.unit.trees.dumps import run_dump

# Times: the clock starts at 100 s; drive takes 2 s, work takes 1 s.


class Stubborn(BaseRun):
    """A skill, and its only run, that never reports an end, whatever it is told."""

    def start(self, inputs):
        return self

    def cancel(self):
        pass


def params(bench, **skills):
    bench.skills.update(skills)


def add(bench, tmp_path, name, tree):
    file = tmp_path / f"{name}.yaml"
    file.write_text(f"mission: {name}\ndescription: A test.\ntree:\n{tree}")
    bench.executor.library.add_file(file)


def kinds(bench):
    return [event.kind for event in bench.events if event.kind is not EventKind.NODE]


def test_a_paused_skill_is_cancelled_and_started_again_with_the_same_inputs(bench):
    run = bench.executor.trigger(MissionRequest("drive_once", {"way": "3 m"}))
    bench.clock.advance(1.5)
    assert bench.executor.pause("a child is in the way") is run
    assert run.status is RunStatus.PAUSED and bench.drive.active == 0 and bench.drive.runs[0].cancelled
    ticks = run.ticks
    bench.clock.advance(1000.0)
    assert run.status is RunStatus.PAUSED and run.ticks == ticks and len(bench.drive.runs) == 1
    assert "-- cancelled for the pause" in run_dump(bench.executor, run), "it does not drive any more"
    assert bench.executor.resume() is run
    assert "pause" not in run_dump(bench.executor, run)
    assert run.status is RunStatus.RUNNING and bench.drive.calls == [{"way": 3.0}] * 2
    bench.clock.advance(2.0)
    assert run.status is RunStatus.SUCCEEDED and run.ended == 1103.5
    assert kinds(bench) == [
        EventKind.STARTED,
        EventKind.SKILL_STARTED,
        EventKind.SKILL_ENDED,
        EventKind.PAUSED,
        EventKind.RESUMED,
        EventKind.SKILL_STARTED,
        EventKind.SKILL_ENDED,
        EventKind.ENDED,
    ]


def test_no_timeout_runs_on_during_a_pause(bench):
    bench.script_work(Step(success(pay=1), after=2.0))
    run = bench.executor.trigger(MissionRequest("work_with_limit"))
    bench.clock.advance(0.5)
    bench.executor.pause("wait")
    bench.clock.advance(500.0)
    bench.executor.resume()
    # The limit is 3 s, of which 0.5 s have passed; the work begins anew and takes 2 s.
    bench.clock.advance(1.9)
    assert run.status is RunStatus.RUNNING
    bench.clock.advance(0.2)
    assert run.status is RunStatus.SUCCEEDED


def test_the_rest_of_a_timeout_counts_after_a_pause(bench):
    bench.script_work(Step(None))
    run = bench.executor.trigger(MissionRequest("work_with_limit"))
    bench.clock.advance(2.0)
    bench.executor.pause("wait")
    bench.clock.advance(500.0)
    bench.executor.resume()
    bench.clock.advance(0.9)
    assert run.status is RunStatus.RUNNING
    bench.clock.advance(0.2)
    assert run.status is RunStatus.FAILED and run.code == "timed_out"


def test_a_wait_does_not_run_on(bench, tmp_path):
    add(bench, tmp_path, "rest", "  sequence:\n    - wait: 10 s\n    - work:\n")
    run = bench.executor.trigger(MissionRequest("rest"))
    bench.clock.advance(4.0)
    bench.executor.pause("wait")
    bench.clock.advance(100.0)
    bench.executor.resume()
    bench.clock.advance(5.9)
    assert not bench.work.runs
    bench.clock.advance(1.2)
    assert run.status is RunStatus.SUCCEEDED


def test_a_skill_that_had_finished_keeps_its_result(bench, tmp_path):
    add(bench, tmp_path, "both", "  parallel:\n    - drive: {way: 1 m}\n    - work:\n")
    bench.script(Step(after=5.0))
    run = bench.executor.trigger(MissionRequest("both"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    assert (len(bench.work.runs), len(bench.drive.runs)) == (1, 1)
    bench.clock.advance(10.0)
    bench.executor.resume()
    bench.clock.advance(5.0)
    assert run.status is RunStatus.SUCCEEDED
    assert (len(bench.work.runs), len(bench.drive.runs)) == (1, 2)


def test_a_skill_that_ends_at_the_moment_of_the_pause_keeps_its_result(bench):
    class Eager(Stubborn):
        """Its work is done when it is cancelled."""

        starts = 0

        def start(self, inputs):
            self.starts += 1
            return super().start(inputs)

        def cancel(self):
            self.handle(Event.FINISHED, success())

    eager = Eager()
    params(bench, drive=eager)
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    bench.clock.advance(5.0)
    bench.executor.resume()
    bench.clock.advance(0.0)
    assert run.status is RunStatus.SUCCEEDED and eager.starts == 1
    assert kinds(bench).count(EventKind.SKILL_ENDED) == 1


@pytest.mark.parametrize("moment", [0.0, 0.2, 1.0, 1.9])
@pytest.mark.parametrize(("accept_after", "cancel_takes"), [(0.0, 0.0), (0.5, 0.0), (0.0, 0.7), (0.5, 0.7)])
def test_resume_waits_until_the_cancelled_skill_has_let_go(bench, moment, accept_after, cancel_takes):
    bench.script(Step(after=2.0, accept_after=accept_after, cancel_takes=cancel_takes))
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(moment)
    bench.executor.pause("wait")
    bench.executor.resume()
    for _ in range(40):
        assert bench.drive.active <= 1
        bench.clock.advance(0.1)
    bench.clock.advance(5.0)
    assert run.status is RunStatus.SUCCEEDED and bench.drive.active == 0


def test_a_skill_that_never_lets_go_fails_the_resumed_run(bench):
    params(bench, drive=Stubborn())
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    bench.executor.resume()
    assert run.status is RunStatus.PAUSED
    bench.clock.advance(END_LIMIT_S + 0.1)
    assert run.status is RunStatus.ENDING
    bench.clock.advance(END_LIMIT_S + 0.1)
    assert run.status is RunStatus.FAILED and "not known to have ended: drive" in run.reason


def test_a_second_pause_takes_back_a_resume_that_has_not_come_into_effect(bench):
    bench.script(Step(after=2.0, cancel_takes=1.0))
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(0.5)
    bench.executor.pause("wait")
    bench.executor.resume()
    bench.executor.pause("no, stay")
    bench.clock.advance(60.0)
    assert run.status is RunStatus.PAUSED and run.paused == "no, stay"
    assert [event.data["reason"] for event in bench.events if event.kind is EventKind.PAUSED] == [
        "wait",
        "no, stay",
    ]


def test_a_run_that_is_paused_twice_keeps_its_first_reason(bench):
    run = bench.executor.trigger(MissionRequest("drive_once", {"way": "3 m"}))
    bench.clock.advance(0.5)
    bench.executor.pause("a visitor")
    assert bench.executor.pause("florence pause") is run
    assert run.paused == "a visitor" and kinds(bench).count(EventKind.PAUSED) == 1
    bench.executor.resume()
    bench.clock.advance(5.0)
    assert run.status is RunStatus.SUCCEEDED


@pytest.mark.parametrize("cancel_takes", [0.0, 0.7])
@pytest.mark.parametrize("wait", [0.0, 0.3, 5.0])
def test_a_paused_run_can_be_stopped(bench, cancel_takes, wait):
    bench.script(Step(after=2.0, cancel_takes=cancel_takes))
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    bench.clock.advance(wait)
    bench.executor.stop("enough")
    bench.clock.advance(1.0)
    assert run.status is RunStatus.STOPPED and bench.drive.active == 0 and len(bench.drive.runs) == 1
    assert "[-] drive" in run.tree
    assert kinds(bench).count(EventKind.SKILL_ENDED) == 1


def test_a_clean_up_runs_when_a_paused_run_is_stopped(bench, tmp_path):
    add(bench, tmp_path, "tidy", "  sequence:\n    - drive: {way: 1 m}\n  finally:\n    wait: 4 s\n")
    run = bench.executor.trigger(MissionRequest("tidy"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    bench.clock.advance(50.0)
    bench.executor.stop("enough")
    bench.clock.advance(3.9)
    assert run.status is RunStatus.ENDING
    bench.clock.advance(0.2)
    assert run.status is RunStatus.STOPPED


@pytest.mark.parametrize("cancel_takes", [0.0, 0.5])
def test_a_run_that_is_paused_and_stopped_in_its_clean_up_goes_on_with_it(bench, tmp_path, cancel_takes):
    # The clean-up works, then drives; the drive is cancelled for the pause, and is started again.
    add(
        bench,
        tmp_path,
        "tidy",
        "  wait: 0.5 s\n  finally:\n    sequence:\n      - work:\n      - drive: {way: 1 m}\n",
    )
    bench.script_work(Step(success(pay=1)))
    bench.script(Step(success(), after=2.0, cancel_takes=cancel_takes))
    run = bench.executor.trigger(MissionRequest("tidy"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    bench.executor.stop("enough")
    assert run.status is RunStatus.ENDING
    bench.clock.advance(0.4)
    assert len(bench.drive.runs) == (1 if cancel_takes else 2), "not before the first one has ended"
    bench.clock.advance(2.2)
    assert run.status is RunStatus.STOPPED and (len(bench.drive.runs), bench.drive.active) == (2, 0)
    assert len(bench.work.runs) == 1, "the clean-up has not begun again"


def test_a_skill_of_a_clean_up_that_never_ends_after_a_pause_does_not_keep_a_stopped_run(bench, tmp_path):
    add(bench, tmp_path, "tidy", "  work:\n  finally:\n    drive: {way: 1 m}\n")
    bench.script_work(Step(success(pay=1)))
    bench.script(Step(None, cancel_takes=1e6))
    run = bench.executor.trigger(MissionRequest("tidy"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    bench.executor.stop("enough")
    bench.clock.advance(30.0)
    assert run.status is RunStatus.STOPPED and "not known to have ended: " in run.why.reason


def test_a_clean_up_beside_the_tree_is_paused_too(bench, tmp_path):
    # The inner body is left after 1 s; its clean-up (drive, 2 s) goes on beside the work (6 s).
    tree = (
        "  sequence:\n"
        "    - succeed:\n"
        "        timeout: 1 s\n"
        "        do:\n"
        "          sequence: [{wait: 9 s}]\n"
        "          finally:\n"
        "            drive: {way: 1 m}\n"
        "    - work:\n"
    )
    add(bench, tmp_path, "inner", tree)
    bench.script_work(Step(success(pay=1), after=6.0))
    run = bench.executor.trigger(MissionRequest("inner"))
    bench.clock.advance(2.0)
    assert (bench.drive.active, bench.work.active) == (1, 1)
    bench.executor.pause("wait")
    assert (bench.drive.active, bench.work.active) == (0, 0)
    bench.clock.advance(30.0)
    assert (len(bench.drive.runs), len(bench.work.runs)) == (1, 1)
    bench.executor.resume()
    assert (bench.drive.active, bench.work.active) == (1, 1)
    bench.clock.advance(6.5)
    assert run.status is RunStatus.SUCCEEDED and bench.drive.active == 0


def test_what_cannot_be_paused_or_resumed_is_refused_with_the_reason(bench):
    with pytest.raises(RequestRefused, match="no mission is running"):
        bench.executor.pause("wait")
    run = bench.executor.trigger(MissionRequest("drive_once"))
    queued = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE))
    with pytest.raises(RequestRefused, match="waits for its turn"):
        bench.executor.pause("wait", queued.run_id)
    with pytest.raises(RequestRefused, match=f"no run 'T-9' is running; drive_once .run {run.run_id}"):
        bench.executor.pause("wait", "T-9")
    with pytest.raises(RequestRefused, match="is not paused"):
        bench.executor.resume()
    bench.script(Step(after=2.0, cancel_takes=1.0))
    bench.clock.advance(3.0)
    assert bench.executor.current is queued
    bench.executor.pause("wait", queued.run_id)
    bench.executor.resume(queued.run_id)
    bench.clock.advance(0.5)
    bench.executor.stop("enough")
    if queued.status is RunStatus.ENDING:
        with pytest.raises(RequestRefused, match="ending"):
            bench.executor.pause("wait")


def test_a_pause_before_the_first_tick_starts_nothing(bench):
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.executor.pause("at once")
    bench.clock.advance(10.0)
    assert not bench.drive.runs
    bench.executor.resume()
    bench.clock.advance(3.0)
    assert run.status is RunStatus.SUCCEEDED


def test_a_paused_run_is_preempted_like_a_running_one(bench):
    first = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    second = bench.executor.trigger(MissionRequest("drive_and_work", policy=TriggerPolicy.PREEMPT))
    bench.clock.advance(10.0)
    assert (first.status, second.status) == (RunStatus.STOPPED, RunStatus.SUCCEEDED)


def test_a_failing_restart_of_a_skill_fails_the_run(bench):
    bench.script(Step(after=2.0), Step(failure("blocked", "a chair")))
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    bench.executor.resume()
    bench.clock.advance(0.0)
    assert run.status is RunStatus.FAILED and run.code == "blocked"


def test_a_skill_that_breaks_at_the_restart_fails_the_run(bench):
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    bench.executor.pause("wait")
    bench.drive.start = None
    bench.executor.resume()
    bench.clock.advance(1.0)
    assert run.status is RunStatus.FAILED and run.code == "internal_error"


def test_a_preempting_run_does_not_overtake_a_higher_priority(bench):
    bench.script(Step(after=9.0, cancel_takes=0.5), Step(after=1.0))
    bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    high = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.PREEMPT, priority=5))
    low = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.PREEMPT, priority=0))
    bench.clock.advance(20.0)
    assert high.started < low.started


def test_a_listener_that_breaks_takes_no_run_down_and_is_told_once(bench):
    def broken(run, event):
        raise RuntimeError("a bug in a listener")

    bench.executor.add_listener(broken)
    bench.on_tick = lambda run: broken(run, None)
    run = bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(10.0)
    assert run.status is RunStatus.SUCCEEDED
    told = [event for event in bench.events if event.kind is EventKind.BROKEN]
    assert len(told) == 2 and "a bug in a listener" in told[0].data["detail"]
