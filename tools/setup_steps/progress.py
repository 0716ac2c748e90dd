"""A step with its stamp, the log file, and the short lines that a person sees meanwhile."""

from __future__ import annotations

import contextlib
import hashlib
import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

TAIL_LINES = 30
NOISE = ("WARNING: Location ",)
"""Lines that pip prints for each package when a configured location lacks it; nothing is wrong then."""


class StepFailed(Exception):
    """A step cannot be done; the message says what to do about it."""


def content_hash(parts: Iterable[Path | str]) -> str:
    """A hash of texts, files and folders (all files in them, by name)."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, str):
            digest.update(part.encode())
            continue
        for file in sorted(part.rglob("*")) if part.is_dir() else [part]:
            if file.is_file():
                digest.update(str(file.relative_to(part)).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class Step:
    """One thing to do, and how to see that it was done.

    Attributes:
        title: What a person reads.
        stamp: File that holds the hash when the step is through.
        fingerprint: Hash of what the step is made from.
        work: Does it.
    """

    title: str
    stamp: Path
    fingerprint: Callable[[], str]
    work: Callable[[], None]

    def up_to_date(self) -> bool:
        """Whether nothing changed since the step was last done."""
        return self.stamp.is_file() and self.stamp.read_text() == self.fingerprint()

    def run(self) -> None:
        """Do it, and remember that it was done."""
        self.work()
        self.stamp.parent.mkdir(parents=True, exist_ok=True)
        self.stamp.write_text(self.fingerprint())


class Log:
    """Keeps the output of every command in a file; shows its tail when a command fails."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._mode = "w"
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[str]] = set()

    def end_commands(self) -> None:
        """End every command that runs, with all that it started."""
        for process in tuple(self._running):
            _end_group(process)

    def progress(self, number: int, total: int, step: Step) -> bool:
        """Do a step that is not up to date, and say so: what begins, and the seconds that it took.

        Returns:
            Whether there was something to do.
        """
        if step.up_to_date():
            return False
        print(f"[{number}/{total}] {step.title} ...", end="", flush=True)
        begin = time.monotonic()
        try:
            step.run()
        except BaseException:
            print(flush=True)
            raise
        print(f" {time.monotonic() - begin:.0f} s", flush=True)
        return True

    def call(self, command: Iterable[str | Path], environment: Mapping[str, str] | None = None) -> None:
        """Run a command to its end.

        Raises:
            StepFailed: It cannot be started or ended with an error; the message has the tail of its output.
        """
        words = [str(word) for word in command]
        try:
            process = subprocess.Popen(
                words,
                env={**os.environ, **(environment or {})},
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
