"""Shows a running mission in the terminal: a screen with keys, or plain log lines where there is none."""

from __future__ import annotations

import os
import threading
import time
from contextlib import suppress

from py_trees.common import Status
from rich.console import Console, Group
from rich.live import Live

from florence_bt.app.runs.keyboard import Keyboard
from florence_bt.app.runs.screen import (
    KEYS_OF_STATUS,
    LEAST_COLUMNS,
    LEAST_LINES,
    Detail,
    Failures,
    Screen,
    ScreenView,
    running_leaves,
)
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.trees.drawings.ascii import MARKS, TreeRow
from florence_bt.trees.drawings.folding import fold_calls

FRAME_S = 0.1
"""Seconds between two pictures."""
SIZE_S = 0.3
"""Seconds between two looks whether the terminal has another size."""
LAST_PICTURE_S = 2.0
"""Seconds that a terminal gets to take the last picture; one that was stopped with Ctrl-S takes none."""


class LiveDisplay:
    """The whole terminal, with keys to scroll, unfold and search; what was there comes back at the end.

    It draws on a thread of its own, so that a terminal that takes nothing holds nobody up: what comes
    meanwhile is not shown. The screen begins with the first tree.

    Args:
        console: The terminal.
        keys: What the keys ``q`` and Ctrl-C do, for the line at the bottom.
        whole: Whether every node is shown from the start.

    Attributes:
        left: Whether ``q`` was pressed.
    """

    def __init__(self, console: Console, keys: str = KEYS_OF_STATUS, *, whole: bool = False) -> None:
        self.left = False
        self._console = console
        self._screen = Screen(keys, view=ScreenView(Detail.ALL if whole else None))
        self._keyboard = Keyboard()
        self._said: list[str] = []
        self._shown: tuple[RunTree | None, str] = (None, "")
        self._lock = threading.Lock()
        self._wake, self._waker = os.pipe()
        self._closing = False
        self._thread: threading.Thread | None = None

    def say(self, line: str) -> None:
        """Print a line; while the screen is there, it shows the last one and all are printed afterwards."""
        with self._lock:
            if self._thread is not None:
                self._said.append(line)
                self._screen.said = line
                return
        _print(self._console, line)

    def show(self, tree: RunTree, where: str = "") -> None:
        """Show a run from now on.

        Args:
            tree: The run.
            where: Where the robot is, empty when nobody knows.
        """
        if (tree, where) == self._shown:
            return
        self._shown = (tree, where)
        with self._lock:
            self._screen.show(tree)
            self._screen.where = where
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="terminal", daemon=True)
                self._thread.start()

    def close(self) -> None:
        """Give the terminal back, and print what was said meanwhile."""
        self._closing = True
        os.write(self._waker, b"\0")
        if self._thread is not None:
            self._thread.join(LAST_PICTURE_S)
            if self._thread.is_alive():
                self._keyboard.release()
                return
        os.close(self._wake)
        os.close(self._waker)
        with suppress(OSError):  # the terminal was closed
            for line in self._said:
                _print(self._console, line)

    def _run(self) -> None:
        live = Live(console=self._console, screen=True, auto_refresh=False, redirect_stdout=False)
        with suppress(OSError), self._keyboard, live:  # the terminal may be closed
            while not self._closing:
                self._draw(live)
                time.sleep(FRAME_S)
                for key in self._keyboard.read(self._wake, SIZE_S - FRAME_S):
                    self._press(key)

    def _draw(self, live: Live) -> None:
        columns, lines = self._console.size
        with self._lock:
            drawn = self._screen.draw(columns, lines)
        live.update(Group(*drawn), refresh=True)

    def _press(self, key: str) -> None:
        with self._lock:
            if key == "q" and not self._screen.view.typing:
                self.left = True
            else:
                self._screen.press(key)


class LogDisplay:
    """A plain line whenever a leaf begins or says something else, and one for each new failure of a leaf.

    Args:
        console: Where to print.

    Attributes:
        left: False: nothing is read from a keyboard.
    """

    left = False

    def __init__(self, console: Console) -> None:
        self._console = console
        self._running: set[tuple[str, str]] = set()
        self._failures = Failures()
        self._shown: RunTree | None = None

    def say(self, line: str) -> None:
        """Print the line."""
        _print(self._console, line)

    def show(self, tree: RunTree) -> None:
        """Print what is new in a run."""
        if tree is self._shown:
            return
        self._shown = tree
        when = f"{tree.took:>8}  " if tree.took else "  "
        nodes = fold_calls(tree.nodes)
        for failure in self._failures.look(nodes, tree.took):
            self._say_row(when, TreeRow(0, Status.FAILURE, failure.title, failure.says))
        leaves = [nodes[place] for place in running_leaves(nodes)]
        running = {(leaf.title, leaf.says): leaf for leaf in leaves if not leaf.left}
        for key, leaf in running.items():
            if key not in self._running:
                self._say_row(when, leaf)
        if running:
            self._running = set(running)

    def _say_row(self, when: str, row: TreeRow) -> None:
        self.say(f"{when}{MARKS[row.status]} {row.title}{f' -- {row.says}' if row.says else ''}")

    def close(self) -> None:
        """Do nothing: there is nothing to clean."""


def _print(console: Console, line: str) -> None:
    console.print(line, highlight=False, markup=False, soft_wrap=True)


def make_display(
    console: Console, *, headless: bool, keys: str = KEYS_OF_STATUS, whole: bool = False
) -> LiveDisplay | LogDisplay:
    """Make a screen on a terminal that is large enough, log lines elsewhere or when asked for."""
    fits = console.width >= LEAST_COLUMNS and console.height >= LEAST_LINES
    if headless or not console.is_terminal or console.is_dumb_terminal or not fits:
        return LogDisplay(console)
    return LiveDisplay(console, keys, whole=whole)
