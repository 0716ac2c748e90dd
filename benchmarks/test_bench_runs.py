"""Whole runs of goto_user with mocked skills: how long they take, and that nothing grows."""

from __future__ import annotations

import gc
import time
from pathlib import Path

import pytest

from benchmarks.measure import size
from benchmarks.mocks import succeeding
from florence_bt.core.clock import ManualClock
from florence_bt.core.skill import Inputs, SkillRun
from florence_bt.mission_testing.mocks.mocks import ScriptedRun
from florence_bt.runtime.event_bus import EventLog
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal, JournalParameters
from florence_bt.runtime.missions import MissionFolders
from florence_bt.runtime.run import MissionRequest, MissionRun, RunIds, RunStatus
from florence_bt.trees.language.declarations import collect_declarations
from tests.scripted_skill import ScriptedSkill

WARM, RUNS, MORE_RUNS = size((20, 1000, 9000), (1, 2, 2))
"""Runs before anything is measured, those that are timed, and those after which nothing has grown."""
WATCHED = size((50, 200), (1, 2))
"""Runs before the gaps between skills are measured, and those in which they are."""


class Stage:
    """An executor whose skills all succeed after a second."""

    def __init__(self, log: EventLog | None = None, mock: type[ScriptedSkill] = ScriptedSkill) -> None:
        self.clock = ManualClock()
        declarations = collect_declarations()
        self.skills = {name: succeeding(each, self.clock, mock) for name, each in declarations.items()}
        self.executor = Executor(
            MissionFolders.of([], declarations),
            self.skills,
            declarations,
            self.clock,
            RunIds("B"),
            log=log,
        )

    def run(self, times: int) -> None:
        for _ in range(times):
            run = self.executor.trigger(MissionRequest("goto_user", caller="bench"))
            while not run.status.final:
                self.clock.run_next()
            assert run.status is RunStatus.SUCCEEDED
            for skill in self.skills.values():
                skill.runs.clear()


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


@pytest.mark.parametrize("journal", ["without a journal", "with a journal"])
def test_many_runs(benchmark, figures, tmp_path, journal):
    log = Journal(tmp_path) if journal == "with a journal" else None
    stage = Stage(log)
    stage.run(WARM)
    wall, cpu = benchmark.pedantic(lambda: timed(stage), rounds=1)
    figures.add(
        f"{RUNS:,} runs of goto_user with mocks, {journal}",
        f"{wall:.1f} s",
        f"{cpu:.1f} s of one core; at most 10 s",
    )
    figures.limit(cpu, most=10.0)


def timed(stage: Stage) -> tuple[float, float]:
    """Wall and processor seconds of :data:`RUNS` runs."""
    wall, cpu = time.perf_counter(), time.process_time()
    stage.run(RUNS)
    return time.perf_counter() - wall, time.process_time() - cpu


@pytest.mark.timeout(600)
def test_nothing_grows(benchmark, figures, tmp_path):
    stage = Stage(Journal(tmp_path, JournalParameters(keep_runs=100)))

    def measure() -> tuple[float, float, float, float]:
        stage.run(RUNS)
        gc.collect()
        early, file_early = resident_mb(), size_mb(tmp_path)
        stage.run(MORE_RUNS)
        gc.collect()
        return early, resident_mb(), file_early, size_mb(tmp_path)

    early, late, file_early, file_late = benchmark.pedantic(measure, rounds=1)
    figures.add(
        f"memory after {RUNS:,} and after {RUNS + MORE_RUNS:,} runs in one process",
        f"{early:.1f} MB, {late:.1f} MB",
        f"flat; the journal with 100 runs kept: {file_early:.1f} MB, {file_late:.1f} MB",
    )
    figures.limit(late - early, most=2.0)
    figures.limit(file_late / file_early, most=1.5)


def size_mb(folder: Path) -> float:
    return sum(file.stat().st_size for file in folder.iterdir() if file.is_file()) / 1e6


class Gaps:
    """Seconds from the end of a skill to the call that starts the next one, within one mission run."""

    def __init__(self) -> None:
        self.seconds: list[float] = []
        self._ended = 0.0

    def starts(self) -> None:
        """A skill is about to be started."""
        if self._ended:
            self.seconds.append(time.perf_counter() - self._ended)
        self._ended = 0.0

    def watch(self, run: SkillRun) -> None:
        """Note the end of a run, before anybody else hears of it."""
        run.on_change(lambda: self._look(run))
        self._look(run)

    def forget(self, run: MissionRun, event: RunEvent) -> None:
        """What comes after the end of a mission run is another mission run."""
        if event.kind is EventKind.ENDED:
            self._ended = 0.0

    def _look(self, run: SkillRun) -> None:
        if run.poll() is not None:
            self._ended = time.perf_counter()


class Watched(ScriptedSkill):
    """A mock that tells when it starts and when its runs end."""

    gaps: Gaps

    def start(self, inputs: Inputs) -> ScriptedRun:
        """Begin the next step."""
        self.gaps.starts()
        run = super().start(inputs)
        self.gaps.watch(run)
        return run


def test_the_journal_costs_a_tick_little(benchmark, figures, tmp_path):
    """From the end of a skill to the start of the next: telling and writing come after that."""
    log = Journal(tmp_path, background=True)
    Watched.gaps = noted = Gaps()
    stage = Stage(log, Watched)
    stage.executor.add_listener(noted.forget)
    stage.run(WATCHED[0])
    gaps = noted.seconds
    gaps.clear()
    benchmark.pedantic(lambda: stage.run(WATCHED[1]), rounds=1)
    assert len(gaps) >= WATCHED[1]
    log.close()
    gaps.sort()
    median, late = gaps[len(gaps) // 2] * 1e6, gaps[len(gaps) * 99 // 100] * 1e6
    figures.add(
        "end of a skill to the start of the next, with the journal",
        f"{median:.0f} us",
        f"99th percentile {late:.0f} us; at most 100 us",
    )
    figures.limit(median, most=100.0)
