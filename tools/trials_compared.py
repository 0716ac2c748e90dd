"""Compares runs of the same seeds: ``goto_user`` against late messages, drawn people, and the code before.

``python tools/trials_compared.py --write docs/notes/trials.md``
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_sweep.statistics import mcnemar

from florence_bt.runtime.run import RunStatus
from tools.tables import command_of, read_rows, table, write_table
from tools.trials import CLASSES, DRAWN_TABLE, EARLIER_TABLE, LATE_TABLE, NEW_TABLE, TABLE, Trial

PAGE = Path(__file__).resolve().parents[1] / "docs" / "notes" / "trials.md"
HEAD = ("class", "pairs", "good", "good, changed", "only before", "only changed", "p")
COMPARED = {
    "late against": (TABLE, LATE_TABLE),
    "drawn against": (TABLE, DRAWN_TABLE),
    "before against": (EARLIER_TABLE, NEW_TABLE),
}
"""Name of a table -> the two tables whose runs it compares."""
Pair = tuple[Trial, Trial]


def pairs_of(before: Sequence[Trial], changed: Sequence[Trial]) -> list[Pair]:
    """Return the runs of the same class and seed."""
    known = {(trial.situation, trial.seed): trial for trial in changed}
    return [
        (trial, known[trial.situation, trial.seed])
        for trial in before
        if (trial.situation, trial.seed) in known
    ]


def line(title: str, pairs: Sequence[Pair], holds: Callable[[Trial], bool]) -> list[str]:
    """Write how often something holds before and after, and in which pairs only once."""
    both = [(holds(before), holds(changed)) for before, changed in pairs]
    lost, won = both.count((True, False)), both.count((False, True))
    shares = (sum(each[place] for each in both) for place in (0, 1))
    return [title, str(len(both)), *map(str, shares), str(lost), str(won), f"{mcnemar(won, lost):.2f}"]


def table_of(pairs: Sequence[Pair]) -> str:
    """Write all classes, and below them what counts over all."""
    rows = [
        line(title, of, lambda trial: trial.good)
        for name, title in CLASSES.items()
        if (of := [pair for pair in pairs if pair[0].situation == name])
    ]
    people = [pair for pair in pairs if pair[0].end is not None]
    rows.append(line("all: good", pairs, lambda trial: trial.good))
    rows.append(line("with people: approached politely", people, lambda trial: trial.polite))
    rows.append(line("with people: the mission failed", people, _failed))
    rows.append(line("all: a false find", pairs, lambda trial: trial.false_find))
    return table(HEAD, rows)


def _failed(trial: Trial) -> bool:
    return trial.status is not RunStatus.SUCCEEDED


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables, and write them into the page when it is given."""
    parser = argparse.ArgumentParser(
        description="The runs of trials.md against late messages, drawn people and the code before"
    )
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the tables")
    given = parser.parse_args(arguments)
    for name, tables in COMPARED.items():
        before, changed = (read_rows(each.file_beside(PAGE), Trial) for each in tables)
        text = table_of(pairs_of(before, changed))
        print(name, text, sep="\n")
        if given.write is not None:
            write_table(given.write, name, text, command_of("tools/trials_compared.py", arguments))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
