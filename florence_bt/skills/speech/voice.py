"""Voices: what turns a sentence into sound, or into the time that it would take. One sentence at a time."""

from __future__ import annotations

import contextlib
import os
import shlex
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from typing import IO, Protocol

from florence_bt.core.clock import Clock, Timer, call_every
from florence_bt.core.errors import ConfigError

PRINT, NONE = "print", "none"
"""Programs that are none: sentences are only shown; another node serves the action ``speak``."""
ESPEAK = "espeak-ng"
LONGEST_TEXT = 1000
"""Characters of a sentence."""
SECONDS_PER_CHARACTER = 0.07
"""Chosen: 150 words a minute, a clear pace, with 5.7 characters a word."""
PROGRAM_LOOK_S = 0.05
"""Between two looks whether the program has ended: shorter than the pause after a sentence."""

OnEnd = Callable[[str], None]
"""Told the end of a sentence: why it was not said, empty when it was."""


class Voice(Protocol):
    """Says a sentence."""

    def begin(self, text: str, on_end: OnEnd) -> None:
        """Begin a sentence; one that is being said must have been stopped. Never blocks."""

    def stop(self) -> None:
        """End the sentence at once; ``on_end`` is not called."""


class SilentVoice:
    """Takes the time that saying would take.

    Args:
        clock: The time of the robot.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._timer: Timer | None = None

    def begin(self, text: str, on_end: OnEnd) -> None:
        """Begin a sentence."""
        when = self._clock.now() + len(text) * SECONDS_PER_CHARACTER
        self._timer = self._clock.call_at(when, lambda: on_end(""))

    def stop(self) -> None:
        """End the sentence."""
        if self._timer is not None:
            self._timer.cancel()


class ProgramVoice:
    """Starts a program for each sentence, which reads it from the standard input and ends when it is said.

    Args:
        clock: The time of the machine.
        command: The program with its arguments.
    """

    def __init__(self, clock: Clock, command: Sequence[str]) -> None:
        self._clock = clock
        self._command = list(command)
        self._process: subprocess.Popen[bytes] | None = None
        self._errors: IO[bytes] | None = None
        self._timer: Timer | None = None

    def begin(self, text: str, on_end: OnEnd) -> None:
        """Start the program with a sentence."""
        errors = tempfile.TemporaryFile()  # noqa: SIM115  # closed in _clean_up
        try:
            # A group of its own, which is ended with it: the command may be a shell with a pipe.
            process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=errors,
                start_new_session=True,
            )
        except OSError as error:
            errors.close()
            on_end(f"{self._command[0]} cannot be started: {error.strerror}")
            return
        self._process, self._errors = process, errors
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # its exit code says more
            process.stdin.write(f"{text}\n".encode())  # less than a pipe holds: it does not block
            process.stdin.flush()
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
        self._timer = call_every(self._clock, PROGRAM_LOOK_S, lambda: self._look(process, on_end))

    def stop(self) -> None:
        """Kill the program and everything that it started."""
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        self._clean_up()

    def _look(self, process: subprocess.Popen[bytes], on_end: OnEnd) -> None:
        code = process.poll()
        if code is None or process is not self._process:
            return
        self._process = None
        assert self._errors is not None
        self._errors.seek(0)
        last_words = self._errors.read()[-2000:].decode(errors="replace").strip().splitlines()[-1:]
        self._clean_up()
        if code == 0:
            on_end("")
            return
        how = f"ended with {code}" if code > 0 else f"was ended by {signal.Signals(-code).name}"
        on_end(": ".join([f"{self._command[0]} {how}", *last_words]))

    def _clean_up(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        if self._errors is not None:
            self._errors.close()


def command_of(program: str) -> list[str]:
    """Return the command of a program that speaks; empty for :data:`PRINT` and :data:`NONE`.

    Args:
        program: A command line as a shell reads it, without pipes.

    Raises:
        ConfigError: It is no command line, or the program is not installed.
    """
    if program in (PRINT, NONE):
        return []
    try:
        command = shlex.split(program)
    except ValueError as error:
        raise ConfigError(f"{program!r} is no command line: {error}", valid=[ESPEAK, PRINT, NONE]) from error
    if not command or shutil.which(command[0]) is None:
        raise ConfigError(
            f"the program {program!r}, which shall speak, is not installed",
            valid=[f"{ESPEAK} (apt install {ESPEAK})", PRINT, NONE],
            parameters=["program"],
        )
    return command


def spoken_text(text: str) -> str:
    """Return a text in one line, without the characters that nobody can read aloud."""
    return " ".join("".join(char if char.isprintable() else " " for char in text).split())
