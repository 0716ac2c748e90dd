"""Tells which tables of figures are older than a change of what they depend on, and makes them again.

``python -m tools.figures`` lists them (``make figures``). ``--only people`` makes those of a page or of a
name again that are old, ``--only all`` every old one, two commands at a time, and those that measure times
alone. What is up to date is left, so that an interrupted call goes on where it was.
"""

from __future__ import annotations

import argparse
import enum
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tools.made_tables import FIGURES, Figures
from tools.tables import COMMIT, ROOT, Made, git, made_of, text_between_marks

AT_A_TIME = 2
"""Commands that measure no times; each works on one core."""


class State(enum.Enum):
    """The states of a table."""

    UP_TO_DATE = "up to date"
    OLD = "old"
    MISSING = "was never made"


@dataclass(frozen=True, slots=True)
class Table:
    """A table as it stands in its page.

    Attributes:
        name: Of its marks.
        figures: What makes it.
        made: What it was made on; None when it was never made.
        changes: The commits since then that changed what it depends on, the last one first.
    """

    name: str
    figures: Figures
    made: Made | None
    changes: tuple[str, ...]

    @property
    def state(self) -> State:
        """Say whether it is old."""
        if self.made is None:
            return State.MISSING
        return State.OLD if self.changes or self.made.changed else State.UP_TO_DATE

    def told(self) -> str:
        """Write a line for people."""
        line = f"{self.state.value:<14} {self.figures.page}: {self.name}"
        if self.made is None:
            return line
        when = f"made {self.made.date} on" if self.made.noted else f"made before {self.made.date}, with"
        line += f", {when} {self.made.commit}{' with changes' if self.made.changed else ''}"
        if not self.changes:
            return line
        return f"{line}; {len(self.changes)} changes since, the last: {self.changes[0]}"


def tables(root: Path = ROOT) -> Iterator[Table]:
    """Yield the tables of all pages, as they are in a checkout."""
    for figures in FIGURES:
        page = root / "docs" / figures.page
        for name in figures.tables:
            text = text_between_marks(page, name) if page.exists() else None
            made = made_of(text) if text is not None else None
            yield Table(name, figures, made, changes_since(made, figures.depends, root) if made else ())


def changes_since(made: Made, depends: Sequence[str], root: Path = ROOT) -> tuple[str, ...]:
    """Return the commits since a table was made that changed what it depends on, the last one first.

    Of a commit that this clone does not have, the date counts.
    """
    known = git("cat-file", "-t", f"{made.commit}^{{commit}}", root=root) == "commit"
    since = [f"{made.commit}..HEAD"] if known else [f"--since={made.date}T00:00:00Z", "HEAD"]
    return tuple(git("log", "--format=%h of %cs, %s", *since, "--", *depends, root=root).splitlines())


def chosen(only: str, found: Sequence[Table]) -> list[Figures]:
    """Return what makes the old tables of a page, of a name, or all.

    Raises:
        ValueError: There is no such page or table.
    """
    named = [t for t in found if only in ("all", t.name, Path(t.figures.page).stem)]
    if not named:
        names = sorted({name for t in found for name in (t.name, Path(t.figures.page).stem)})
        raise ValueError(f"there are no figures {only!r}; there are all, {', '.join(names)}")
    return list(dict.fromkeys(table.figures for table in named if table.state is not State.UP_TO_DATE))


def make(figures: Figures) -> str:
    """Run the command of some tables; returns why it could not, or how it failed, empty when it did not."""
    words = shlex.split(figures.command)
    missing = [word for word in words if word.startswith("../") and not (ROOT / word).exists()]
    if missing:
        return f"not here: {', '.join(missing)}"
    print(f"python {figures.command}", flush=True)
    code = subprocess.run([sys.executable, *words], cwd=ROOT, check=False).returncode
    # A benchmark that misses a limit, and trials that do, have written their figures.
    return f"ended with {code}: python {figures.command}" if code else ""


def make_all(todo: Sequence[Figures]) -> list[str]:
    """Run the commands of some tables, those that measure times one by one; returns what went wrong."""
    with ThreadPoolExecutor(AT_A_TIME) as pool:
        wrong = list(pool.map(make, [figures for figures in todo if not figures.alone]))
    wrong += [make(figures) for figures in todo if figures.alone]
    return [each for each in wrong if each]


def main(arguments: Sequence[str] | None = None) -> int:
    """List the tables or make some again; exit code 1 when a command failed, 2 for a name that is none."""
    parser = argparse.ArgumentParser(prog="python -m tools.figures", description=__doc__)
    parser.add_argument("--only", metavar="NAME", help="make those of a page or a name again, or all")
    given = parser.parse_args(arguments)
    if not COMMIT:
        print("this is no checkout of git: which tables are old cannot be told", file=sys.stderr)
        return 2 if given.only else 0
    found = list(tables())
    if not given.only:
        for table in sorted(found, key=lambda table: table.state is State.UP_TO_DATE):
            print(table.told())
        return 0
    try:
        todo = chosen(given.only, found)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    if not todo:
        print("all up to date")
    wrong = make_all(todo)
    print(*wrong, sep="\n", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
