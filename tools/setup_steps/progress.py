"""A step of the set-up, the log file of its commands, and the short lines that a person sees meanwhile."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

TAIL_LINES = 30
NOISE = ("WARNING: Location ",)
"""Lines that pip prints for each package when a configured location lacks it; nothing is wrong then."""


class StepFailed(Exception):
    """A step cannot be done; the message says what to do about it."""


@dataclass(frozen=True)
class Step:
    """One thing to do, and how to see that it was done.

    Attributes:
        title: What a person reads.
        is_done: Whether nothing changed since the step was last done.
        work: Does it.
    """

    title: str
    is_done: Callable[[], bool]
    work: Callable[[], None]


def stamped(title: str, stamp: Path, fingerprint: Callable[[], str], work: Callable[[], None]) -> Step:
    """Make a step that leaves a stamp when it is through.

    Args:
        title: What a person reads.
        stamp: File that holds the fingerprint of what the step was made from.
        fingerprint: Hash of what the step would be made from now.
        work: Does it.
    """

    def is_done() -> bool:
        return stamp.is_file() and stamp.read_text() == fingerprint()

    def work_and_stamp() -> None:
        work()
        stamp.parent.mkdir(parents=True, exist_ok=True)
        stamp.write_text(fingerprint())

    return Step(title, is_done, work_and_stamp)


class Log:
    """Keeps the output of every command in a file; shows its tail when a command fails."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._mode = "w"
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[str]] = set()
        self._failed_first: BaseException | None = None

    def side_by_side(self, *works: Callable[[], None]) -> None:
        """Do several things at once, as many as there are cores; when one fails, end the commands of all.

        Raises:
            StepFailed: The first one that failed.
        """
        with ThreadPoolExecutor(max(2, len(os.sched_getaffinity(0)))) as pool:
            running = [pool.submit(work) for work in works]
            try:
                for one in as_completed(running):
                    one.result()
            except BaseException as error:
                pool.shutdown(wait=False, cancel_futures=True)
                # Not what failed because it was ended here, or in what runs beside this.
                raise self._end_commands(error) from None

    def do(self, label: str, step: Step) -> None:
        """Do a step that is not up to date, and print what begins and how many seconds it took."""
        if step.is_done():
            return
        print(f"{label} {step.title} ...", flush=True)
        begin = time.monotonic()
        step.work()
        print(f"{label} {step.title}: {time.monotonic() - begin:.0f} s", flush=True)

    def call(self, command: Iterable[str | Path], environment: Mapping[str, str] | None = None) -> None:
        """Run a command to its end.

        Raises:
            StepFailed: It cannot be started or ended with an error; the message has the tail of its output.
        """
        words = [str(word) for word in command]
        process = self._start(words, {**os.environ, **(environment or {})})
        try:
            output, _ = process.communicate()
        except BaseException:
            _end_group(process)
            raise
        finally:
            self._running.discard(process)
        lines = [line for line in output.splitlines() if not line.startswith(NOISE)]
        self._keep("\n".join([f"$ {' '.join(words)}", *lines, ""]))
        if process.returncode != 0:
            tail = "\n".join("    " + line for line in lines[-TAIL_LINES:])
            raise StepFailed(
                f"this failed with code {process.returncode}: {' '.join(words)}\n{tail}\n"
                f"the whole output: {self._path}"
            )

    def _start(self, words: list[str], environment: Mapping[str, str]) -> subprocess.Popen[str]:
        with self._lock:
            if self._failed_first:
                raise StepFailed(f"not started, because something else failed: {words[0]}")
            try:
                process = subprocess.Popen(
                    words,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    text=True,
                    errors="replace",
                    # A group of its own, so that an interrupted set-up leaves no compiler behind.
                    start_new_session=True,
                )
            except OSError as error:
                raise StepFailed(f"cannot run {words[0]}: {error}") from error
            self._running.add(process)
            return process

    def _end_commands(self, error: BaseException) -> BaseException:
        """End every command that runs, with all that it started, and start no more.

        Returns:
            The error for which that was done first.
        """
        with self._lock:
            self._failed_first = self._failed_first or error
            running = tuple(self._running)
        for process in running:
            _end_group(process)
        return self._failed_first

    def _keep(self, text: str) -> None:
        with self._lock:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open(self._mode) as file:
                file.write(text)
            self._mode = "a"


def _end_group(process: subprocess.Popen[str]) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGTERM)
    process.wait()
