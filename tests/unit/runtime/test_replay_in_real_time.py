"""Runs on a clock on which each look takes time, as on a real machine, are run again without a difference."""

from __future__ import annotations

import random

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal, JournalReader
from florence_bt.runtime.replay.replay import check
from florence_bt.runtime.run import MissionRequest, MissionRun, RunIds, RunStatus
from florence_bt.trees.language.loader import MissionLibrary
from tests.scripted_skill import ScriptedSkill
from tests.unit.runtime.conftest import DRIVE, WORK

MISSION = """mission: own
description: Waits and limits that depend on when a tick began.
tree:
  repeat: 4
  do:
    sequence:
      - drive:
      - wait: 1 s
      - parallel: [work: , {succeed: {timeout: 0.5 s, do: {wait: 5 s}}}]
      - wait: 0.25 s
"""


class Passing:
    """A clock whose time goes on a little, by another while, with each look at it."""

    def __init__(self, seed):
        self.base = ManualClock(100.0)
        self._passed = 0.0
        self._random = random.Random(seed)

    def now(self):
        self._passed += self._random.choice((0.0, 0.0, 0.0, 0.03))
        return self.base.now() + self._passed

    def call_at(self, when, callback):
        return self.base.call_at(when - self._passed, callback)


@pytest.mark.parametrize("seed", range(8))
def test_a_tick_that_takes_time_is_no_difference(tmp_path, seed):
    (tmp_path / "own.yaml").write_text(MISSION)
    library, clock = MissionLibrary.load([tmp_path], built_in=False), Passing(seed)
    declarations = {"drive": DRIVE, "work": WORK}
    skills = {
        "drive": ScriptedSkill(DRIVE, clock, [Step(after=0.7), Step(after=0.1)]),
        "work": ScriptedSkill(WORK, clock, [Step(success(pay=1), after=0.3)]),
    }
    log = Journal(tmp_path / "runs")
    executor = Executor(library, skills, declarations, clock, RunIds("R"), log=log)
    run = executor.trigger(MissionRequest("own"))
    clock.base.advance(1.3)
    executor.pause("a visitor")
    clock.base.advance(3.0)
    executor.resume()
    clock.base.advance(60.0)
    assert run.status is RunStatus.SUCCEEDED, run.reason
    with JournalReader(tmp_path / "runs") as reader:
        events = reader.events(run.run_id)
    again = MissionRun(run.run_id, MissionRequest("own"), {})
    assert check(again, events, library, declarations) is None
