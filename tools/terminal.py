"""Runs a command in a terminal that does not exist, and reads from its screen what a person would see.

``python -m tools.terminal`` runs ``florence demo`` with nobody at home and writes two of its screens into
docs/manual/runtime.md.
"""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import signal
import struct
import sys
import termios
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import pyte

_ALTERNATE_SCREEN = 1049
"""The mode of xterm in which a program has the terminal for itself."""
PAGE = Path(__file__).resolve().parents[1] / "docs" / "manual" / "runtime.md"
DEMO = ("-m", "florence_bt.cli", "demo", "--person", "absent", "--seed", "4", "--out", "runs/terminal")
MOMENTS = {
    "driving": r"(?s)drives to .*now +go there \([2-9] s\) -- driving.*\[>\] go there",
    "looking round": r"(?s)now +turn .*attempt 2 of 8.*\[>\] turn ",
}
"""Screens of the page, by what is seen on them."""


class _Screen(pyte.Screen):
    """A screen with a second one for programs that want the terminal for themselves, which pyte lacks."""

    def set_mode(self, *modes: int, **keywords: Any) -> None:
        if _ALTERNATE_SCREEN in modes:
            self.before = list(self.display)
            self.reset()
        super().set_mode(*modes, **keywords)

    def reset_mode(self, *modes: int, **keywords: Any) -> None:
        super().reset_mode(*modes, **keywords)
        if _ALTERNATE_SCREEN in modes:
            self.reset()
            for row, line in enumerate(self.before):
                self.cursor_position(row + 1, 1)
                self.draw(line.rstrip())


class Terminal:
    """A command in a pseudo-terminal; use as a context manager, which ends it.

    Args:
        command: The arguments of this Python.
        columns: Width.
        lines: Height.
    """

    def __init__(self, command: Sequence[str], columns: int = 80, lines: int = 24) -> None:
        self._screen = _Screen(columns, lines)
        self._stream = pyte.ByteStream(self._screen)
        self.pid, self._master = pty.fork()
        if self.pid == 0:
            os.environ.update(TERM="xterm-256color", COLUMNS="", LINES="")
            signal.signal(signal.SIGHUP, signal.SIG_DFL)  # as a shell does, also below nohup
            os.execv(sys.executable, [sys.executable, *command])
        self.resize(columns, lines)
        self.code: int | None = None

    def __enter__(self) -> Terminal:
        """Return the terminal."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the command."""
        if self.code is None:
            os.kill(self.pid, signal.SIGCONT)
            os.kill(self.pid, signal.SIGKILL)
            os.waitpid(self.pid, 0)
        self.hang_up()

    def hang_up(self) -> None:
        """Close the terminal under the command."""
        if self._master >= 0:
            os.close(self._master)
            self._master = -1

    def resize(self, columns: int, lines: int) -> None:
        """Give the terminal another size."""
        fcntl.ioctl(self._master, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
        self._screen.resize(lines, columns)

    def press(self, keys: str) -> None:
        """Type something; the character 3 is Ctrl-C."""
        os.write(self._master, keys.encode())

    def look(self, wait_s: float = 0.05) -> str:
        """Read what comes within a moment, and return what is on the screen, without blanks at the ends."""
        while self.code is None and select.select([self._master], [], [], wait_s)[0]:
            try:
                data = os.read(self._master, 1 << 16)
            except OSError:  # the command has ended
                data = b""
            if not data:
                self.code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
                break
            self._stream.feed(data)
            wait_s = 0.0
        return "\n".join(line.rstrip() for line in self._screen.display).rstrip()

    def wait_for(
        self, pattern: str, budget_s: float = 120.0, meanwhile: Callable[[], object] = lambda: None
    ) -> str:
        """Wait until a pattern is on the screen, and return the screen.

        Args:
            pattern: A regular expression.
            budget_s: The longest wait.
            meanwhile: Called again and again.

        Raises:
            AssertionError: It does not come.
        """
        end = time.monotonic() + budget_s
        while not re.search(pattern, screen := self.look()):
            assert self.code is None and time.monotonic() < end, f"no {pattern!r} ({self.code}) on:\n{screen}"
            meanwhile()
        return screen


def write_screens(page: Path = PAGE) -> None:
    """Record the screens of :data:`MOMENTS` and write each into the page, behind its mark."""
    with Terminal(DEMO) as terminal:
        for name, pattern in MOMENTS.items():
            screen = terminal.wait_for(pattern, 600.0)
            before, mark, rest = page.read_text(encoding="utf-8").partition(f"<!-- screen: {name} -->\n```\n")
            _, fence, after = rest.partition("\n```\n")
            page.write_text(f"{before}{mark}{screen}{fence}{after}", encoding="utf-8")
            print(screen)
        terminal.press("q")
        terminal.wait_for("interrupted", 60.0)


if __name__ == "__main__":
    write_screens()
