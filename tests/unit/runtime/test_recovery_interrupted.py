"""A mission with ``interrupted_by`` whose process dies: it goes on in the interruption, or in the node."""

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.missions import MissionFolders
from florence_bt.runtime.recovery.recovery import Recovery
from florence_bt.runtime.run import MissionRequest, RunIds, RunStatus
from tests.scripted_skill import ScriptedSkill

MISSION = """mission: m
on_restart: resume
keys:
  low: {type: boolean, default: false}
  done: {type: list of integer, default: []}
tree:
  parallel:
    - for_each: [1, 2, 3]
      as: item
      do:
        sequence:
          - work:
          - append: {done: $item}
      interrupted_by:
        if: $low
        do:
          sequence:
            - charge:
            - set: {low: false}
    - sequence:
        - wait: 1.5 s
        - set: {low: true}
"""
DECLARATIONS = {name: SkillDeclaration(name, name) for name in ("work", "charge")}


def process(folder, *, start, name):
    (folder / "m.yaml").write_text(MISSION)
    clock = ManualClock(start)
    skills = {
        "work": ScriptedSkill(DECLARATIONS["work"], clock, [Step(after=1.0)]),
        "charge": ScriptedSkill(DECLARATIONS["charge"], clock, [Step(after=2.0)]),
    }
    missions = MissionFolders.of([folder], DECLARATIONS, built_in=False)
    journal = Journal(folder / "runs")
    executor = Executor(missions, skills, DECLARATIONS, clock, RunIds(name), log=journal)
    Recovery(executor, journal, DECLARATIONS, clock, lambda text: None).begin()
    return clock, skills, executor


@pytest.mark.parametrize(
    ("dies_at", "works", "charges"),
    [
        (0.5, 4, 1),  # before the interruption
        (1.75, 2, 1),  # in it
        (3.0, 2, 1),
        (3.75, 2, 0),  # after it, in the item that begins again
        (5.0, 1, 0),
    ],
)
def test_it_goes_on_where_it_was(tmp_path, dies_at, works, charges):
    clock, _, first = process(tmp_path, start=0.0, name="A")
    run = first.trigger(MissionRequest("m"))
    clock.advance(dies_at)
    assert not run.status.final
    clock, skills, second = process(tmp_path, start=1000.0, name="B")
    clock.advance(60.0)
    assert second.last.run_id == run.run_id
    assert second.last.status is RunStatus.SUCCEEDED
    assert (len(skills["work"].runs), len(skills["charge"].runs)) == (works, charges)
