"""Tables of Markdown for the docs: each says what it was made on, and the rows behind it are kept.

A table stands between ``<!-- NAME -->`` and ``<!-- end of NAME -->`` of a page, with a line below it that
tells date, commit, command, and what it depends on (:mod:`tools.made_tables`). The rows that it sums up are
in ``rows/NAME.csv.gz`` beside the page, written by the same call; without a page they go to ``build/``.
"""

from __future__ import annotations

import csv
import enum
import fcntl
import gzip
import io
import json
import math
import os
import platform
import re
import shlex
import subprocess
import sys
import types
import typing
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Generic, TypeVar

from tools.made_tables import figures_of

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build"
"""Folder of rows that belong to no page; git ignores it."""

Row = TypeVar("Row")


def git(*words: str, root: Path = ROOT) -> str:
    """Return what git prints, empty where it fails: perhaps there is no repository."""
    done = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""


COMMIT = git("rev-parse", "--short=8", "HEAD")
"""Commit that a tool works on: of when the tool began, which may take an hour. Empty without a repository."""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Write a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def milliseconds(ordered: Sequence[float], share: float) -> str:
    """Return the value below which a share of some seconds lies, e.g. ``12 ms``."""
    place = max(0, math.ceil(share * len(ordered)) - 1)
    return f"{1000.0 * ordered[place]:.0f} ms"


def command_of(tool: str, arguments: Sequence[str] | None = None) -> str:
    """Write the command that a reader would type to have a table again.

    Args:
        tool: What Python is given, e.g. ``tools/crossing.py`` or ``-m tools.rooms``.
        arguments: Those of the tool; the ones of this process when not given.
    """
    return f"python {tool} {shlex.join(sys.argv[1:] if arguments is None else arguments)}".strip()


# ---- tables in pages -----------------------------------------------------------------------------------


def write_table(page: Path, name: str, text: str, command: str, commit: str = "") -> None:
    """Put a table between its marks, with what it was made on.

    Args:
        page: The page.
        name: Of the marks.
        text: The table.
        command: What makes it.
        commit: Of the rows, where they were made on another one than this.

    Raises:
        ValueError: The page has no such marks.
        KeyError: No such table is in :data:`tools.made_tables.FIGURES`.
    """
    write_between_marks(page, name, f"{text}\n\n{made_line(name, command, commit)}")


def write_between_marks(file: Path, name: str, text: str) -> None:
    """Replace what stands between ``<!-- NAME -->`` and ``<!-- end of NAME -->`` in a page.

    Two tools may write to one page at the same time.

    Raises:
        ValueError: The page has no such marks.
    """
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    with file.open("r+", encoding="utf-8") as opened:
        fcntl.flock(opened, fcntl.LOCK_EX)
        page = opened.read()
        if _between(page, name) is None:
            raise ValueError(f"{file} has no marks {begin} and {end}")
        changed = _pattern(name).sub(lambda _: f"{begin}\n\n{text}\n\n{end}", page)
        opened.seek(0)
        opened.write(changed)
        opened.truncate()


def text_between_marks(page: Path, name: str) -> str | None:
    """Return what stands between the marks of a table, None when the page has none."""
    return _between(page.read_text(encoding="utf-8"), name)


def _between(page: str, name: str) -> str | None:
    found = _pattern(name).search(page)
    return found[1].strip() if found else None


def _pattern(name: str) -> re.Pattern[str]:
    return re.compile(
        f"{re.escape(f'<!-- {name} -->')}(.*?){re.escape(f'<!-- end of {name} -->')}", re.DOTALL
    )


@dataclass(frozen=True, slots=True)
class Made:
    """The circumstances in which a table was made.

    Attributes:
        date: ``2026-11-28``.
        commit: Abbreviated; of a table of which nobody noted it, the one with which its lines came.
        noted: Whether the commit was noted when the table was made.
        changed: Whether what it depends on had changes that were in no commit.
        command: What made it; empty when it was not noted.
        depends: Folders and files.
    """

    date: str
    commit: str
    noted: bool
    changed: bool
    command: str
    depends: tuple[str, ...]


_NOTED = re.compile(
    r"^\*Made (?P<date>[\d-]+) on (?P<commit>\w+)(?P<changed> with changes)? by `(?P<command>[^`]+)`"
    r"(?P<machine>, .*?)?; depends on (?P<depends>[^*]+)\.\*$",
    re.MULTILINE,
)
_NOT_NOTED = re.compile(
    r"^\*Made before (?P<date>[\d-]+), on a commit that was not noted \(these lines came with "
    r"(?P<commit>\w+)\); depends on (?P<depends>[^*]+)\.\*$",
    re.MULTILINE,
)


def made_line(name: str, command: str, commit: str = "") -> str:
    """Write the line below a table that is being made now; of rows of another commit, with that one."""
    figures = figures_of(name)
    has_changes = not commit and git("status", "--porcelain", "--", *figures.depends)
    changed = " with changes" if has_changes else ""
    machine = ""
    if figures.alone:
        cores, load = os.cpu_count(), os.getloadavg()[1]
        machine = f", {cores} cores, Python {platform.python_version()}, load {load:.0f}"
    made_on = commit or COMMIT or "unknown"
    return (
        f"*Made {datetime.now(UTC):%Y-%m-%d} on {made_on}{changed} by `{command}`{machine}; "
        f"depends on {depends_text(figures.depends)}.*"
    )


def depends_text(depends: Iterable[str]) -> str:
    """Write folders and files as the line below a table has them."""
    return ", ".join(f"`{each}`" for each in depends)


def made_of(text: str) -> Made | None:
    """Read the line below a table; None when there is none."""
    noted = _NOTED.search(text)
    found = noted or _NOT_NOTED.search(text)
    if found is None:
        return None
    return Made(
        date=found["date"],
        commit=found["commit"],
        noted=noted is not None,
        changed=noted is not None and noted["changed"] is not None,
        command=noted["command"] if noted else "",
        depends=tuple(re.findall(r"`([^`]+)`", found["depends"])),
    )


def without_made_line(text: str) -> str:
    """Return a table without the line below it."""
    return _NOT_NOTED.sub("", _NOTED.sub("", text)).strip()


# ---- the rows behind them ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class RowTable(Generic[Row]):
    """A table whose rows are kept.

    Attributes:
        name: Of the table and its marks.
        row: A dataclass, one for each trial, walk, picture, ... .
        text: Writes the table of such rows as Markdown.
    """

    name: str
    row: type[Row]
    text: Callable[[Sequence[Row]], str]

    def publish(self, rows: Sequence[Row], page: Path | None, command: str, commit: str = "") -> None:
        """Print the table, keep its rows, and put it into a page when one is given (:func:`write_table`)."""
        file = self.file_beside(page) if page else BUILD / f"{self._file_name}.csv"
        write_rows(file, self.row, rows)
        print(file, self.text(rows), sep="\n")
        if page is not None:
            write_table(page, self.name, self.text(rows), command, commit)

    def file_beside(self, page: Path) -> Path:
        """Return where the rows are of the table in a page."""
        return page.parent / "rows" / f"{self._file_name}.csv.gz"

    @property
    def _file_name(self) -> str:
        return self.name.replace(" ", "_")


def write_rows(file: Path, kind: type[Row], rows: Iterable[Row]) -> None:
    """Write rows with a column for each field; a name that ends with ``.gz`` is compressed."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(_columns(kind))
    lines.writerows([_written(value) for value in _values(kind, row)] for row in rows)
    data = text.getvalue().encode()
    file.parent.mkdir(parents=True, exist_ok=True)
    # Without a time, the same rows are the same bytes.
    file.write_bytes(gzip.compress(data, mtime=0) if file.suffix == ".gz" else data)


def read_rows(file: Path, kind: type[Row]) -> list[Row]:
    """Read what :func:`write_rows` wrote.

    Raises:
        ValueError: The file has other columns than the rows have fields.
    """
    data = file.read_bytes()
    text = (gzip.decompress(data) if file.suffix == ".gz" else data).decode()
    head, *lines = csv.reader(io.StringIO(text))
    if head != list(_columns(kind)):
        raise ValueError(f"{file} has the columns {head}, and not {list(_columns(kind))}")
    return [_row_from(kind, iter(line)) for line in lines]


def _fields(kind: type) -> Iterator[tuple[str, Any, type | None]]:
    """Yield name and type of each field, and what it is when it is a dataclass, or perhaps one."""
    hints = typing.get_type_hints(kind)
    for field in fields(kind):
        hint = hints[field.name]
        inner = next((each for each in (hint, *typing.get_args(hint)) if is_dataclass(each)), None)
        yield field.name, hint, inner


def _columns(kind: type) -> Iterator[str]:
    for name, _, inner in _fields(kind):
        if inner is None:
            yield name
        else:
            yield from (f"{name}.{column}" for column in _columns(inner))


def _values(kind: type, row: Any) -> Iterator[Any]:
    for name, _, inner in _fields(kind):
        value = getattr(row, name) if row is not None else None
        if inner is None:
            yield value
        else:
            yield from _values(inner, value)


def _written(value: Any) -> str:
    match value:
        case None:
            return ""
        case bool():
            return "yes" if value else "no"
        case enum.Enum():
            return str(value.value)
        case str():
            return value
        case int():
            return str(value)
        case float():
            return repr(float(value))  # NumPy's own has a name around it
        case _:
            return json.dumps(value)


def _row_from(kind: type, cells: Iterator[str]) -> Any:
    values: dict[str, Any] = {}
    for name, hint, inner in _fields(kind):
        if inner is None:
            values[name] = _read(hint, next(cells))
        else:
            own = [next(cells) for _ in _columns(inner)]
            # One that may be missing is so when all of its cells are empty.
            values[name] = _row_from(inner, iter(own)) if any(own) or hint is inner else None
    return kind(**values)


def _read(hint: Any, cell: str) -> Any:
    options = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    if cell == "" and type(None) in options:
        return None
    kind = next(each for each in options if each is not type(None))
    if kind is bool:
        return cell == "yes"
    if kind in (str, int, float) or (isinstance(kind, type) and issubclass(kind, enum.Enum)):
        return kind(cell)
    return (typing.get_origin(kind) or kind)(json.loads(cell))
