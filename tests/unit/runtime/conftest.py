"""A mission library of three small missions and skills that follow scripts, on a manual clock."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import success
from florence_bt.core.skill import Skill
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.events import RunEvent
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import MissionRequest, MissionRun, RunIds
from florence_bt.trees.language.loader import MissionLibrary
from tests.scripted_skill import ScriptedSkill

DRIVE = SkillDeclaration(
    "drive",
    "Drive some way",
    inputs={"way": Port(Kind.LENGTH, "how far", default=1.0)},
    failures={"blocked": "something is in the way"},
    resources=frozenset({"base"}),
)
WORK = SkillDeclaration("work", "Work a while", outputs={"pay": Port(Kind.INTEGER, "what it gave")})

MISSIONS = {
    "drive_once": """
        mission: drive_once
        description: Drives once.
        inputs:
          way: {type: length, default: 1 m, min: 0 m, max: 5 m}
        tree:
          sequence:
            - drive: {way: $way}
    """,
    "drive_and_work": """
        mission: drive_and_work
        description: Drives, then works.
        outputs:
          pay: {type: integer, description: what it gave}
        tree:
          sequence:
            - drive: {way: 1 m}
            - work:
              out: {pay: pay}
    """,
    "work_with_limit": """
        mission: work_with_limit
        description: Works, but not for ever.
        tree:
          timeout: 3 s
          do:
            work:
    """,
}


class Bench:
    """An executor with everything around it."""

    def __init__(self, folder: Path, **options: Any) -> None:
        for name, text in MISSIONS.items():
            (folder / f"{name}.yaml").write_text(
                "\n".join(line[8:] for line in text.strip("\n").splitlines())
            )
        self.folder = folder
        self.clock = ManualClock(100.0)
        self.drive = ScriptedSkill(DRIVE, self.clock, [Step(after=2.0)])
        self.work = ScriptedSkill(WORK, self.clock, [Step(success(pay=7), after=1.0)])
        self.skills: dict[str, Skill] = {"drive": self.drive, "work": self.work}
        self.declarations = {"drive": DRIVE, "work": WORK}
        self.executor = Executor(
            MissionLibrary.load([folder], built_in=False),
            self.skills,
            self.declarations,
            self.clock,
            RunIds("T"),
            on_tick=lambda run: self.on_tick(run),
            **options,
        )
        self.on_tick: Callable[[MissionRun], None] = lambda run: None
        self.events: list[RunEvent] = []
        self.executor.add_listener(self._on_event)

    def script(self, *steps: Step) -> None:
        """Let drive follow other steps."""
        self.drive = self.skills["drive"] = ScriptedSkill(DRIVE, self.clock, steps)

    def script_work(self, *steps: Step) -> None:
        """Let work follow other steps."""
        self.work = self.skills["work"] = ScriptedSkill(WORK, self.clock, steps)

    def run_text(self, text: str) -> MissionRun:
        """Run a mission that is only written here, for at most ten seconds."""
        file = self.folder / "own.yaml"
        file.write_text(f"mission: own\n{text}\n")
        self.executor.library.add_file(file)
        run = self.executor.trigger(MissionRequest("own"))
        self.clock.advance(10.0)
        return run

    def _on_event(self, run: MissionRun, event: RunEvent) -> None:
        self.events.append(event)


@pytest.fixture
def make_bench(tmp_path: Path) -> Callable[..., Bench]:
    """Makes a bench, with options of the executor."""
    return partial(Bench, tmp_path)


@pytest.fixture
def bench(make_bench: Callable[..., Bench]) -> Bench:
    return make_bench()
