"""Random missions: what runs with random skills reach, and what the verifier says that they can.

``python -m tests.unit.assurance.random_runs --missions 300 --runs 1000`` compares them, and fails where an
outcome is not listed.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from py_trees.common import Status

from florence_bt.assurance.explorer import Limits
from florence_bt.assurance.plan import codes_behind
from florence_bt.assurance.verifier import Verifier
from florence_bt.behaviours.ticking import Ticker
from florence_bt.behaviours.why import explain
from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import ScriptedRun, Step
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.loader import MissionLibrary
from tests.ticking import make_context
from tests.unit.trees.interpreted import SUB_FILE, TASK, Writer, file_of
from tests.unit.trees.interpreter import LONGEST

Pick = Callable[[Any], Any]
DURATIONS = (0.0, 0.25, 0.5, 1.0, 1.0, 2.0, 3.0, 1e5)
CODES = (None, None, None, "broken", "jammed", "odd", "rejected")


class RandomTask:
    """The skill ``task``, which does anything."""

    declaration = TASK

    def __init__(self, clock: ManualClock, pick: Pick) -> None:
        self._clock = clock
        self._pick = pick

    def start(self, inputs: Any) -> ScriptedRun:
        """Begin a run with a random end."""
        code = self._pick(CODES)
        result = success(n=self._pick(range(-1, 5))) if code is None else failure(code, code)
        return ScriptedRun(self._clock, Step(result, after=self._pick(DURATIONS)), dict(inputs))


def write_mission(folder: Path, seed: int) -> MissionLibrary:
    """Write a random mission."""
    writer = Writer(random.Random(seed).choice)
    (folder / "m.yaml").write_text(file_of(writer.node(writer.pick((1, 2, 2, 3)))))
    (folder / "sub.yaml").write_text(SUB_FILE)
    return MissionLibrary.load([folder], built_in=False)


def outcome_of_run(library: MissionLibrary, seed: int) -> str:
    """Run the mission once with random skills; returns its code, ``goes on`` when it does not end."""
    mission, clock = library.get("m"), ManualClock()
    context = make_context(clock, {"task": RandomTask(clock, random.Random(seed).choice)}, {"task": TASK})
    root = compile_mission(mission, library, parse_inputs(mission, {}), context).root
    ticker = Ticker(root)
    context.wake()
    while True:
        while context.wake.take():
            context.tick_beside()
            ticker.tick()
            if root.status is Status.FAILURE:
                why = explain(root)
                assert why is not None
                return why.code
            if root.status is Status.SUCCESS:
                return "ok"
        due = clock.next_time()
        if due is None or due > LONGEST:
            return "goes on"
        clock.advance_to(due)


def verified_outcomes(library: MissionLibrary, limits: Limits) -> frozenset[str] | None:
    """Return the codes with which the mission can end; None: not every way was explored."""
    explored = Verifier(library, {"task": TASK}, limits).explored("m")
    if explored.graph.unexplored:
        return None
    ends = (ending.code for ending in explored.graph.endings.values() if ending.status != "STOPPED")
    return frozenset().union(*map(codes_behind, ends))


LIMITS = Limits(seconds=60.0, steps=15_000)
"""How far a random mission is explored."""


@dataclass(frozen=True)
class Compared:
    """One random mission, of which runs were held against what the verifier says.

    Attributes:
        seed: Its number.
        foreseen: The codes with which it can end; None: not every way was explored.
        reached: The codes with which runs have ended.
    """

    seed: int
    foreseen: frozenset[str] | None
    reached: frozenset[str]

    @property
    def missed(self) -> frozenset[str]:
        """Return the codes that runs reached and the verifier did not list."""
        return frozenset() if self.foreseen is None else self.reached - self.foreseen


def compared(folder: Path, seeds: Iterable[int], runs: int) -> Iterator[Compared]:
    """Verify random missions and run each; yields what came of them.

    Args:
        folder: Where they are written.
        seeds: Their numbers.
        runs: How often each is run.
    """
    for seed in seeds:
        library = write_mission(folder, seed)
        foreseen = verified_outcomes(library, LIMITS)
        reached = {outcome_of_run(library, run) for run in range(runs if foreseen is not None else 0)}
        yield Compared(seed, foreseen, frozenset(reached - {"goes on"}))


def main(arguments: list[str] | None = None) -> int:
    """Compare, and say what was missed; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missions", type=int, default=300)
    parser.add_argument("--first", type=int, default=0, help="the seed of the first one")
    parser.add_argument("--runs", type=int, default=1000, help="of each mission")
    given = parser.parse_args(arguments)
    done: list[Compared] = []
    with tempfile.TemporaryDirectory(prefix="florence_random_missions_") as folder:
        for each in compared(Path(folder), range(given.first, given.first + given.missions), given.runs):
            done.append(each)
            if each.missed:
                print(f"mission {each.seed}: not listed: {', '.join(sorted(each.missed))}", flush=True)
            if len(done) % 10 == 0 or len(done) == given.missions:
                print(_summary(done, given.runs), flush=True)
    return int(any(each.missed for each in done))


def _summary(done: list[Compared], runs: int) -> str:
    proved = [each for each in done if each.foreseen is not None]
    outcomes = sum(len(each.reached) for each in proved)
    missed = sum(len(each.missed) for each in proved)
    left = len(done) - len(proved)
    found = f"{outcomes} outcomes, {missed} not listed"
    return f"{len(done)} missions, {left} not explored to the end; {runs} runs of each: {found}"


if __name__ == "__main__":
    sys.exit(main())
