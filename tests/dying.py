"""Ends what writes files at each of its steps, or fills its disk: a process of its own, forked for each time.

``python -m tests.dying MODULE:FUNCTION FOLDER LIMIT...`` calls the function in a copy of a folder, once for
each limit: ``step=N`` dies at the step N, ``bytes=N`` has a disk that takes N more bytes. The copies stay.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import io
import os
import shutil
import subprocess
import sys
import traceback
from collections.abc import Iterable
from pathlib import Path

import pytest

SOURCE = Path(__file__).with_suffix(".c")
DIED, ENDED, FAILED = "died", "ended", "failed"


def library(folder: Path) -> Path:
    """Build the library that is loaded before the C library; skips the test where there is no compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    built = folder / "dying.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-w", "-o", built, SOURCE, "-ldl"], check=True)
    return built


def outcomes(built: Path, function: str, folder: Path, limits: Iterable[str]) -> dict[str, tuple[str, Path]]:
    """Call a function once for each limit, each time in a copy of a folder.

    Args:
        built: As of :func:`library`.
        function: ``module:name``, called without arguments in the copy.
        folder: What is copied.
        limits: ``step=N`` or ``bytes=N``; ``step=each``: from 0 on until it lives.

    Returns:
        Limit -> how it ended, and the copy.
    """
    command = [sys.executable, "-m", "tests.dying", function, folder, *limits]
    environment = {**os.environ, "LD_PRELOAD": str(built)}
    done = subprocess.run(
        command, env=environment, check=True, capture_output=True, text=True, cwd=SOURCE.parents[1]
    )
    found = (line.split() for line in done.stdout.splitlines())
    return {limit: (how, Path(f"{folder}.{limit}")) for limit, how in found}


def _main(function: str, folder: str, *limits: str) -> None:
    module, _, name = function.partition(":")
    call = getattr(importlib.import_module(module), name)
    arm = ctypes.CDLL(None).arm
    _in_copy(call, f"{folder}.warm", lambda: None, folder)  # what is loaded on the first call
    shutil.rmtree(f"{folder}.warm")
    for limit in limits:
        kind, _, text = limit.partition("=")
        steps = range(10_000) if text == "each" else [int(text)]
        for number in steps:
            copy = f"{folder}.{kind}={number}"
            numbers = (number, -1) if kind == "step" else (-1, number)
            how = _in_copy(call, copy, lambda: arm(copy.encode(), *map(ctypes.c_long, numbers)), folder)  # noqa: B023  # called at once
            print(f"{kind}={number} {how}", flush=True)
            if how != DIED:
                break


def _in_copy(call, copy: str, begin, folder: str) -> str:
    shutil.copytree(folder, copy, symlinks=True)
    child = os.fork()
    if child == 0:
        status = 2
        try:
            os.chdir(copy)
            begin()
            with contextlib.redirect_stdout(io.StringIO()):
                status = int(bool(call()))
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(status)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return DIED
    if os.waitstatus_to_exitcode(status) == 2:
        raise SystemExit(f"{call.__name__} broke down in {copy}")
    return ENDED if os.waitstatus_to_exitcode(status) == 0 else FAILED


if __name__ == "__main__":
    _main(*sys.argv[1:])
