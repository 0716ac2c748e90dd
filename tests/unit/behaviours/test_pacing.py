import pytest
from py_trees.behaviours import Success as Succeed
from py_trees.common import Status
from py_trees.composites import Sequence

from florence_bt.behaviours.keys import KeyReference
from florence_bt.behaviours.leaves import Fail
from florence_bt.behaviours.looping import Repeat, Retry
from florence_bt.behaviours.pacing import Timeout, Wait
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.why import explain
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from tests.scripted_skill import ScriptedSkill
from tests.ticking import drain, make_context, tick_until

LOOK = SkillDeclaration(
    "look", "Look", failures={"nobody": "nobody is there", "broken": "the camera is broken"}
)
NOBODY = Step(failure("nobody", "nobody there"), after=1.0)


def looking(clock, *steps):
    skill = ScriptedSkill(LOOK, clock, steps)
    context = make_context(clock, {"look": skill}, {"look": LOOK})
    return RunSkill("look", context, "look"), skill, context


def test_wait_ends_at_its_moment(clock):
    # 0: RUNNING; 1.5: SUCCESS
    context = make_context(clock)
    node = Wait("wait", context, 1.5)
    assert tick_until(node, clock, context) == 2
    assert (node.status, clock.now()) == (Status.SUCCESS, 1.5)


def test_wait_forgets_its_timer_when_stopped(clock):
    context = make_context(clock)
    node = Wait("wait", context, 1.5)
    node.tick_once()
    node.stop(Status.INVALID)
    assert clock.next_time() is None


@pytest.mark.parametrize("duration", [-1.0, float("nan"), float("inf"), "long", True])
def test_a_bad_duration_is_a_failure(clock, duration):
    context = make_context(clock)
    for node in (Wait("wait", context, duration), Timeout("limit", Succeed("s"), context, duration)):
        node.tick_once()
        assert (node.status, node.result.code) == (Status.FAILURE, "bad_input")


def test_a_missing_duration_does_not_start_the_child(clock):
    node, skill, context = looking(clock, NOBODY)
    limit = Timeout("limit", node, context, KeyReference("limit"))
    limit.tick_once()
    assert (limit.status, explain(limit).code, skill.runs) == (Status.FAILURE, "missing_key", [])


def test_timeout_stops_its_child_and_says_where_it_was(clock):
    # 0: RUNNING; 2: FAILURE, the run is cancelled
    node, skill, context = looking(clock, Step(None, feedback_at=((0.0, "no one yet"),)))
    limit = Timeout("limit", Sequence("search", True, [node]), context, 2.0)
    assert tick_until(limit, clock, context) == 2
    assert (limit.status, clock.now(), skill.active) == (Status.FAILURE, 2.0, 0)
    why = explain(limit)
    assert (why.path, why.code) == ("limit", "timed_out")
    assert why.reason == "search was not done within 2 s (it was at look: no one yet)"


def test_a_child_that_is_done_in_time_keeps_its_status_and_the_timer_is_forgotten(clock):
    node, _, context = looking(clock, NOBODY)
    limit = Timeout("limit", node, context, 2.0)
    tick_until(limit, clock, context)
    assert (limit.status, explain(limit).code, clock.next_time()) == (Status.FAILURE, "nobody", None)


def test_a_child_that_is_done_when_the_time_is_over_counts(clock):
    # Both happen before the next tick: what was achieved is not thrown away.
    node, _, context = looking(clock, Step(success(), after=2.0))
    limit = Timeout("limit", node, context, 2.0)
    limit.tick_once()
    clock.advance(2.0)
    limit.tick_once()
    assert (limit.status, clock.now()) == (Status.SUCCESS, 2.0)


def test_retry_until_success(clock):
    # attempts at 0 and 1 fail, the one at 2 succeeds at 3: ticks 0, 1, 1, 2, 2, 3
    node, skill, context = looking(clock, NOBODY, NOBODY, Step(success(), after=1.0))
    retry = Retry("retry", node, context, 8, attempt_key="attempt")
    assert tick_until(retry, clock, context, lambda: len(skill.runs) == 3) == 5
    assert retry.feedback_message == "attempt 3 of 8; the last one failed: nobody there"
    clock.advance(1.0)
    retry.tick_once()
    assert (retry.status, len(skill.runs), context.keys.read("attempt")) == (Status.SUCCESS, 3, 3)
    assert retry.feedback_message == "attempt 3 of 8 succeeded"


def test_retry_used_up(clock):
    node, skill, context = looking(clock, NOBODY)
    retry = Retry("retry", node, context, 3)
    tick_until(retry, clock, context)
    assert (retry.status, len(skill.runs)) == (Status.FAILURE, 3)
    why = explain(retry)
    assert (why.path, why.code) == ("retry/look", "nobody")
    assert why.reason == "3 of 3 attempts failed; last: nobody there"


def test_retry_gives_up_on_other_codes(clock):
    broken = Step(failure("broken", "no picture"))
    node, skill, context = looking(clock, NOBODY, broken)
    retry = Retry("retry", node, context, 8, on=["nobody"])
    tick_until(retry, clock, context)
    assert (retry.status, len(skill.runs), explain(retry).reason) == (Status.FAILURE, 2, "no picture")


def test_retry_begins_anew_in_a_new_round(clock):
    node, skill, context = looking(clock, NOBODY)
    retry = Retry("retry", node, context, 2, attempt_key="n")
    tick_until(retry, clock, context)
    tick_until(retry, clock, context)
    assert (len(skill.runs), context.keys.read("n")) == (4, 2)


@pytest.mark.parametrize("attempts", [0, -1, 2.0, True, "3"])
def test_a_bad_number_of_attempts_starts_nothing(clock, attempts):
    node, skill, context = looking(clock, NOBODY)
    retry = Retry("retry", node, context, attempts)
    retry.tick_once()
    assert (retry.status, explain(retry).code, skill.runs) == (Status.FAILURE, "bad_input", [])


def test_stopping_a_retry_leaves_no_run(clock):
    node, skill, context = looking(clock, NOBODY, Step(None, cancel_takes=1.0))
    retry = Retry("retry", node, context, 3)
    tick_until(retry, clock, context, lambda: len(skill.runs) == 2)
    retry.stop(Status.INVALID)
    drain(clock, context)
    assert skill.active == 0


def test_repeat(clock):
    node, skill, context = looking(clock, Step(success(), after=1.0))
    repeat = Repeat("repeat", node, context, 3)
    tick_until(repeat, clock, context)
    assert (repeat.status, len(skill.runs), clock.now()) == (Status.SUCCESS, 3, 3.0)


def test_repeat_ends_at_the_first_failure(clock):
    node, skill, context = looking(clock, Step(success(), after=1.0), NOBODY)
    repeat = Repeat("repeat", node, context, 3)
    tick_until(repeat, clock, context)
    assert (repeat.status, len(skill.runs), explain(repeat).code) == (Status.FAILURE, 2, "nobody")


def test_a_timer_that_fires_early_is_not_lost(clock):
    class EarlyClock:
        """As a ROS timer may: a hair before its moment."""

        now = clock.now

        def call_at(self, when, callback):
            return clock.call_at(when - 1e-9, callback)

    context = make_context(EarlyClock())
    node = Wait("wait", context, 1.0)
    node.tick_once()
    assert clock.run_next()
    node.tick_once()
    assert node.status is Status.SUCCESS


def test_fail_inside_retry_wakes_for_each_attempt(clock):
    context = make_context(clock)
    retry = Retry("retry", Fail("fail", context, "no"), context, 5)
    assert tick_until(retry, clock, context) == 5
