"""Places on this machine, and whether it can build Florence."""

from __future__ import annotations

import fcntl
import importlib.util
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from florence_bt.app.interfaces.building import C_COMPILERS, CXX_COMPILERS, compiler, has_python_headers

from .progress import StepFailed

ROOT = Path(__file__).resolve().parents[2]
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python"
STATE = VENV / "florence-setup"
"""Stamps, logs and build folders."""

PYTHONS = ((3, 11), (3, 12))


def check() -> None:
    """Refuse a machine that cannot do it, and say what is missing.

    Raises:
        StepFailed: With everything that is missing and how to get it.
    """
    problems = []
    if sys.version_info[:2] not in PYTHONS:
        found = f"{sys.version_info.major}.{sys.version_info.minor}"
        problems.append(
            f"Florence needs Python 3.11 or 3.12, and this is {found}: make setup PYTHON=python3.12"
        )
    if importlib.util.find_spec("ensurepip") is None:
        problems.append("Python's venv module is not complete: apt install python3-venv")
    if not (compiler(*C_COMPILERS) and compiler(*CXX_COMPILERS)):
        problems.append(
            "no C and C++ compiler (the ROS interfaces are compiled here): apt install build-essential; "
            "or name one: CC=... CXX=... make setup"
        )
    if not has_python_headers():
        problems.append("Python's headers are not there: apt install python3-dev")
    if os.environ.get("AMENT_PREFIX_PATH"):
        problems.append(
            "a ROS 2 installation is sourced in this shell, and .venv brings its own: use a shell without "
            "it, or build with colcon against that installation (CONTRIBUTING.md)"
        )
    if problems:
        raise StepFailed("cannot set up:\n" + "\n".join(f"  - {problem}" for problem in problems))


@contextmanager
def only_one() -> Iterator[None]:
    """Wait until no other set-up of this checkout runs, and keep others waiting meanwhile."""
    with (ROOT / "tools" / "setup.py").open() as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print("waiting for another set-up of this checkout ...", flush=True)
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
