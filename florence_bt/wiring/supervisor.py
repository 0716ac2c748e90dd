"""Starts the processes of a bring-up, watches them and ends them in order, leaving nothing behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.wiring.signals import held_back

STOP_BUDGET_S = 8.0
"""Wall seconds that a process gets to end by itself after it was asked to."""
TAIL_LINES = 15
STARTED_AGAIN = "FLORENCE_STARTED_AGAIN"
"""The variable that tells a process that it follows one that died; empty for the first one of its group."""
RESTARTS = 3
"""How often processes that died are started again within :data:`RESTARTS_PERIOD_S`."""
RESTARTS_PERIOD_S = 600.0


def command_of(group: str, options_file: Path) -> list[str]:
    """The command line of the process of a group of nodes."""
    return [sys.executable, "-m", "florence_bt.wiring.process", group, str(options_file), str(os.getpid())]


class ProcessDied(FlorenceError):
    """A process of the bring-up ended although nobody asked it to.

    Attributes:
        name: The group of nodes that ran in it.
        what: What happened, in a few words.
        log_file: Its log.
    """

    def __init__(self, name: str, code: int, log_file: Path, then: str = "") -> None:
        """Make the error.

        Args:
            name: The group of nodes that ran in it.
            code: Its exit code, negative for a signal.
            log_file: Its log.
            then: What was done about it.
        """
        self.name = name
        self.what = f"the process {name!r} {_ending(code)}"
        self.log_file = log_file
        super().__init__(
            f"{self.what}{f'; {then}' if then else ''}; the end of {log_file}:\n{_tail(log_file)}"
        )


@dataclass
class _Child:
    name: str
    process: subprocess.Popen[bytes]
    log_file: Path
    log: IO[bytes]
    mourned: str | None = None
    """What was done about its death; None before."""


class Supervisor:
    """Owns the child processes. Use as a context manager: leaving it ends them all.

    Args:
        options_file: What every child is told (``BringUp``).
        log_folder: One log file per process goes here.
        make_command: The command line of the process of a group; given the group and the options file.
        stop_budget_s: Wall seconds that a process gets to end by itself after it was asked to.
        keep_open: File descriptors that every child holds until it ends, e.g. of a lock.
        after_death: Called once with the name of each process that died or had to be killed, as soon as that
            is known; gives what was done about it, for people.
        now: Steady seconds.
    """

    def __init__(
        self,
        options_file: Path,
        log_folder: Path,
        *,
        make_command: Callable[[str, Path], Sequence[str]] = command_of,
        stop_budget_s: float = STOP_BUDGET_S,
        keep_open: Sequence[int] = (),
        after_death: Callable[[str], str] = lambda name: "",
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._options_file = options_file
        self._log_folder = log_folder
        self._make_command = make_command
        self._stop_budget_s = stop_budget_s
        self._keep_open = tuple(keep_open)
        self._after_death = after_death
        self._now = now
        self._restarts: deque[float] = deque(maxlen=RESTARTS)
        self._children: list[_Child] = []

    def __enter__(self) -> Supervisor:
        """Nothing runs yet; see :meth:`start`."""
        return self

    def __exit__(self, *details: object) -> None:
        """End every process."""
        self.stop()

    def start(self, groups: Sequence[str]) -> None:
        """Start one process per group of nodes; they find each other in any order.

        Raises:
            ConfigError: A log cannot be written. What was started is still ended by :meth:`stop`.
        """
        for group in groups:
            # A Ctrl-C between a start and its note would leave a process that nobody ends.
            with held_back():
                self._children.append(self._started(group))

    def start_again(self, group: str) -> bool:
        """Start a process that died once more, unless that happened too often of late.

        Returns:
            Whether it was started.

        Raises:
            ConfigError: Its log cannot be written.
        """
        now = self._now()
        if len(self._restarts) == RESTARTS and now - self._restarts[0] < RESTARTS_PERIOD_S:
            return False
        self._restarts.append(now)
        (index,) = (number for number, child in enumerate(self._children) if child.name == group)
        self._children[index].log.close()
        with held_back():
            self._children[index] = self._started(group, again=True)
        return True

    def _started(self, group: str, *, again: bool = False) -> _Child:
        log_file = self._log_folder / f"{group}.log"
        try:
            self._log_folder.mkdir(parents=True, exist_ok=True)
            log = log_file.open("ab")
        except OSError as error:
            raise ConfigError(
                f"the log cannot be written: {error.strerror}",
                file=log_file,
                valid=["a folder that can be written to"],
            ) from error
        process = subprocess.Popen(
            self._make_command(group, self._options_file),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            env={**os.environ, "PYTHONUNBUFFERED": "1", STARTED_AGAIN: "1" if again else ""},
            # A Ctrl-C in the terminal is ours to hand on, in the right order.
            start_new_session=True,
            pass_fds=self._keep_open,
        )
        return _Child(group, process, log_file, log)

    def check(self) -> None:
        """Raise when a process has ended.

        Raises:
            ProcessDied: Names the process, how it ended and the end of its log.
        """
        for child in self._children:
            code = child.process.poll()
            if code is not None:
                raise ProcessDied(child.name, code, child.log_file, self._mourn(child))

    def _mourn(self, child: _Child) -> str:
        if child.mourned is None:
            child.mourned = self._after_death(child.name)
        return child.mourned

    def stop(self) -> list[str]:
        """End every process, the last started first.

        Returns:
            The names of those that had to be killed.
        """
        killed = []
        while self._children:
            child = self._children[-1]
            if not _end(child.process, self._stop_budget_s):
                killed.append(child.name)
            if child.process.returncode != 0:
                self._mourn(child)
            child.log.close()
            self._children.pop()
        return killed

    def pids(self) -> dict[str, int]:
        """Process ids by group."""
        return {child.name: child.process.pid for child in self._children}


def _end(process: subprocess.Popen[bytes], budget_s: float) -> bool:
    """Ask a process to end and wait; kill it when it does not. True when it ended by itself."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        process.wait(budget_s)
        return True
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return False


def _ending(code: int) -> str:
    if code >= 0:
        return f"ended with code {code}"
    names = {number.value: number.name for number in signal.Signals}
    return f"was killed by {names.get(-code, f'signal {-code}')}"


def _tail(file: Path) -> str:
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    return "\n".join("  " + line for line in lines[-TAIL_LINES:]) or "  (empty)"
