"""Changes every shipped and every example mission in small ways, and writes the table of who notices them.

``python tools/mutated.py --write docs/notes/mutate.md``. The mission of ``florence_greeter`` is left out: its
skill is there only where that package is installed.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.app.mission_files.mutating import MutateOptions, judge_of
from florence_bt.assurance.mutating.campaign import Campaign, run_campaign
from florence_bt.assurance.mutating.judging import (
    EQUIVALENT,
    PROPERTIES,
    REFUSED,
    SCENARIOS,
    UNDECIDED,
    UNNOTICED,
    Judge,
)
from florence_bt.assurance.mutating.mutation_report import report_of
from florence_bt.assurance.mutating.scenario_text import MARK
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary
from tools.tables import ROOT, RowTable, command_of, read_rows, table
from tools.verified import FOLDERS

NAME = "mutated"
PLACES = (BUILT_IN, *(ROOT / "examples" / each for each in FOLDERS if "greeter" not in each))
"""Folders of missions; each has a library of its own."""
LIMIT_S = 5.0
"""Seconds of the processor for which the verifier may look at one change."""


@dataclass(frozen=True, slots=True)
class Mutated:
    """All that is known of the small changes of a mission.

    Attributes:
        mission: Its name.
        tried: How many changes there are.
        refused: How many of them the check refuses.
        by_scenarios: How many its scenarios notice first.
        by_added: How many of these only scenarios notice that ``--write`` added.
        by_properties: How many its properties notice first.
        equivalent: How many make no difference.
        undecided: How many were not told apart from the mission, nor proved to be equivalent.
        unnoticed: How many make a difference that nobody notices.
        seconds: How long it took.
    """

    mission: str
    tried: int
    refused: int
    by_scenarios: int
    by_added: int
    by_properties: int
    equivalent: int
    undecided: int
    unnoticed: int
    seconds: float


def mutated(names: Sequence[str], jobs: int) -> Iterator[Mutated]:
    """Change the missions with these names, all when there are none."""
    for folder in PLACES:
        library = MissionLibrary.load([] if folder == BUILT_IN else [folder])
        for mission in library:
            if mission.file.parent == folder and (not names or mission.name in names):
                yield _mutated(judge_of(mission.name, library, MutateOptions(limit_s=LIMIT_S)), jobs)


def _mutated(judge: Judge, jobs: int) -> Mutated:
    began = time.monotonic()
    campaign = run_campaign(judge, jobs)
    print(report_of(campaign), end="\n\n", flush=True)
    counts = Counter(each.verdict for each in campaign.judged)
    return Mutated(
        judge.name,
        len(campaign.judged),
        counts[REFUSED],
        counts[SCENARIOS],
        _by_added(judge, campaign),
        counts[PROPERTIES],
        counts[EQUIVALENT],
        counts[UNDECIDED],
        counts[UNNOTICED],
        round(time.monotonic() - began, 1),
    )


def _by_added(judge: Judge, campaign: Campaign) -> int:
    """Count the changes that no scenario notices before the first one that was added."""
    above, mark, _ = judge.scenario_text.text.partition(MARK)
    if not mark:
        return 0
    scenarios = read_scenarios(judge.new_file, Libraries(judge.folders)).scenarios
    added = {each.name for each in scenarios if each.position.line > above.count("\n")}
    return sum(each.verdict == SCENARIOS and each.by in added for each in campaign.judged)


HEAD = [
    "mission",
    "changes",
    "refused",
    "scenarios",
    "properties",
    "equivalent",
    "not told apart",
    "unnoticed",
]
SHARES = ["noticed before", "noticed"]


def table_of(rows: Sequence[Mutated]) -> str:
    """Write the table, with a total."""
    total = Mutated(
        "all",
        *(sum(getattr(each, name) for each in rows) for name in Mutated.__slots__[1:-1]),
        sum(each.seconds for each in rows),
    )
    return table([*HEAD, *SHARES], [_line(each) for each in (*rows, total)])


def _line(row: Mutated) -> list[str]:
    counting = row.tried - row.equivalent
    noticed = row.refused + row.by_scenarios + row.by_properties
    numbers = (row.tried, row.refused, row.by_scenarios, row.by_properties, row.equivalent)
    return [
        f"`{row.mission}`" if row.mission != "all" else "all",
        *map(str, (*numbers, row.undecided, row.unnoticed)),
        _share(noticed - row.by_added, counting),
        _share(noticed, counting),
    ]


def _share(part: int, whole: int) -> str:
    return f"{100.0 * part / whole:.0f} %" if whole else ""


TABLE = RowTable(NAME, Mutated, table_of)


def main(arguments: list[str] | None = None) -> int:
    """Change, print, and write the table; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missions", nargs="*", default=[], help="only these; others keep their rows")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="changes at a time")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    given = parser.parse_args(arguments)
    os.chdir(ROOT)  # the scenarios of the missions that come with Florence lie there
    rows = list(mutated(given.missions, given.jobs))
    if given.missions and given.write is not None:
        rows = with_kept(rows, TABLE.file_beside(given.write))
    TABLE.publish(rows, given.write, command_of("tools/mutated.py", ["--write", "docs/notes/mutate.md"]))
    return 0


def with_kept(rows: Sequence[Mutated], file: Path) -> list[Mutated]:
    """Return rows with those that a file has of other missions, in the order of the missions."""
    known = {each.mission: each for each in (read_rows(file, Mutated) if file.exists() else ())}
    known |= {each.mission: each for each in rows}
    return [
        known[path.stem] for place in PLACES for path in sorted(place.glob("*.yaml")) if path.stem in known
    ]


if __name__ == "__main__":
    sys.exit(main())
