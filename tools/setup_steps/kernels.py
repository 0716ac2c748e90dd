"""The step that compiles the hot loops once, so that no robot waits for a compiler while it drives."""

from __future__ import annotations

from pathlib import Path

from setup_steps import machine
from setup_steps.dependencies import LOCK
from setup_steps.progress import Log, Step, content_hash

PACKAGE = machine.ROOT / "florence_bt"
MARK = "njit("


def step(log: Log) -> Step:
    """Compile everything that numba compiles; the results are kept beside the sources."""
    return Step(
        "hot loops compiled",
        machine.STATE / "kernels.stamp",
        lambda: content_hash([LOCK, *_sources()]),
        lambda: log.call([machine.PYTHON, "-m", "florence_bt.app.demo.warm_up"]),
    )


def _sources() -> list[Path]:
    return sorted(file for file in PACKAGE.rglob("*.py") if MARK in file.read_text(encoding="utf-8"))
