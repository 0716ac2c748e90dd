"""Random missions whose process dies at a random moment: each is taken up where it stood."""

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
from florence_bt.runtime.run import MissionRequest, RunIds
from tests.scripted_skill import ScriptedSkill
from tests.sweeps import sweep
from tests.unit.behaviours.ticking.random_missions import DECLARATIONS, SUB, Author

BESIDE = (20, 38, 156, 167, 337, 393, 399, 484, 604, 673, 713, 854)
"""Runs that die while a clean-up goes on beside the tree."""
STOPPING = (1, 43, 102, 131, 138, 450, 572, 577, 608, 700)
"""Runs that die while a skill that was cancelled has not ended."""


def process(folder, seed, *, start, name, declarations=DECLARATIONS):
    """A process with scripted skills; the same seed gives the same scripts."""
    chance = random.Random(seed + 1)
    clock, skills = ManualClock(start), {}
    for skill, declaration in declarations.items():
        outputs = {"n": chance.randrange(4)} if skill == "count" else {}
        results = [
            success(**outputs),
            success(**outputs),
            failure("broken", f"it broke {chance.random():.1f}"),
        ]
        steps = [
            Step(
                chance.choice(results),
                after=chance.choice((0.0, 0.3, 0.7, 1.1, 2.3, 9.0)),
                cancel_takes=chance.choice((0.0, 0.0, 0.35, 1.6)),
            )
            for _ in range(chance.randint(1, 6))
        ]
        skills[skill] = ScriptedSkill(declaration, clock, steps)
    journal, told = Journal(folder / "runs"), []
    missions = MissionFolders.of([folder], declarations, built_in=False)
    executor = Executor(missions, skills, declarations, clock, RunIds(name), log=journal)
    Recovery(executor, journal, declarations, clock, told.append).begin()
    return clock, executor, told


def die_and_take_up(folder, seed, text):
    """Let a run die at a random moment and take it up; whether it was still running then."""
    folder.mkdir(exist_ok=True)
    (folder / "sub.yaml").write_text(SUB)
    (folder / "m.yaml").write_text(text.replace("mission: m\n", "mission: m\non_restart: resume\n"))
    clock, executor, _ = process(folder, seed, start=0.0, name="A")
    run = executor.trigger(MissionRequest("m"))
    clock.advance(random.Random(seed).uniform(0.01, 4.0))
    if run.status.final:
        return False
    _, executor, told = process(folder, seed, start=5000.0, name="B")
    assert "aborted" not in " ".join(told), (seed, told)
    assert (executor.current or executor.last).run_id == run.run_id
    return True


@pytest.mark.parametrize("seed", BESIDE + STOPPING)
def test_a_random_run_is_taken_up(tmp_path, seed):
    assert die_and_take_up(tmp_path, seed, Author(seed).file()), "it would show nothing"


@pytest.mark.parametrize("asks", [False, True])
@pytest.mark.parametrize("first", sweep(range(0, 120, 30), every=4))
def test_a_random_run_that_deals_with_failures_is_taken_up(tmp_path, asks, first):
    taken = sum(
        die_and_take_up(tmp_path / str(seed), seed, Author(seed, asks=asks, catches=True).file())
        for seed in range(first, first + 30)
    )
    assert taken > 3
