"""The step that compiles the hot loops once, so that no robot waits for a compiler while it drives."""

from __future__ import annotations

import subprocess

from . import machine
from .progress import Log, Step

MODULE = "florence_bt.app.demo.kernel_cache"


def step(log: Log) -> Step:
    """Compile everything that numba compiles; ``florence up`` looks at the same stamp before it starts."""
    return Step(
        "hot loops compiled",
        lambda: machine.PYTHON.exists() and _is_done(),
        lambda: log.call([machine.PYTHON, "-m", MODULE]),
    )


def _is_done() -> bool:
    check = f"import sys; from {MODULE} import is_compiled; sys.exit(0 if is_compiled() else 1)"
    return subprocess.run([machine.PYTHON, "-c", check], capture_output=True, check=False).returncode == 0
