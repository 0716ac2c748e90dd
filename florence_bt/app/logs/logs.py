"""Shows the logs of a bring-up that runs or is over."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Collection, Iterator
from datetime import datetime
from pathlib import Path

from rich.text import Text

from florence_bt.app.bringup.locks import last_folder
from florence_bt.app.bringup.options import FILE
from florence_bt.app.bringup.topology import node_classes
from florence_bt.app.logs.entries import LEVELS, LogEntry, at_least, entries_in
from florence_bt.core.errors import ConfigError, closest_first

NEW_LINES_S = 0.25
"""Seconds between two looks for new lines, when they are followed."""
LINES_SETTLE_S = 0.5
"""So long is a line held back when lines are followed: older ones may come from other processes."""
SUFFIX = ".log"
_STYLES = {"debug": "dim", "warn": "yellow", "error": "red", "fatal": "bold red"}
_COLOURS = ("cyan", "green", "magenta", "blue", "bright_cyan", "bright_green", "bright_magenta")


def log_folder(out: Path | None) -> Path:
    """Find the folder with the logs.

    Args:
        out: The folder of a bring-up, or of a robot; None: of the bring-up that runs in our ROS domain and
            namespace, or ran last.

    Raises:
        ConfigError: There are no logs.
    """
    places = [last_folder()] if out is None else [out, out / "runs"]
    folders = [place for place in places if place is not None]
    for folder in folders:
        if (folder / "logs").is_dir():
            return folder / "logs"
    where = f"in {', '.join(map(str, folders))}" if folders else "in this ROS domain and namespace"
    raise ConfigError(
        f"there are no logs of a bring-up {where}",
        valid=["--out FOLDER, that of florence up --out, or of a robot", "florence up first"],
    )


class LogReader:
    """Reads the logs of a folder, again and again.

    Args:
        folder: Has a file for each process.
        names: Only these processes and nodes; empty: all.
        level: The least level that is shown.
        whole: Whether also what earlier bring-ups wrote is read.

    Raises:
        ConfigError: There is no such process and no such node, or no such level.
    """

    def __init__(self, folder: Path, names: Collection[str], level: str, *, whole: bool) -> None:
        if level not in LEVELS:
            raise ConfigError(f"the level is {level!r}", valid=LEVELS)
        self._folder = folder
        self._names = frozenset(names)
        self._levels = at_least(level)
        self._begin = 0.0 if whole else _begin_of(folder)
        self._read: dict[Path, int] = {}
        known = [*sorted(file.stem for file in folder.glob(f"*{SUFFIX}")), *node_classes()]
        for name in names:
            if name not in known:
                raise ConfigError(
                    f"no process and no node is called {name!r}", valid=closest_first(name, known)
                )

    def new(self) -> list[LogEntry]:
        """Return the entries that came since the last time, by time."""
        found = [
            entry
            for file in sorted(self._folder.glob(f"*{SUFFIX}"))
            for entry in self._entries(file)
            if entry.level in self._levels and entry.when >= self._begin
            if not self._names or self._names & {entry.process, entry.node}
        ]
        return sorted(found, key=lambda entry: entry.when)

    def _entries(self, file: Path) -> Iterator[LogEntry]:
        try:
            with file.open("rb") as log:
                size = os.fstat(log.fileno()).st_size
                begin = self._read.get(file, 0)
                log.seek(begin if begin <= size else 0)  # one that was emptied is read from its begin
                data = log.read()
        except OSError as error:
            raise ConfigError(
                f"cannot be read: {error.strerror}", file=file, valid=["your own bring-up"]
            ) from error
        whole = data.rpartition(b"\n")[0]
        self._read[file] = (begin if begin <= size else 0) + len(whole) + bool(whole)
        # What follows without a time of its own comes now; at the begin of a file it is of long ago.
        return entries_in(
            whole.decode(errors="replace").splitlines(), file.stem, time.time() if begin else 0.0
        )


def _begin_of(folder: Path) -> float:
    """Return when the last bring-up began: it writes its options first."""
    try:
        return (folder.parent / FILE).stat().st_mtime
    except OSError:
        return 0.0


def text_of(entry: LogEntry, width: int, colour: str) -> Text:
    """Write an entry for people; one that is not of today has its date.

    Args:
        entry: The entry.
        width: Columns for the name of the process.
        colour: That of the name.
    """
    moment = datetime.fromtimestamp(entry.when)
    day = "" if moment.date() == datetime.now().date() else "%Y-%m-%d "
    when = moment.strftime(f"{day}%H:%M:%S.%f")[:-3]
    style = _STYLES.get(entry.level, "")
    node = f"{entry.node}: " if entry.node and entry.node != entry.process else ""
    text = Text.assemble(
        (f"{when} ", "dim"), (f"{entry.process:<{width}} ", colour), (f"{entry.level:<5} ", style)
    )
    indent = " " * len(text.plain)
    return text.append(f"{node}{f'{chr(10)}{indent}'.join(entry.lines)}", style)


class LogPrinter:
    """Prints entries, each process in a colour of its own.

    Args:
        folder: That of the logs, whose names decide on the width.
        print_text: Prints one.
    """

    def __init__(self, folder: Path, print_text: Callable[[Text], None]) -> None:
        names = sorted(file.stem for file in folder.glob(f"*{SUFFIX}"))
        self._width = max(map(len, names), default=0)
        self._colours = {name: _COLOURS[place % len(_COLOURS)] for place, name in enumerate(names)}
        self._print = print_text

    def show(self, entries: Collection[LogEntry]) -> None:
        """Print entries."""
        for entry in entries:
            self._print(text_of(entry, self._width, self._colours.get(entry.process, "")))


def show_logs(reader: LogReader, printer: LogPrinter, *, follow: bool, last: int | None = None) -> None:
    """Print what is there, and what comes until Ctrl-C when it is followed.

    Args:
        reader: Reads.
        printer: Prints.
        follow: Whether to go on.
        last: Only so many entries of those that are there; None: all.
    """
    there = reader.new()
    printer.show(there[len(there) - min(last, len(there)) :] if last is not None else there)
    held: list[LogEntry] = []
    while follow:
        time.sleep(NEW_LINES_S)
        held = sorted([*held, *reader.new()], key=lambda entry: entry.when)
        settled = time.time() - LINES_SETTLE_S
        printer.show([entry for entry in held if entry.when <= settled])
        held = [entry for entry in held if entry.when > settled]
