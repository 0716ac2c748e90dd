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


def styled(tree: str) -> Text:
    """The ASCII tree with a colour for each mark."""
    text = Text(tree)
    for status, style in STYLES.items():
        text.highlight_regex(rf"(?m)^ *{re.escape(MARKS[status])}", style)
    return text


class LiveDisplay:
    """A panel that is redrawn in place."""

    def __init__(self, console: Console) -> None:
        """Start drawing."""
        self._live = Live(console=console, refresh_per_second=8, transient=True)
        self._live.start()

    def say(self, line: str) -> None:
        """Print above the panel."""
        self._live.console.print(line, highlight=False, markup=False, soft_wrap=True)

    def show(self, tree: str) -> None:
        """Redraw the panel."""
        self._live.update(Panel(styled(tree), title="mission", border_style="dim"))

    def close(self) -> None:
        """Remove the panel."""
        self._live.stop()


class LogDisplay:
    """One plain line whenever the running leaves change."""

    def __init__(self, console: Console) -> None:
        """Store the console."""
        self._console = console
        self._shown = ""

    def say(self, line: str) -> None:
        """Print the line."""
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)

    def show(self, tree: str) -> None:
        """Print what runs now, if that is new."""
        running = [
            line.strip() for line in tree.splitlines() if line.lstrip().startswith(MARKS[Status.RUNNING])
        ]
        leaf = running[-1] if running else ""
        if leaf and leaf != self._shown:
            self._shown = leaf
            self.say(f"  {leaf}")

    def close(self) -> None:
        """Nothing to clean."""


def make_display(console: Console, *, headless: bool) -> LiveDisplay | LogDisplay:
    """A live display on a terminal, log lines elsewhere or when asked for."""
    return LogDisplay(console) if headless or not console.is_terminal else LiveDisplay(console)
