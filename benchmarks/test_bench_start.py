"""``florence up`` as a user types it: until it is ready, until a killed process serves again, its memory."""

from __future__ import annotations

import os
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.measure import size

START_LIMIT_S, RESTART_LIMIT_S, MEMORY_LIMIT_MB = 4.0, 1.5, 450
STARTS = size(5, 1)
RESTARTED = size(("missions", "people", "navigation", "hardware"), ("missions",))
PAUSE_S = size(2.0, 0.0)
"""Between a restart and the next kill."""
READY, UP_AGAIN = "ready after ", "is up again"


class Up:
    """A running ``florence up --sim``.

    Attributes:
        ready_s: Wall seconds from the command to its line that says so.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        begin = time.monotonic()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "florence_bt.cli", "up", "--sim", "--person", "absent", "--out", folder],
            stdout=subprocess.PIPE,
            text=True,
        )
        self.wait_for(READY)
        self.ready_s = time.monotonic() - begin

    def wait_for(self, text: str) -> None:
        """Wait until a line with a text was printed."""
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if text in line:
                return
        raise AssertionError(f"ended without {text!r}")

    def pid(self, group: str) -> int:
        """The process id of a group of nodes."""
        return int((self._folder / "up" / group).read_text())

    def processes(self) -> dict[str, int]:
        """What it consists of: every process whose parent is ``florence up``, and itself."""
        children = {}
        for entry in Path("/proc").iterdir():
            try:
                parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
                words = (entry / "cmdline").read_text().split("\0")
            except (OSError, IndexError):
                continue
            if entry.name.isdigit() and parent == self._process.pid:
                children[words[3] if words[2].endswith(".process") else "fork server"] = int(entry.name)
        return {"florence up": self._process.pid, **children}

    def end(self) -> None:
        """End it in order; a SIGINT is ignored by what a shell began in the background."""
        self._process.terminate()
        self._process.communicate()


@contextmanager
def up(folder: Path) -> Iterator[Up]:
    """Have a system for a block."""
    running = Up(folder)
    try:
        yield running
    finally:
        running.end()


def shared_memory_mb(pid: int) -> float:
    """Proportional set size of a process, MB: each page counts for every process that has it (proc(5))."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1024


def test_start(benchmark, figures, domain, tmp_path):
    taken = []

    def start() -> None:
        with up(tmp_path / str(len(taken))) as running:
            taken.append(running.ready_s)

    benchmark.pedantic(start, rounds=STARTS)
    median = statistics.median(taken)
    figures.add(
        "florence up --sim: from the command to ready",
        f"{median:.1f} s",
        f"{STARTS} starts, longest {max(taken):.1f} s; aim: under {START_LIMIT_S:g} s",
    )
    figures.limit(median, most=START_LIMIT_S)


def test_restarts(benchmark, figures, domain, tmp_path):
    taken: dict[str, float] = {}

    def restart_all(running: Up) -> None:
        for group in RESTARTED:
            begin = time.monotonic()
            os.kill(running.pid(group), signal.SIGKILL)
            running.wait_for(UP_AGAIN)
            taken[group] = time.monotonic() - begin
            time.sleep(PAUSE_S)

    with up(tmp_path) as running:
        benchmark.pedantic(restart_all, [running], rounds=1)
    figures.add(
        "a process that was killed serves again",
        f"{max(taken.values()):.1f} s",
        f"{', '.join(f'{group} {s:.2f}' for group, s in taken.items())}; aim: under {RESTART_LIMIT_S:g} s",
    )
    figures.limit(max(taken.values()), most=RESTART_LIMIT_S)


def test_memory(benchmark, figures, domain, tmp_path):
    with up(tmp_path) as running:
        time.sleep(PAUSE_S)
        held = benchmark.pedantic(
            lambda: {name: shared_memory_mb(pid) for name, pid in running.processes().items()}, rounds=1
        )
    total = sum(held.values())
    figures.add(
        "idle system: memory (PSS)",
        f"{total:.0f} MB",
        f"{', '.join(f'{name} {mb:.0f}' for name, mb in held.items())}; aim: under {MEMORY_LIMIT_MB} MB",
    )
    figures.limit(total, most=MEMORY_LIMIT_MB)
