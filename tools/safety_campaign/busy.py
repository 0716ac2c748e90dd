"""Does goto_user over the ROS stack still work while other programs want the processor?

Each run is a ``florence demo`` of its own (its own seed, so its own room, person and noise) beside two busy
loops for each core. It is bounded in time: a run that takes longer than its limit is ended and has failed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

LOOPS_PER_CORE = 2
SPEED = 2.0
"""Simulated seconds per wall second aimed at; under load it is less."""
RUN_LIMIT_S = 420.0
"""Wall seconds for a run with its bring-up."""
END_LIMIT_S = 30.0
"""Wall seconds for a run that took too long to end its processes."""
LOOP = "import sys, time\nend = time.monotonic() + float(sys.argv[1])\nwhile time.monotonic() < end: pass"


@dataclass(frozen=True, slots=True)
class BusyRun:
    """One goto_user beside the load.

    Attributes:
        seed: The run's seed.
        succeeded: Whether the mission succeeded.
        reason: Why not; empty after success.
        wall_s: Wall seconds, bring-up and teardown included.
        folder: Logs and journal of the run.
    """

    seed: int
    succeeded: bool
    reason: str
    wall_s: float
    folder: Path


@dataclass(frozen=True, slots=True)
class BusyReport:
    """All runs of :func:`goto_user_beside_load`."""

    runs: tuple[BusyRun, ...]
    loops: int

    @property
    def succeeded(self) -> int:
        """Count the runs that succeeded."""
        return sum(run.succeeded for run in self.runs)

    def text(self) -> str:
        """Write the total for people."""
        return f"{self.succeeded} of {len(self.runs)} goto_user runs beside {self.loops} busy loops succeeded"


def goto_user_beside_load(
    count: int, seed: int, *, loops: int | None = None, folder: Path | None = None
) -> BusyReport:
    """Run goto_user again and again beside busy loops; takes ``count * RUN_LIMIT_S`` at most.

    Args:
        count: How many runs.
        seed: The seed of the first run; each run has the next one.
        loops: How many busy loops; two for each core when not given.
        folder: Where the runs leave their folders; a temporary one when not given.
    """
    loops = LOOPS_PER_CORE * (os.cpu_count() or 1) if loops is None else loops
    folder = folder or Path(tempfile.mkdtemp(prefix="florence-busy-"))
    runs = []
    for number in range(seed, seed + count):
        with busy_loops(loops, RUN_LIMIT_S + END_LIMIT_S):
            runs.append(run_demo(number, folder / str(number)))
        outcome = "succeeded" if runs[-1].succeeded else f"failed: {runs[-1].reason}"
        print(f"seed {number}: {outcome}, {runs[-1].wall_s:.0f} s ({runs[-1].folder})", flush=True)
    return BusyReport(tuple(runs), loops)


@contextmanager
def busy_loops(count: int, limit_s: float) -> Iterator[None]:
    """Keep the processor busy while the block runs; the loops end by themselves after the limit."""
    loops = [subprocess.Popen([sys.executable, "-S", "-c", LOOP, str(limit_s)]) for _ in range(count)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


def run_demo(seed: int, folder: Path) -> BusyRun:
    """Run one ``florence demo``; its output is in ``demo.txt`` of the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    with (folder / "demo.txt").open("w") as output:
        demo = subprocess.Popen(
            demo_command(seed, folder / "demo"),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
        try:
            demo.wait(RUN_LIMIT_S)
            reason = ""
        except subprocess.TimeoutExpired:
            reason = f"not over after {RUN_LIMIT_S:.0f} s"
        finally:
            _end(demo)
    wall_s = time.monotonic() - began
    if not reason and demo.returncode != 0:
        reason = _reason(folder)
    return BusyRun(seed, not reason, reason, wall_s, folder)


def demo_command(seed: int, out: Path) -> list[str]:
    """Return the command line of a run."""
    options = {"--seed": seed, "--speed": SPEED, "--out": out}
    given = [str(part) for option in options.items() for part in option]
    return [sys.executable, "-m", "florence_bt.cli", "demo", "--headless", *given]


def _end(demo: subprocess.Popen[bytes]) -> None:
    """End a demo, if it has not ended by itself."""
    demo.terminate()
    try:
        demo.wait(END_LIMIT_S)
    except subprocess.TimeoutExpired:
        demo.kill()  # its processes go with it
        demo.wait()


def _reason(folder: Path) -> str:
    """Tell why a demo failed: the reason of its mission, or the last line of its output."""
    for file in folder.glob("demo/runs/*/result.json"):
        result = json.loads(file.read_text())
        if result.get("reason"):
            return f"{result.get('code', '')}: {result['reason']}"
    lines = (folder / "demo.txt").read_text().strip().splitlines()
    return lines[-1] if lines else "no output"
