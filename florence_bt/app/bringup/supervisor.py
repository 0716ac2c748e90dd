"""Starts the processes of a bring-up, watches them and ends them in order, leaving nothing behind."""

from __future__ import annotations

import os
import signal
import time
from collections import deque
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Protocol

from florence_bt.app.bringup.heartbeat import FD_VARIABLE, KILLED_AFTER_S, STACK_SIGNAL, HeartbeatMonitor
from florence_bt.app.bringup.signals import held_back
from florence_bt.core.errors import ConfigError, FlorenceError

END_BUDGET_S = 8.0
"""Wall seconds that a process gets to end by itself after it was asked to, as long as it beats."""
END_LOOK_S = 0.02
"""Wall seconds between two looks whether a process has ended."""
TAIL_LINES = 15
"""Lines of a process's log that are shown when it has ended. Chosen."""
STARTED_AGAIN = "FLORENCE_STARTED_AGAIN"
"""Environment variable: set for a process that replaces one that died, empty for the first of its group."""
PAUSES_S = (0.0, 5.0, 20.0)
"""Pauses before a process that died is started again, for the first time, the second and the third within
:data:`RESTARTS_PERIOD_S`; after that it is not."""
RESTARTS_PERIOD_S = 600.0
"""Seconds in which a process is started again no more often than there are pauses. Chosen."""


class Process(Protocol):
    """A child process, as far as the supervisor needs it: a part of :class:`subprocess.Popen`."""

    pid: int

    @property
    def returncode(self) -> int | None:
        """The exit code; None while the process was not seen to have ended."""

    def poll(self) -> int | None:
        """Look whether it has ended; gives its exit code, None while it runs."""

    def terminate(self) -> None:
        """Send it SIGTERM."""

    def kill(self) -> None:
        """Send it SIGKILL."""


class Start(Protocol):
    """Starts the process of a group of nodes, in a session of its own (``ForkServer.fork``)."""

    def __call__(
        self,
        group: str,
        options_file: Path,
        *,
        output: int,
        variables: Mapping[str, str],
        keep_open: Mapping[str, int],
        hold: Sequence[int],
    ) -> Process:
        """Start it."""


class ProcessDied(FlorenceError):
    """A process of the bring-up ended without being asked to.

    Attributes:
        name: The group of nodes that ran in it.
        what: What happened, in a few words.
        log_file: Its log.
    """

    def __init__(self, name: str, how: str, log_file: Path, then: str = "", begun: int = 0) -> None:
        """Make the error.

        Args:
            name: The group of nodes that ran in it.
            how: How it ended, e.g. ``ended with code 7``.
            log_file: Its log.
            then: What was done about it.
            begun: The byte of its log at which it began.
        """
        self.name = name
        self.what = f"the process {name!r} {how}"
        self.log_file = log_file
        super().__init__(
            f"{self.what}{f'; {then}' if then else ''}; the end of {log_file}:\n{_tail(log_file, begun)}"
        )


@dataclass
class _Child:
    name: str
    process: Process
    log_file: Path
    log: IO[bytes]
    log_begun: int
    """The place in the log where this process begins: the text before is of an earlier one."""
    heart: HeartbeatMonitor
    killed_because: str = ""
    """The reason why it was killed; empty when it was not."""
    reaped: str | None = None
    """The measures that were taken after its end; None before."""
    due: float | None = None
    """Time of its next start, in steady seconds; None while it runs, or is not started again."""
    is_given_up: bool = False
    """It stays as it is, and nobody minds."""

    def close(self) -> None:
        self.log.close()
        self.heart.close()

    def how_it_ended(self) -> str:
        code = self.process.returncode
        return self.killed_because or ("runs" if code is None else _ending(code))


class Supervisor:
    """Owns the child processes. Use as a context manager: leaving it ends them all.

    Args:
        options_file: The options of every child (``BringUp``).
        log_folder: One log file per process goes here.
        start_process: Starts the process of a group.
        stop_budget_s: Wall seconds that a process gets to end by itself after it was asked to.
        ended_together: Processes that are ended side by side where they were started one after the other.
        keep_open: File descriptors that every child holds until it ends, e.g. of a lock.
        after_death: Called once with the name of each process that died or had to be killed, as soon as that
            is known; gives what was done about it, for people.
        now: Steady seconds.
    """

    def __init__(
        self,
        options_file: Path,
        log_folder: Path,
        start_process: Start,
        *,
        stop_budget_s: float = END_BUDGET_S,
        ended_together: Collection[str] = (),
        keep_open: Sequence[int] = (),
        after_death: Callable[[str], str] = lambda name: "",
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._options_file = options_file
        self._log_folder = log_folder
        self._start_process = start_process
        self._stop_budget_s = stop_budget_s
        self._ended_together = ended_together
        self._keep_open = tuple(keep_open)
        self._after_death = after_death
        self._now = now
        self._deaths: dict[str, deque[float]] = {}
        self._children: list[_Child] = []

    def __enter__(self) -> Supervisor:
        """Do nothing yet; see :meth:`start`."""
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
            # A Ctrl-C between a start and its note would leave a process behind.
            with held_back():
                self._children.append(self._started(group))

    def start_again(self, name: str) -> float | None:
        """Plan the start of a process that died, after a pause, unless it has died too often of late.

        :meth:`check` starts it.

        Returns:
            The pause in seconds; None when it is not started again.
        """
        now = self._now()
        deaths = self._deaths.setdefault(name, deque(maxlen=len(PAUSES_S)))
        while deaths and now - deaths[0] >= RESTARTS_PERIOD_S:
            deaths.popleft()
        if len(deaths) == len(PAUSES_S):
            return None
        pause = PAUSES_S[len(deaths)]
        deaths.append(now)
        self._child(name).due = now + pause
        return pause

    def start_along(self, companions: Sequence[str], name: str) -> None:
        """End processes and start them again when one does that died; it does not count for them.

        Args:
            companions: The processes to end.
            name: The one that died.
        """
        self._end([self._child(each) for each in companions])
        for each in companions:
            self._child(each).due = self._child(name).due

    def give_up(self, name: str) -> None:
        """Leave a process that died as it is: :meth:`check` does not mind it any more."""
        self._child(name).is_given_up = True

    def given_up(self) -> set[str]:
        """Return the processes that have been given up."""
        return {child.name for child in self._children if child.is_given_up}

    def restarts(self, name: str) -> int:
        """Return how often a process has died within :data:`RESTARTS_PERIOD_S` and was started again."""
        now = self._now()
        return sum(now - death < RESTARTS_PERIOD_S for death in self._deaths.get(name, ()))

    def waiting(self) -> set[str]:
        """Return the processes that will be started again."""
        return {child.name for child in self._children if child.due is not None}

    def _start_due(self) -> None:
        for index, child in enumerate(self._children):
            if child.due is not None and self._now() >= child.due:
                with held_back():
                    self._children[index] = self._started(child.name, again=True)
                child.close()

    def _started(self, group: str, *, again: bool = False) -> _Child:
        log_file = self._log_folder / f"{group}.log"
        with ExitStack() as opened:
            try:
                self._log_folder.mkdir(parents=True, exist_ok=True)
                log = opened.enter_context(log_file.open("ab", buffering=0))
                log.write(f"{log_line(f'the process {group} starts')}\n".encode())
                log_begun = log.seek(0, os.SEEK_END)
            except OSError as error:
                raise ConfigError(
                    f"the log cannot be written: {error.strerror}",
                    file=log_file,
                    valid=["a folder that can be written to"],
                ) from error
            heart = HeartbeatMonitor(self._now())
            opened.callback(heart.close)
            process = self._start_process(
                group,
                self._options_file,
                output=log.fileno(),
                variables={STARTED_AGAIN: "1" if again else ""},
                keep_open={FD_VARIABLE: heart.writer},
                hold=self._keep_open,
            )
            opened.pop_all()
        heart.started(process.pid)
        return _Child(group, process, log_file, log, log_begun, heart)

    def check(self) -> None:
        """Start what is due to be started again; raise when a process has ended.

        Raises:
            ProcessDied: Names the process, how it ended and the end of its log.
            ConfigError: The log of a process that is started again cannot be written.
        """
        self._start_due()
        for child in self._children:
            if child.due is None and not child.is_given_up and child.process.poll() is not None:
                how, then = child.how_it_ended(), self._reap(child)
                raise ProcessDied(child.name, how, child.log_file, then, child.log_begun)

    def silences(self) -> dict[str, float]:
        """Take the heartbeats that came; call it several times a second.

        Returns:
            By name, how long every process that has beaten at all and runs has been silent
            (:class:`HeartbeatMonitor`).
        """
        now = self._now()
        for child in self._children:
            child.heart.look(now)
        return {
            child.name: child.heart.silent_s
            for child in self._children
            if child.heart.has_beaten and child.process.poll() is None
        }

    def note(self, name: str, line: str) -> None:
        """Write a line into the log of a process, if that can be done."""
        with suppress(OSError):
            self._child(name).log.write(f"{log_line(line, 'WARN')}\n".encode())

    def write_stack(self, name: str) -> None:
        """Let a process that is up write into its log what it is doing.

        Not one that a signal has stopped (SIGSTOP, a debugger): it would write when it goes on, on any of its
        threads and amid what it does then, which can crash it.
        """
        pid = self._child(name).process.pid
        if _is_stopped(pid):
            self.note(name, "a signal has stopped it (kill -CONT lets it go on)")
        else:
            os.kill(pid, STACK_SIGNAL)

    def kill(self, name: str, why: str) -> None:
        """Kill a process; :meth:`check` says that it died, and why, as soon as it is gone.

        That is not waited for: one that closes a serial port to which nobody listens takes half a minute.
        """
        child = self._child(name)
        child.killed_because = why
        child.process.kill()

    def _child(self, name: str) -> _Child:
        (child,) = (child for child in self._children if child.name == name)
        return child

    def _reap(self, child: _Child) -> str:
        if child.reaped is None:
            child.reaped = self._after_death(child.name)
        return child.reaped

    def stop(self) -> list[str]:
        """End every process, the last started first; those that are silent already are killed at once.

        Returns:
            The names of those that had to be killed.
        """
        killed = []
        while self._children:
            batch = self._last_batch()
            killed += self._end(batch)
            for child in batch:
                # One that was asked before its handlers stood has opened nothing.
                if child.process.returncode not in (0, -signal.SIGTERM):
                    self._reap(child)
                child.close()
                self._children.remove(child)
        return killed

    def _last_batch(self) -> list[_Child]:
        batch = [self._children[-1]]
        for child in reversed(self._children[:-1]):
            if not {batch[-1].name, child.name} <= set(self._ended_together):
                break
            batch.append(child)
        return batch

    def _end(self, batch: Sequence[_Child]) -> list[str]:
        """Ask processes to end and wait; kill those that do not, and give their names."""
        killed: list[str] = []
        deadline = self._now() + self._stop_budget_s
        for child in batch:
            if child.process.poll() is not None:
                continue
            if child.heart.is_silent:
                killed.append(_killed(child))
            else:
                # Not SIGINT: in the background of a script it is ignored until the handlers stand.
                child.process.terminate()
        while running := [child for child in batch if child.process.poll() is None]:
            self.silences()
            for child in running:
                if child.name not in killed and (
                    self._now() > deadline or child.heart.silent_s > KILLED_AFTER_S
                ):
                    killed.append(_killed(child))
            time.sleep(END_LOOK_S)
        return killed

    def pids(self) -> dict[str, int]:
        """Return the process ids by group."""
        return {child.name: child.process.pid for child in self._children}


def log_line(text: str, level: str = "INFO") -> str:
    """Write a line of ``florence up`` as rclpy writes those of nodes (rcutils, default format)."""
    return f"[{level}] [{time.time():.9f}] [florence_up]: {text}"


def _killed(child: _Child) -> str:
    """Kill a process; gives its name."""
    child.process.kill()
    return child.name


def _ending(code: int) -> str:
    if code >= 0:
        return f"ended with code {code}"
    names = {number.value: number.name for number in signal.Signals}
    return f"was killed by {names.get(-code, f'signal {-code}')}"


def _tail(file: Path, begin: int) -> str:
    """Return the last lines of a log from a byte on; why there are none, when it cannot be read."""
    try:
        lines = file.read_bytes()[begin:].decode("utf-8", errors="replace").splitlines()
    except OSError as error:
        return f"  ({error.strerror})"
    return "\n".join("  " + line for line in lines[-TAIL_LINES:]) or "  (empty)"


def _is_stopped(pid: int) -> bool:
    """Tell whether a process is stopped by a signal or traced (proc(5), the third field of ``stat``)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "Tt"
    except OSError:
        return False
