"""Records runs of shipped missions with skills that answer at random, as a robot in an unruly home would.

People stop, pause, go on and take the robot over while they run, and processes die on them.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

from florence_bt.core.clock import Clock, ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.skill import Inputs
from florence_bt.mission_testing.mocks.mocks import ScriptedRun, Step
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal
from florence_bt.runtime.missions import MissionFolders
from florence_bt.runtime.recovery.recovery import Recovery
from florence_bt.runtime.run import MissionRequest, MissionRun, RunIds
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import BUILT_IN

MISSIONS: dict[str, dict[str, str]] = {
    "goto_user": {},
    "patrol": {},
    "remind": {"text": "drink something"},
    "night_check": {},
    "follow_me": {},
}
"""Shipped missions with inputs."""
ACTS = ("pause", "resume", "stop", "override", "kill", "kill")
LONGEST_S = 400.0
"""After which a run is stopped that nobody has stopped."""


class RandomSkill:
    """A skill that takes some time, and mostly succeeds."""

    def __init__(self, declaration: SkillDeclaration, clock: Clock, chance: random.Random) -> None:
        self._declaration = declaration
        self._clock = clock
        self._chance = chance

    def start(self, inputs: Inputs) -> ScriptedRun:
        """Begin a run of which everything is random that its declaration leaves open."""
        chance = self._chance
        some = chance.choice((0.4, 2.5, round(chance.uniform(1.0, 20.0), 2)))
        after = 0.0 if self._declaration.instant else some
        step = Step(self._result(), after=after, cancel_takes=chance.choice((0.0, 0.0, 0.3)))
        return ScriptedRun(self._clock, step, dict(inputs))

    def _result(self) -> Result:
        codes = sorted(self._declaration.failures)
        if codes and self._chance.random() < 0.07:
            code = self._chance.choice(codes)
            return failure(code, self._declaration.failures[code])
        return success(**{name: self._value(port) for name, port in self._declaration.outputs.items()})

    def _value(self, port: Port) -> Any:
        chance, kind = self._chance, port.kind
        if port.choices:
            return chance.choice(sorted(port.choices))
        if kind.item is not None:
            return tuple(self._value(Port(kind.item, "")) for _ in range(chance.randrange(4)))
        match kind:
            case Kind.TEXT:
                return chance.choice(("yes", "no", "kitchen", "hall"))
            case Kind.BOOLEAN:
                return chance.random() < 0.5
            case Kind.INTEGER:
                return chance.randrange(5)
            case Kind.POSE:
                return Pose2(*(round(chance.uniform(-3, 3), 3) for _ in range(3)))
        return round(chance.uniform(0.0, 1.0), 3)


class WakingRandomSkill(RandomSkill):
    """One that reports changes."""

    def watch(self, inputs: Inputs, callback: Callable[[], None]) -> Callable[[], None]:
        """Call back once, some time later."""
        timer = self._clock.call_at(self._clock.now() + round(self._chance.uniform(1.0, 20.0), 2), callback)
        return timer.cancel


def random_skill(declaration: SkillDeclaration, clock: Clock, chance: random.Random) -> RandomSkill:
    """Make a skill that answers at random, and reports changes if it declares that."""
    kind = WakingRandomSkill if declaration.reports_changes else RandomSkill
    return kind(declaration, clock, chance)


class Robot:
    """A process that runs missions; it dies when nobody drives its clock any more."""

    def __init__(self, missions: Path, runs: Path, seed: int, start: float = 0.0) -> None:
        self.clock = ManualClock(start)
        chance = random.Random(seed)
        declarations = collect_declarations()
        skills = {name: random_skill(each, self.clock, chance) for name, each in declarations.items()}
        journal = Journal(runs)
        library = MissionFolders.of([missions], declarations)
        self.executor = Executor(library, skills, declarations, self.clock, RunIds(f"S{seed}"), log=journal)
        Recovery(self.executor, journal, declarations, self.clock).begin()


def resumable_missions(folder: Path) -> None:
    """Write the missions into a folder, so that their runs go on after a crash."""
    folder.mkdir(exist_ok=True)
    for name in MISSIONS:
        lines = (BUILT_IN / f"{name}.yaml").read_text().splitlines()
        kept = [line for line in lines if not line.startswith("on_restart:")]
        (folder / f"{name}.yaml").write_text("\n".join([kept[0], "on_restart: resume", *kept[1:]]) + "\n")


def record_run(missions: Path, runs: Path, mission: str, seed: int) -> tuple[MissionRun, set[str]]:
    """Record a run of a mission.

    Returns:
        The run, and what people did and what happened meanwhile.
    """
    chance = random.Random(seed)
    robot, did = Robot(missions, runs, seed), set()
    run = robot.executor.trigger(MissionRequest(mission, MISSIONS[mission], "test"))
    acts = [chance.choice(ACTS) for _ in range(chance.choice((0, 1, 1, 2, 4)))]
    for number, act in enumerate(acts):
        robot.clock.advance(round(chance.uniform(0.0, 6.0), 1))
        if robot.executor.current is None:
            break
        if act == "kill":
            robot = Robot(missions, runs, seed + 100_000 * (number + 1), robot.clock.now() + 5000.0)
        elif not _act(robot.executor, act):
            continue
        did.add(act)
    run = robot.executor.current or robot.executor.last or run
    _to_the_end(robot, run)
    return run, did


def _act(executor: Executor, act: str) -> bool:
    """Do what a person does; whether it could be done."""
    try:
        getattr(executor, act)(*(() if act == "resume" else ("a visitor",)))
    except FlorenceError:
        return False
    return True


def _to_the_end(robot: Robot, run: MissionRun) -> None:
    end = robot.clock.now() + LONGEST_S
    while not run.status.final:
        _act(robot.executor, "resume")
        robot.clock.advance(10.0)
        if robot.clock.now() > end:
            robot.executor.stop("long enough")
