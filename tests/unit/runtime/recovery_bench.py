"""A process that dies on its runs, on a manual clock, with a mission of everything that has a memory."""

from __future__ import annotations

import random
from datetime import UTC, datetime, timedelta

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal, JournalReader
from florence_bt.runtime.missions import MissionFolders
from florence_bt.runtime.recovery.recovery import Recovery
from florence_bt.runtime.run import MissionRequest, RunIds
from tests.scripted_skill import ScriptedSkill

DRIVE = SkillDeclaration(
    "drive",
    "Drive somewhere",
    inputs={"goal": Port(Kind.POSE, "where to")},
    outputs={"pose": Port(Kind.POSE, "where it stopped")},
    failures={"blocked": "something is in the way"},
    resources=frozenset({"base"}),
    deadline_s=30.0,
)
SPEAK = SkillDeclaration("speak", "Say something", inputs={"text": Port(Kind.TEXT, "what to say")})
LOOK = SkillDeclaration("look", "Look round", outputs={"count": Port(Kind.INTEGER, "how many people")})

ROUND_TRIP = """
mission: round_trip
description: Drives there and back, with everything on the way that has a memory.
inputs:
  there: {type: pose}
outputs:
  pose: {type: pose, description: where it stopped}
on_restart: POLICY
tree:
  sequence:
    - speak: {text: I go}
    - retry: 3
      on: [blocked]
      do:
        timeout: 20 s
        do:
          drive: {goal: $there}
          out: {pose: pose}
    - wait: 2 s
    - parallel:
        - look:
          out: {count: count}
        - succeed:
            timeout: 1.5 s
            do:
              wait: 5 s
    - selector:
        - sequence:
            - look:
              out: {count: count}
            - fail: nobody there
        - speak: {text: "$count people"}
    - run: home
      with: {from: $pose}
      out: {pose: pose}
"""
HOME = """
mission: home
description: Drives home.
inputs:
  from: {type: pose}
outputs:
  pose: {type: pose, description: where it stopped}
tree:
  repeat: 2
  do:
    drive: {goal: $from}
    out: {pose: pose}
"""


THERE = {"there": "{x: 1 m, y: 2 m, yaw: 0 deg}"}


def trip(**options):
    return MissionRequest("round_trip", options.pop("inputs", THERE), **options)


DATE = datetime(2024, 5, 1, 10, 15, tzinfo=UTC)
"""When everything in a journal was written."""


def after(seconds):
    """The date of a start this long after the last entry of the journal."""
    return lambda: DATE + timedelta(seconds=seconds)


class Late:
    """A clock whose timers ring a little late, each by another while, as on a real machine."""

    def __init__(self, base, seed):
        self._base = base
        self._random = random.Random(seed)

    def now(self):
        return self._base.now()

    def call_at(self, when, callback):
        late = self._random.uniform(0.0001, 0.0015) if when > self._base.now() else 0.0
        return self._base.call_at(when + late, callback)


class Process:
    """A process with an executor; it dies when nobody drives its clock any more."""

    def __init__(
        self,
        folder,
        *,
        start=0.0,
        name="A",
        make_safe=None,
        drive=None,
        speak=None,
        late=None,
        missing=tuple,
        overridden=lambda: None,
        **options,
    ):
        self.clock = ManualClock(start)
        scripts = {
            "drive": drive
            or [
                Step(failure("blocked", "a chair"), after=1.0),
                Step(success(pose=Pose2(1.0, 2.0, 0.0)), after=3.0),
                Step(success(pose=Pose2(0.5, 0.0, 0.0)), after=3.0),
            ],
            "speak": speak or [Step(after=0.5)],
            "look": [Step(success(count=2), after=1.0)],
        }
        self.scripts = scripts
        declarations = {d.name: d for d in (DRIVE, SPEAK, LOOK)}
        self.skills = {n: ScriptedSkill(d, self.clock, scripts[n]) for n, d in declarations.items()}
        self.troubles = []
        self.journal = Journal(folder / "runs", date=DATE.isoformat, on_trouble=self.troubles.append)
        missions = MissionFolders.of([folder], declarations, built_in=False)
        clock = self.clock if late is None else Late(self.clock, late)
        self.executor = Executor(missions, self.skills, declarations, clock, RunIds(name), log=self.journal)
        self.told = []
        options.setdefault("date", after(1.0))
        self.recovery = Recovery(
            self.executor, self.journal, declarations, self.clock, self.told.append, **options
        )
        self.recovering = (
            self.recovery.begin(missing=missing)
            if make_safe is None
            else self.recovery.begin(make_safe, missing, overridden)
        )

    def past(self, run_id):
        with JournalReader(self.journal.folder) as reader:
            return reader.run(run_id)

    def all(self):
        with JournalReader(self.journal.folder) as reader:
            return {run.run_id: run for run in reader.runs(limit=100)}


def missions(folder, policy):
    (folder / "round_trip.yaml").write_text(ROUND_TRIP.strip().replace("POLICY", policy))
    (folder / "home.yaml").write_text(HOME.strip())


def crash(folder, at=6.0, policy="abort", **request):
    """A process that dies on a round trip; gives the run's id."""
    missions(folder, policy)
    first = Process(folder)
    run = first.executor.trigger(trip(caller="test", **request))
    first.clock.advance(at)
    return run.run_id
