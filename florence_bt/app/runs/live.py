"""Shows a running mission in the terminal: a live tree, or plain log lines where there is no terminal."""

from __future__ import annotations

import re

from py_trees.common import Status
from rich.console import Console
from rich.live import Live
from rich.panel import Panel
from rich.text import Text

from florence_bt.trees.drawings.ascii import MARKS

STYLES = {Status.SUCCESS: "green", Status.FAILURE: "red", Status.RUNNING: "bold cyan", Status.INVALID: "dim"}

_FRAME = (4, 2)
"""Columns and lines that the border of a panel takes."""


def styled(tree: str) -> Text:
    """Colour each mark of the ASCII tree."""
    text = Text(tree)
    for status, style in STYLES.items():
        text.highlight_regex(rf"(?m)^ *{re.escape(MARKS[status])}", style)
    return text


def around_what_runs(tree: str, lines: int, columns: int) -> str:
    """Return the head line of a status and the lines down to the last one that runs, moved left where needed.

    Args:
        tree: A status with more lines than there is room for.
        lines: How many lines there is room for.
        columns: How wide they may be: every node that runs begins in the left half.
    """
    head, *below = tree.splitlines()
    running = [line.lstrip().startswith(MARKS[Status.RUNNING]) for line in below]
    end = max([lines - 1, *(place for place, runs in enumerate(running, 1) if runs)])
    part = slice(end - lines + 1, end)
    deepest = max(
        (_depth(line) for line, runs in zip(below[part], running[part], strict=True) if runs), default=0
    )
    shift = max(deepest - columns // 2, 0)
    return "\n".join([head, *(line[min(_depth(line), shift) :] for line in below[part])])


class LiveDisplay:
    """A panel that is redrawn in place; of a status that is too long for the terminal it has what runs."""

    def __init__(self, console: Console) -> None:
        """Start drawing."""
        self._live = Live(console=console, refresh_per_second=8, transient=True)
        self._live.start()

    def say(self, line: str) -> None:
        """Print above the panel."""
        self._live.console.print(line, highlight=False, markup=False, soft_wrap=True)

    def show(self, tree: str) -> None:
        """Redraw the panel."""
        console, text = self._live.console, styled(tree)
        columns, lines = console.width - _FRAME[0], max(console.height - _FRAME[1], 2)
        if len(text.wrap(console, columns)) > lines:
            text = styled(around_what_runs(tree, lines, columns))
            text.no_wrap, text.overflow = True, "ellipsis"
        self._live.update(Panel(text, title="mission", border_style="dim"))

    def close(self) -> None:
        """Remove the panel."""
        self._live.stop()


class LogDisplay:
    """A plain line whenever another leaf runs, and one for each new failure of a leaf."""

    def __init__(self, console: Console) -> None:
        """Store the console."""
        self._console = console
        self._running: set[str] = set()
        self._failures: set[str] = set()

    def say(self, line: str) -> None:
        """Print the line."""
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)

    def show(self, tree: str) -> None:
        """Print the names of the leaves that run when one was not there before, and each failure once."""
        leaves = _leaves(tree)
        failed = [leaf for leaf in leaves if leaf.startswith(MARKS[Status.FAILURE])]
        for leaf in dict.fromkeys(failed):
            if leaf not in self._failures:
                self._failures.add(leaf)
                self.say(f"  {leaf}")
        mark = MARKS[Status.RUNNING]
        names = [leaf.partition(" -- ")[0].removeprefix(mark) for leaf in leaves if leaf.startswith(mark)]
        if not self._running.issuperset(names):
            self._running = set(names)
            self.say(f"  {mark}{','.join(dict.fromkeys(names))}")

    def close(self) -> None:
        """Do nothing: there is nothing to clean."""


def _leaves(tree: str) -> list[str]:
    """Return the lines of a tree below which none is further to the right."""
    lines = [line for line in tree.splitlines() if line.lstrip().startswith("[")]
    below = [*lines[1:], ""]
    return [
        line.strip()
        for line, next_line in zip(lines, below, strict=False)
        if _depth(next_line) <= _depth(line)
    ]


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip())


def make_display(console: Console, *, headless: bool) -> LiveDisplay | LogDisplay:
    """Make a live display on a terminal, log lines elsewhere or when asked for."""
    return LogDisplay(console) if headless or not console.is_terminal else LiveDisplay(console)
