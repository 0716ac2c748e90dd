"""Starts the processes of a bring-up, watches them and ends them in order, leaving nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from florence_bt.core.errors import FlorenceError

STOP_BUDGET_S = 8.0
"""Wall seconds that a process gets to end by itself after it was asked to."""
TAIL_LINES = 15


class ProcessDied(FlorenceError):
    """A process of the bring-up ended although nobody asked it to."""


@dataclass
class _Child:
    name: str
    process: subprocess.Popen[bytes]
    log_file: Path
    log: IO[bytes]


class Supervisor:
    """Owns the child processes. Use as a context manager: leaving it ends them all.

    Args:
        options_file: What every child is told (``BringUp``).
        log_folder: One log file per process goes here.
    """

    def __init__(self, options_file: Path, log_folder: Path) -> None:
        self._options_file = options_file
        self._log_folder = log_folder
        self._children: list[_Child] = []

    def __enter__(self) -> Supervisor:
        """Nothing runs yet; see :meth:`start`."""
        return self

    def __exit__(self, *details: object) -> None:
        """End every process."""
        self.stop()

    def start(self, groups: Sequence[str]) -> None:
        """Start one process per group of nodes; they find each other in any order."""
        self._log_folder.mkdir(parents=True, exist_ok=True)
        for group in groups:
            log_file = self._log_folder / f"{group}.log"
            log = log_file.open("ab")
            process = subprocess.Popen(
                [sys.executable, "-m", "florence_bt.wiring.process", group, str(self._options_file)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
                # A Ctrl-C in the terminal is ours to hand on, in the right order.
                start_new_session=True,
            )
            self._children.append(_Child(group, process, log_file, log))

    def check(self) -> None:
        """Raise when a process has ended.

        Raises:
            ProcessDied: Names the process, its exit code and the end of its log.
        """
        for child in self._children:
            code = child.process.poll()
            if code is not None:
                raise ProcessDied(
                    f"the process {child.name!r} ended with code {code}; the end of {child.log_file}:\n"
                    + _tail(child.log_file)
                )

    def stop(self) -> list[str]:
        """End every process, the last started first.

        Returns:
            The names of those that had to be killed.
        """
        killed = []
        while self._children:
            child = self._children.pop()
            if not _end(child.process):
                killed.append(child.name)
            child.log.close()
        return killed

    def pids(self) -> dict[str, int]:
        """Process ids by group."""
        return {child.name: child.process.pid for child in self._children}


def _end(process: subprocess.Popen[bytes]) -> bool:
    """Ask a process to end and wait; kill it when it does not. True when it ended by itself."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        process.wait(STOP_BUDGET_S)
        return True
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return False


def _tail(file: Path) -> str:
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    return "\n".join("  " + line for line in lines[-TAIL_LINES:]) or "  (empty)"
