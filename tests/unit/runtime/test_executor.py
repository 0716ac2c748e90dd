from __future__ import annotations

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.executor import RequestRefused
from florence_bt.runtime.run import MissionRequest, RunStatus, TriggerPolicy
from florence_bt.trees.language.vocabulary import MAX_QUICK_ROUNDS

# Times: the clock starts at 100 s; drive takes 2 s, work takes 1 s.


def test_a_mission_runs_to_its_end_and_gives_its_outputs(bench):
    run = bench.executor.trigger(MissionRequest("drive_and_work", caller="test"))
    assert run.status is RunStatus.RUNNING and not bench.drive.runs  # the first tick comes after the call
    bench.clock.advance(2.9)
    assert run.status is RunStatus.RUNNING
    bench.clock.advance(0.2)
    assert run.status is RunStatus.SUCCEEDED and run.code == "ok"
    assert (run.started, run.ended) == (100.0, 103.0)
    assert run.outputs == {"pay": 7}
    assert bench.executor.current is None and bench.executor.last is run


def test_it_ticks_only_when_something_happened(bench):
    # Ticks: the start; drive's end (which also starts work); work's end.
    run = bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(0.0)
    ticks = run.ticks
    bench.clock.advance(1.9)
    assert run.ticks == ticks
    bench.clock.advance(10.0)
    assert run.ticks <= 5


def test_a_skill_starts_at_the_very_moment_the_one_before_ends(bench):
    bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(10.0)
    ended = next(e for e in bench.events if e.kind is EventKind.SKILL_ENDED and e.data["skill"] == "drive")
    began = next(e for e in bench.events if e.kind is EventKind.SKILL_STARTED and e.data["skill"] == "work")
    assert ended.time == began.time == 102.0


def test_the_next_skill_starts_before_the_end_of_the_last_one_is_told_and_the_order_stays(bench):
    # What every listener sees of the next skill when it hears of the end of the one before.
    started = []
    bench.executor.add_listener(
        lambda run, event: started.append((event.kind, event.data.get("skill"), len(bench.work.runs)))
    )
    bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(2.5)
    assert (EventKind.SKILL_ENDED, "drive", 1) in started
    skills = [(kind, skill) for kind, skill, _ in started if skill is not None]
    assert skills == [
        (EventKind.SKILL_STARTED, "drive"),
        (EventKind.SKILL_ENDED, "drive"),
        (EventKind.SKILL_STARTED, "work"),
    ]


def test_what_a_tick_did_is_told_before_its_break_down(bench, monkeypatch):
    def explode(inputs):
        raise RuntimeError("broken")

    monkeypatch.setattr(bench.work, "start", explode)
    run = bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(2.5)
    kinds = [event.kind for event in bench.events if event.kind is not EventKind.NODE]
    ended, broken = kinds.index(EventKind.SKILL_ENDED), kinds.index(EventKind.BROKEN)
    assert ended < broken < kinds.index(EventKind.ENDED)
    assert (run.status, run.code) == (RunStatus.FAILED, "internal_error")


def test_the_processor_is_given_away_once_the_skills_of_a_tick_have_started(make_bench):
    seen = []
    bench = make_bench(yield_cpu=lambda: seen.append((len(bench.drive.runs), len(bench.events))))
    bench.executor.trigger(MissionRequest("drive_once"))
    told = len(bench.events)  # that the run has started
    bench.clock.advance(0.0)
    assert seen == [(1, told)] and len(bench.events) > told


def test_a_failure_carries_code_reason_and_leaf(bench):
    bench.script(Step(failure("blocked", "a chair is in the way"), after=1.0))
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(5.0)
    assert run.status is RunStatus.FAILED
    assert (run.code, run.reason) == ("blocked", "a chair is in the way")
    assert run.why is not None and run.why.path.startswith("drive_once/")
    assert "[x]" in run.tree and "a chair is in the way" in run.tree


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        (MissionRequest("drive_ones"), "there is no mission 'drive_ones'.*drive_once"),
        (MissionRequest("drive_once", {"way": "9 m"}), "way"),
        (MissionRequest("drive_once", {"way": "9 s"}), "way"),
        (MissionRequest("drive_once", {"weigh": "1 m"}), "no input 'weigh'.*way"),
    ],
)
def test_a_bad_request_says_what_works_and_starts_nothing(bench, request_, message):
    with pytest.raises(ConfigError, match=message):
        bench.executor.trigger(request_)
    bench.clock.advance(1.0)
    assert bench.executor.current is None and not bench.drive.runs and not bench.events


@pytest.mark.parametrize("moment", [0.0, 0.3, 1.0, 1.99])
@pytest.mark.parametrize(("accept_after", "cancel_takes"), [(0.0, 0.0), (0.5, 0.0), (0.0, 0.7), (0.5, 0.7)])
def test_a_stop_at_any_moment_ends_the_skill_before_the_run_is_over(
    bench, moment, accept_after, cancel_takes
):
    bench.script(Step(after=2.0, accept_after=accept_after, cancel_takes=cancel_takes))
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(moment)
    assert bench.executor.stop("enough") is run
    while not run.status.final:
        assert run.status is RunStatus.ENDING
        assert bench.clock.run_next()
    assert bench.drive.active == 0
    assert run.status is RunStatus.STOPPED and run.reason.startswith("enough")
    assert bench.executor.current is None


def test_a_stop_before_the_first_tick_starts_no_skill(bench):
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.executor.stop("at once")
    bench.clock.advance(5.0)
    assert run.status is RunStatus.STOPPED and not bench.drive.runs


def test_the_tree_of_a_stopped_run_shows_where_it_was(bench):
    run = bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(2.5)
    bench.executor.stop("enough")
    bench.clock.advance(1.0)
    assert "[+] drive" in run.tree and "[-] work" in run.tree


def test_a_second_trigger_is_refused_by_default(bench):
    first = bench.executor.trigger(MissionRequest("drive_once"))
    with pytest.raises(RequestRefused, match=f"drive_once is running.*{first.run_id}.*'queue' or 'preempt'"):
        bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(5.0)
    assert first.status is RunStatus.SUCCEEDED


def test_a_queued_run_starts_when_the_first_is_over(bench):
    first = bench.executor.trigger(MissionRequest("drive_once"))
    second = bench.executor.trigger(MissionRequest("drive_and_work", policy=TriggerPolicy.QUEUE))
    assert second.status is RunStatus.QUEUED
    bench.clock.advance(2.5)
    assert first.status is RunStatus.SUCCEEDED and second.status is RunStatus.RUNNING
    assert second.started == 102.0


def test_the_queue_is_served_by_priority_and_then_in_order(bench):
    bench.executor.trigger(MissionRequest("drive_once"))
    names = [("low", 0), ("lower", 0), ("high", 5)]
    runs = {
        name: bench.executor.trigger(
            MissionRequest("drive_once", policy=TriggerPolicy.QUEUE, priority=priority, caller=name)
        )
        for name, priority in names
    }
    bench.clock.advance(60.0)
    assert sorted(runs, key=lambda name: runs[name].started) == ["high", "low", "lower"]


def test_preempting_waits_until_the_old_run_has_let_go(bench):
    bench.script(Step(after=9.0, cancel_takes=0.5), Step(after=1.0))
    first = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    second = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.PREEMPT, caller="boss"))
    bench.clock.advance(0.4)
    assert first.status is RunStatus.ENDING and second.status is RunStatus.QUEUED
    assert len(bench.drive.runs) == 1
    bench.clock.advance(0.2)
    assert first.status is RunStatus.STOPPED and "preempted" in first.reason and "boss" in first.reason
    assert second.status is RunStatus.RUNNING


def test_a_lower_priority_cannot_preempt(bench):
    bench.executor.trigger(MissionRequest("drive_once", priority=3))
    with pytest.raises(RequestRefused, match="priority 3"):
        bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.PREEMPT, priority=2))


def test_stop_by_id_takes_a_queued_run_out(bench):
    bench.executor.trigger(MissionRequest("drive_once"))
    second = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE))
    assert bench.executor.stop("not needed", second.run_id) is second
    bench.clock.advance(30.0)
    assert second.status is RunStatus.STOPPED and len(bench.drive.runs) == 1
    assert bench.executor.stop("nothing runs") is None
    assert bench.executor.stop("no such run", "T-999-nothing") is None


def test_a_timeout_cancels_the_skill_and_waits_for_its_end(bench):
    bench.script_work(Step(None, cancel_takes=0.5))
    run = bench.executor.trigger(MissionRequest("work_with_limit"))
    bench.clock.advance(3.2)
    assert run.status is RunStatus.ENDING and bench.work.active == 1
    bench.clock.advance(0.5)
    assert run.status is RunStatus.FAILED and run.code == "timed_out" and bench.work.active == 0


def test_while_triggers_are_blocked_nothing_starts(bench):
    bench.executor.block("override", "the manual override is on")
    with pytest.raises(RequestRefused, match="manual override"):
        bench.executor.trigger(MissionRequest("drive_once"))


def test_stop_all_drops_the_queue_too(bench):
    first = bench.executor.trigger(MissionRequest("drive_once"))
    second = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE))
    bench.executor.stop_all("shutting down")
    bench.clock.advance(30.0)
    assert (first.status, second.status) == (RunStatus.STOPPED, RunStatus.STOPPED)


def test_a_tree_that_wakes_itself_for_ever_is_failed(bench):
    run = bench.executor.trigger(MissionRequest("drive_once"))
    bench.on_tick = lambda run: bench.executor.wake()
    bench.clock.advance(0.5)
    assert run.status is RunStatus.FAILED and run.code == "spinning" and bench.drive.active == 0


@pytest.fixture(params=[0.0, 1e-4], ids=["as tests run", "as robots run"])
def either_bench(make_bench, request):
    """An executor for which time stands still between two ticks, as in tests, or goes on, as on a robot."""
    bench = make_bench(call_soon=lambda todo: bench.clock.call_at(bench.clock.now() + request.param, todo))
    return bench


def test_a_loop_that_takes_no_time_may_have_two_thousand_rounds(either_bench):
    run = either_bench.run_text("tree: {repeat: 2000, do: {sequence: [{wait: 0 s}, {set: {x: 1}}]}}")
    assert run.status is RunStatus.SUCCEEDED


@pytest.mark.parametrize("inner", ["{set: {x: 1}}", "{wait: 0 s}", "{succeed: {fail: no}}"])
def test_an_endless_loop_that_takes_no_time_ends_and_names_the_node(either_bench, inner):
    run = either_bench.run_text(f"tree: {{sequence: [{{name: count, repeat: 1000000, do: {inner}}}]}}")
    assert (run.status, run.code) == (RunStatus.FAILED, "spinning")
    assert run.why.path.endswith("/count") and "count goes on without end" in run.reason
    assert run.ticks <= MAX_QUICK_ROUNDS + 1


def test_a_clean_up_that_takes_no_time_and_never_ends_does_not_keep_the_robot(either_bench):
    loop = "{name: count, repeat: 1000000, do: {set: {x: 1}}}"
    run = either_bench.run_text(f"tree: {{timeout: 1 s, do: {{wait: 9 s, finally: {loop}}}}}")
    assert (run.status, run.code) == (RunStatus.FAILED, "timed_out")
    assert run.ticks <= MAX_QUICK_ROUNDS + 5


def test_a_tree_that_spins_is_cleaned_up_all_the_same(either_bench):
    either_bench.script_work(Step(success(pay=7), after=2.0))
    clean_up = "{repeat: 3, do: {work: }}"
    run = either_bench.run_text(f"tree: {{repeat: 1000000, do: {{set: {{x: 1}}}}, finally: {clean_up}}}")
    assert (run.status, run.code, len(either_bench.work.runs)) == (RunStatus.FAILED, "spinning", 3)


def test_a_loop_that_takes_time_never_spins(either_bench):
    either_bench.script_work(Step(success(pay=7), after=0.001))
    run = either_bench.run_text("tree: {repeat: 2500, do: {work: }}")
    assert run.status is RunStatus.SUCCEEDED


@pytest.mark.parametrize("cancel_takes", [0.0, 0.01])
def test_the_end_of_a_cancelled_skill_starts_it_no_more(either_bench, cancel_takes):
    either_bench.script_work(Step(None, cancel_takes=cancel_takes))
    guarded = "{parallel: [{condition: $x > 1}, {work: }]}"
    choice = f"{{selector: [{guarded}, {{wait: 8 s}}], memory: false}}"
    run = either_bench.run_text(f"tree: {{sequence: [{{set: {{x: 1}}}}, {choice}]}}")
    assert run.status is RunStatus.SUCCEEDED
    assert len(either_bench.work.runs) <= 3  # when the selector begins, and at the end of its wait


def test_a_skill_that_raises_fails_the_run_and_not_the_executor(bench):
    class Broken:
        def start(self, inputs):
            raise RuntimeError("a bug")

    bench.skills["work"] = Broken()
    run = bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(5.0)
    assert run.status is RunStatus.FAILED and run.code == "internal_error" and "a bug" in run.reason
    broken = next(event for event in bench.events if event.kind is EventKind.BROKEN)
    assert "RuntimeError" in broken.data["detail"]
    bench.skills["work"] = bench.work
    again = bench.executor.trigger(MissionRequest("drive_and_work"))
    bench.clock.advance(5.0)
    assert again.status is RunStatus.SUCCEEDED
