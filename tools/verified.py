"""Verifies every shipped and every example mission, and writes the table: states, time, codes.

``python tools/verified.py --write docs/notes/verify.md``.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(1, str(Path(__file__).resolve().parents[1] / "examples" / "florence_greeter"))

from florence_bt.assurance.explorer import Limits
from florence_bt.assurance.report import verdict_on
from florence_bt.assurance.verifier import Verifier
from florence_bt.core.declaration import Kind, quantity_text
from florence_bt.trees.language.declarations import collect_declarations, skills_in
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary
from tools.tables import ROOT, RowTable, command_of, table

NAME = "verified"
FOLDERS = (
    "missions",
    "missions/first_steps",
    "florence_greeter/florence_greeter/missions",
    "foreign_robot/missions",
    "foreign_robot/hand_missions",
)
"""Folders of example missions; each has a library of its own."""


@dataclass(frozen=True, slots=True)
class Verified:
    """All that is known of a mission.

    Attributes:
        mission: Its name.
        states: How many states it has.
        steps: How many steps there are between them.
        cpu_s: How long the processor took, those that it calls included where nobody called them before.
        longest_s: How long the mission takes at most; infinite: as long as it takes.
        codes: How many codes it can fail with.
        holds: Whether everything holds.
        problems: How many things are reported, warnings too.
        coarse: Whether timers of more than 5 s were open.
    """

    mission: str
    states: int
    steps: int
    cpu_s: float
    longest_s: float
    codes: int
    holds: bool
    problems: int
    coarse: bool


def verified(names: Sequence[str]) -> Iterator[Verified]:
    """Verify the missions with these names, all when there are none."""
    greeter = {each.name: each for each in skills_in(import_module("florence_greeter.skills"))}
    declarations = {**collect_declarations(), **greeter}
    for folder in (BUILT_IN, *(ROOT / "examples" / each for each in FOLDERS)):
        library = MissionLibrary.load([] if folder == BUILT_IN else [folder])
        verifier = Verifier(library, declarations, Limits(120.0))
        for mission in library:
            if mission.file.parent == folder and (not names or mission.name in names):
                yield _verified(mission.name, verifier)


def _verified(name: str, verifier: Verifier) -> Verified:
    began = time.process_time()
    verdict = verdict_on(name, verifier)
    graph = verdict.explored.graph
    return Verified(
        name,
        len(graph.edges),
        sum(map(len, graph.edges)),
        round(time.process_time() - began, 2),
        verdict.longest_s,
        len(verdict.codes),
        verdict.holds,
        len(verdict.problems),
        verdict.explored.world.coarse,
    )


HEAD = ["mission", "states", "steps", "CPU", "takes at most", "codes", ""]


def table_of(rows: Sequence[Verified]) -> str:
    """Write the table, with a total."""
    lines = [
        [
            f"`{each.mission}`" + (" (times open)" if each.coarse else ""),
            str(each.states),
            str(each.steps),
            f"{each.cpu_s:.1f} s",
            "as long as it takes" if math.isinf(each.longest_s) else _duration(each.longest_s),
            str(each.codes),
            "holds" if each.holds and not each.problems else f"{each.problems} PROBLEMS",
        ]
        for each in rows
    ]
    sums = [str(sum(each.states for each in rows)), str(sum(each.steps for each in rows))]
    cpu = f"{sum(each.cpu_s for each in rows):.0f} s"
    good = sum(each.holds and not each.problems for each in rows)
    return table(HEAD, [*lines, ["all", *sums, cpu, "", "", f"{good} of {len(rows)} hold"]])


def _duration(seconds: float) -> str:
    return quantity_text(math.ceil(seconds), Kind.DURATION, 3)


TABLE = RowTable(NAME, Verified, table_of)


def main(arguments: list[str] | None = None) -> int:
    """Verify, print, and write the table; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missions", nargs="*", default=[], help="only these")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    given = parser.parse_args(arguments)
    TABLE.publish(list(verified(given.missions)), given.write, command_of("tools/verified.py", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
