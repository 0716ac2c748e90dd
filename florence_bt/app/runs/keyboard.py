"""Keys of a terminal, one by one as they are pressed."""

from __future__ import annotations

import os
import re
import select
import sys
import termios
from contextlib import suppress
from types import TracebackType
from typing import Any

_NAMES = {
    "\x1b[A": "up",
    "\x1bOA": "up",
    "\x1b[B": "down",
    "\x1bOB": "down",
    "\x1b[C": "right",
    "\x1bOC": "right",
    "\x1b[D": "left",
    "\x1bOD": "left",
    "\x1b[5~": "page up",
    "\x1b[6~": "page down",
    "\x1b[H": "home",
    "\x1bOH": "home",
    "\x1b[1~": "home",
    "\x1b[F": "end",
    "\x1bOF": "end",
    "\x1b[4~": "end",
    "\x1b": "escape",
    "\r": "enter",
    "\n": "enter",
    "\x7f": "backspace",
    "\x08": "backspace",
}
_KEY = re.compile(r"\x1b(?:\[[0-9;]*[ -/]*[@-~]|O[@-~])|.", re.DOTALL)
"""A sequence of a function key (ECMA-48, 5.4), or one character."""


def keys_in(text: str) -> list[str]:
    """Return the keys that were pressed: names of :data:`_NAMES`, or the character; others are dropped."""
    named = (_NAMES.get(key, key) for key in _KEY.findall(text))
    return [key for key in named if key in _NAMES.values() or (len(key) == 1 and key.isprintable())]


class Keyboard:
    """The keyboard of the terminal, without echo. Ctrl-C stays a signal. Use as a context manager.

    Without a terminal to read from there are never any keys. Ctrl-Z is switched off: a viewer that was
    suspended would leave the terminal without an echo, and a demonstration without supervision.
    """

    def __init__(self) -> None:
        self._descriptor = sys.stdin.fileno() if in_front() else -1
        self._before: list[Any] = []

    def __enter__(self) -> Keyboard:
        """Take the keys as they come."""
        if self._descriptor >= 0:
            self._before = termios.tcgetattr(self._descriptor)
            mode = termios.tcgetattr(self._descriptor)
            mode[3] &= ~(termios.ICANON | termios.ECHO)
            mode[6][termios.VSUSP] = os.fpathconf(self._descriptor, "PC_VDISABLE").to_bytes(1, "little")
            termios.tcsetattr(self._descriptor, termios.TCSANOW, mode)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Put the terminal back."""
        self.release()

    def release(self) -> None:
        """Put the terminal back; harmless when that was done already."""
        before, self._before = self._before, []
        if before:
            with suppress(termios.error):  # the terminal was closed
                termios.tcsetattr(self._descriptor, termios.TCSANOW, before)

    @property
    def closed(self) -> bool:
        """Tell whether there will be no keys: no terminal, or one that was closed."""
        return self._descriptor < 0

    def read(self, wake: int | None, timeout_s: float) -> list[str]:
        """Wait for keys.

        Args:
            wake: A descriptor that ends the wait when it can be read, too; it is not read.
            timeout_s: The longest wait.
        """
        watched = [each for each in (wake, self._descriptor) if each is not None and each >= 0]
        ready, _, _ = select.select(watched, [], [], timeout_s)
        if self._descriptor not in ready:
            return []
        try:
            pressed = os.read(self._descriptor, 1024)
        except OSError:  # the terminal was closed
            pressed = b""
        if not pressed:
            self._descriptor, self._before = -1, []
        return keys_in(pressed.decode(errors="replace"))


def in_front() -> bool:
    """Tell whether this process may read from a terminal: one in the background would be suspended."""
    try:
        descriptor = sys.stdin.fileno()
        return os.isatty(descriptor) and os.tcgetpgrp(descriptor) == os.getpgrp()
    except (OSError, ValueError):  # no standard input, or no terminal of this session
        return False
