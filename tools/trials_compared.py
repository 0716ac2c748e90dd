"""Compares runs of the same seeds: ``goto_user`` as it is against late messages, and against drawn people.

``python tools/trials_compared.py --write docs/notes/trials.md``
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.runtime.run import RunStatus
from tools.tables import command_of, read_rows, table, write_table
from tools.trials import CLASSES, DRAWN_TABLE, LATE_TABLE, TABLE, Trial

PAGE = Path(__file__).resolve().parents[1] / "docs" / "notes" / "trials.md"
HEAD = ("class", "pairs", "good", "good, changed", "only before", "only changed", "p")
CHANGED = {"late against": LATE_TABLE, "drawn against": DRAWN_TABLE}
"""Name of a table -> the runs that are compared with those of the table ``trials``."""
Pair = tuple[Trial, Trial]


def chance_of(one: int, other: int) -> float:
    """Return how likely so uneven a share of the pairs that differ is if both ways are as likely.

    Args:
        one: Pairs in which only the first is so.
        other: Pairs in which only the second is.

    Source: McNemar's test in its exact form, two-sided.
    """
    differing, fewer = one + other, min(one, other)
    tail = sum(math.comb(differing, count) for count in range(fewer + 1)) / 2.0**differing
    return min(1.0, 2.0 * tail)


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
    return [title, str(len(both)), *map(str, shares), str(lost), str(won), f"{chance_of(lost, won):.2f}"]


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
        description="The runs of trials.md against late messages and drawn people"
    )
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the tables")
    given = parser.parse_args(arguments)
    before = read_rows(TABLE.file_beside(PAGE), Trial)
    for name, runs in CHANGED.items():
        text = table_of(pairs_of(before, read_rows(runs.file_beside(PAGE), Trial)))
        print(name, text, sep="\n")
        if given.write is not None:
            write_table(given.write, name, text, command_of("tools/trials_compared.py", arguments))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
