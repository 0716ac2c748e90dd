"""Runs that the context keeps: resources, pauses, and the end of each."""

import pytest
from py_trees.common import Status

from florence_bt.behaviours.run_skill import ResourceLock, RunSkill
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from tests.scripted_skill import ScriptedSkill
from tests.ticking import make_context

DRIVE = SkillDeclaration("drive", "Drive", resources=frozenset({"base"}), deadline_s=30.0)
TURN = SkillDeclaration("turn", "Turn", resources=frozenset({"base", "camera"}), deadline_s=5.0)
SAY = SkillDeclaration("say", "Say something")


@pytest.fixture
def bench(clock):
    ended = []

    def make(**steps):
        declarations = {each.name: each for each in (DRIVE, TURN, SAY)}
        skills = {
            name: ScriptedSkill(each, clock, steps.get(name, [Step(success(), after=10.0)]))
            for name, each in declarations.items()
        }
        context = make_context(
            clock,
            skills,
            declarations,
            on_skill_ended=lambda path, name, result: ended.append((name, result.code)),
        )
        return context, skills, ended

    return make


def test_what_needs_the_same_resource_waits_until_it_is_free(clock, bench):
    context, skills, _ = bench()
    drive, turn = RunSkill("drive", context, "drive"), RunSkill("turn", context, "turn")
    drive.tick_once()
    turn.tick_once()
    assert (turn.status, len(skills["turn"].runs)) == (Status.RUNNING, 0)
    assert turn.feedback_message == "waits for the base, which drive at drive has"
    drive.stop(Status.INVALID)
    assert context.wake.take()
    turn.tick_once()
    assert (turn.status, len(skills["turn"].runs)) == (Status.RUNNING, 1)
    assert context.waiting == []


def test_what_needs_nothing_for_itself_waits_for_nobody(bench):
    context, skills, _ = bench()
    for name in ("drive", "say"):
        RunSkill(name, context, name).tick_once()
    assert len(skills["say"].runs) == 1 and context.holder("say") is None


def test_a_lock_is_free_without_a_holder_and_gives_up_after_the_time_of_its_skill(clock, bench):
    context, _, _ = bench()
    lock = ResourceLock(context, "turn")
    assert lock.acquire() and lock.timed_out is None
    RunSkill("drive", context, "drive").tick_once()
    assert not lock.acquire() and lock.timed_out is None
    clock.advance(5.0)
    assert lock.timed_out == failure(
        "timed_out",
        "turn could not start within 5 s: it waits for the base, which drive at drive has",
    )
    lock.release()
    assert context.waiting == [] and not lock.acquire()


def test_a_pause_cancels_what_goes_on_and_starts_it_again_with_the_same_inputs(clock, bench):
    context, skills, ended = bench(drive=[Step(success(), after=10.0, cancel_takes=2.0)])
    node = RunSkill("drive", context, "drive")
    node.tick_once()
    context.suspend()
    assert [entry.skill for entry in context.still_ending()] == ["drive"] and context.pause.active
    clock.advance(2.0)
    assert context.still_ending() == [] and ended == [("drive", "cancelled")]
    clock.advance(100.0)  # no time of the mission: the deadline does not run
    context.resume()
    assert not context.pause.active
    node.tick_once()
    assert (node.status, len(skills["drive"].runs)) == (Status.RUNNING, 2)
    clock.advance(10.0)
    node.tick_once()
    assert (node.status, context.runs) == (Status.SUCCESS, [])


def test_a_run_that_had_ended_before_the_pause_keeps_its_result(clock, bench):
    context, skills, _ = bench(drive=[Step(success(), after=1.0)])
    node = RunSkill("drive", context, "drive")
    node.tick_once()
    clock.advance(1.0)
    context.suspend()
    assert context.still_ending() == []
    context.resume()
    node.tick_once()
    assert (node.status, len(skills["drive"].runs)) == (Status.SUCCESS, 1)


def test_a_run_that_succeeds_although_it_was_cancelled_is_forgotten(clock, bench):
    context, _, ended = bench(drive=[Step(success(), after=1.0, cancel_takes=5.0)])
    RunSkill("drive", context, "drive").tick_once()
    context.suspend()
    clock.advance(1.0)
    assert (context.runs, ended) == ([], [("drive", "ok")])


def test_the_node_of_a_suspended_run_can_be_left(clock, bench):
    context, _, ended = bench()
    node = RunSkill("drive", context, "drive")
    node.tick_once()
    context.suspend()
    node.stop(Status.INVALID)
    context.resume()
    assert (context.runs, ended) == ([], [("drive", "cancelled")])
    assert context.holder("turn") is None
