"""Runs with watched skills whose process dies: the journal tells when each was asked again."""

from __future__ import annotations

import random

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.missions import MissionFolders
from florence_bt.runtime.recovery.recovery import Recovery
from florence_bt.runtime.run import MissionRequest, RunIds, RunStatus
from tests.scripted_skill import ScriptedSkill
from tests.unit.behaviours.ticking.random_missions import DECLARATIONS, SUB, Author
from tests.unit.runtime.recovery_bench import Late
from tests.unit.runtime.test_recovery_random import process

SEEDS = (62, 96, 116, 118, 140, 150, 163, 168, 217, 292, 327)
"""Runs that have asked at least twice when they die."""
GUARDED = """mission: m
on_restart: resume
tree:
  sequence:
    - ask:
    - work:
  memory: false
"""


def guarded(folder, *, start, name, late=None, answers):
    """A process that works for 100 s under a condition; its skills, the executor and what it told."""
    (folder / "m.yaml").write_text(GUARDED)
    clock = ManualClock(start)
    skills = {
        "ask": ScriptedSkill(DECLARATIONS["ask"], clock, answers),
        "work": ScriptedSkill(DECLARATIONS["other"], clock, [Step(after=100.0)]),
    }
    declarations = {"ask": DECLARATIONS["ask"], "work": DECLARATIONS["other"]}
    missions = MissionFolders.of([folder], declarations, built_in=False)
    told = []
    journal = Journal(folder / "runs")
    timers = clock if late is None else Late(clock, late)
    executor = Executor(missions, skills, declarations, timers, RunIds(name), log=journal)
    Recovery(executor, journal, declarations, clock, told.append).begin()
    return clock, skills, executor, told


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("slow", [0.0, 0.13])
def test_a_watched_run_is_taken_up_and_watched_on(tmp_path, seed, slow):
    clock, skills, first, _ = guarded(
        tmp_path, start=0.0, name="A", late=seed, answers=[Step(success(), after=slow)]
    )
    run = first.trigger(MissionRequest("m"))
    clock.advance(20.0 + seed * 0.11)
    assert len(skills["ask"].runs) > 15
    answers = [Step(), Step(), Step(), Step(failure("broken", "the battery is low"))]
    clock, skills, second, told = guarded(tmp_path, start=900.0, name="B", answers=answers)
    assert second.current is not None and second.current.run_id == run.run_id, told
    clock.advance(10.0)
    # Asked at once, because nobody knows what has changed meanwhile, then every second.
    assert len(skills["ask"].runs) == 4 and clock.now() == 910.0
    assert second.last.status is RunStatus.FAILED and second.last.reason == "the battery is low"
    assert clock.next_time() is None


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_run_with_watched_skills_is_taken_up(tmp_path, seed):
    (tmp_path / "sub.yaml").write_text(SUB)
    text = Author(seed, asks=True).file()
    (tmp_path / "m.yaml").write_text(text.replace("mission: m\n", "mission: m\non_restart: resume\n"))
    clock, executor, _ = process(tmp_path, seed, start=0.0, name="A")
    run = executor.trigger(MissionRequest("m"))
    clock.advance(random.Random(seed).uniform(0.01, 4.0))
    assert not run.status.final, "it would show nothing"
    _, executor, told = process(tmp_path, seed, start=5000.0, name="B")
    assert "aborted" not in " ".join(told), told
    assert (executor.current or executor.last).run_id == run.run_id


@pytest.mark.parametrize("slow", [0.0, 0.13, 2.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_run_that_went_on_after_a_pause_is_taken_up(tmp_path, seed, slow):
    """After the pause the question comes first, and the work when it is answered."""
    clock, skills, first, _ = guarded(
        tmp_path, start=0.0, name="A", late=seed, answers=[Step(success(), after=slow)]
    )
    run = first.trigger(MissionRequest("m"))
    clock.advance(5.3 + seed * 0.21)
    for later in (0.05, 1.0, 4.0):
        first.pause("a visitor")
        clock.advance(3.0)
        first.resume()
        clock.advance(later)
    clock, skills, second, told = guarded(tmp_path, start=900.0, name="B", answers=[Step()])
    assert second.current is not None and second.current.run_id == run.run_id, told
    clock.advance(10.0)
    assert second.current.status is RunStatus.RUNNING and len(skills["work"].runs) == 1


def test_a_run_that_died_before_its_condition_had_answered_after_a_pause_is_taken_up(tmp_path):
    answers = [Step()] * 6 + [Step(success(), after=5.0)]
    clock, skills, first, _ = guarded(tmp_path, start=0.0, name="A", answers=answers)
    first.trigger(MissionRequest("m"))
    clock.advance(5.3)
    first.pause("a visitor")
    first.resume()
    clock.advance(1.0)
    assert len(skills["work"].runs) == 1, "it is not known whether it may go on"
    clock, skills, second, told = guarded(
        tmp_path, start=900.0, name="B", answers=[Step(failure("broken", "the battery is low"))]
    )
    assert second.current is not None, told
    clock.advance(1.0)
    assert second.last.reason == "the battery is low" and not skills["work"].runs
