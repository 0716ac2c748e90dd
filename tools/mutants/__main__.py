"""Tells which small changes of the code no test notices.

``python -m tools.mutants`` draws mutations of the core places by chance, and runs for each the tests
that run its line; ``FILE...`` are modules or folders to look at instead, ``--changed main`` lines that differ
from a commit. What is unnoticed stands in the output as a change of a line; what cannot be noticed (an
equivalent mutant) belongs into ``tests/equivalent_mutants.yaml``, with the reason.
"""

from __future__ import annotations

import argparse
import math
import queue
import random
import re
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import yaml

from tools.mutants.covering import Covering, files_over_ros, measure, sum_of_code_and_tests
from tools.mutants.mutations import Mutation, draw
from tools.mutants.trying import Copy, Verdict
from tools.mutants.verdicts import Verdicts
from tools.tables import BUILD, ROOT, RowTable, command_of, git, table

EQUIVALENT = ROOT / "tests" / "equivalent_mutants.yaml"
AREAS = {
    "language": ("trees/language",),
    "checks": ("trees/checks",),
    "ticking": ("behaviours",),
    "executor, journal": ("runtime",),
    "planner, costmaps": ("skills/navigation/navigate",),
    "localisation, maps": ("skills/navigation/localisation", "skills/navigation/map_server"),
    "hotspots, zones": ("skills/locator",),
    "filters": ("skills/filters",),
    "codecs, drivers": ("drivers",),
    "supervisor": ("app/bringup", "core"),
}
"""The core places, below ``florence_bt``."""


@dataclass(frozen=True, slots=True)
class Tried:
    """A mutation and what the tests said.

    Attributes:
        area: Of :data:`AREAS`; the module when others were asked for.
        path: The module.
        line: The line, from 1.
        family: The kind of change.
        before: The line as it is.
        after: What stood there instead.
        verdict: What the tests said.
        equivalent: Why nobody can notice it, empty where somebody could.
    """

    area: str
    path: str
    line: int
    family: str
    before: str
    after: str
    verdict: Verdict
    equivalent: str


def _text(rows: Sequence[Tried]) -> str:
    lines = []
    for area in [*dict.fromkeys(row.area for row in rows), ""]:
        mine = [row for row in rows if area in ("", row.area)]
        equal = sum(bool(row.equivalent) for row in mine)
        noticed = sum(row.verdict.is_noticed for row in mine)
        over_ros = sum(row.verdict is Verdict.OVER_ROS for row in mine)
        share = f"{100.0 * noticed / max(len(mine) - equal, 1):.0f} %"
        numbers = len(mine), equal, noticed, over_ros
        lines.append([area or "**all**", *map(str, numbers), share])
    head = ["place", "mutants", "of them equivalent", "noticed", "of them only over ROS"]
    return table([*head, "noticed of those that are not equivalent"], lines)


TABLE = RowTable("mutants", Tried, _text)


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw mutations, try them, and print what was not noticed."""
    options = _options().parse_args(arguments)
    began = time.monotonic()
    wanted = [*_drawn(options)]
    random.Random(options.seed).shuffle(wanted)  # when the time is over, every place has been looked at
    covering = measure(
        {mutation.path for _, mutation in wanted}, options.jobs, began + 30.0 * options.minutes
    )
    rows = list(_tried(wanted, covering, options, began + 60.0 * options.minutes))
    missed = [row for row in rows if not row.verdict.is_noticed and not row.equivalent]
    for row in missed:
        print(f"{row.path}:{row.line}: {row.verdict.value}\n    - {row.before}\n    + {row.after}")
    TABLE.publish(rows, options.write, command_of("-m tools.mutants", arguments))
    return 1 if options.changed and missed and not options.tell else 0


def _options() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="mutants", description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", help="modules or folders (the core places when not given)")
    parser.add_argument("--count", type=int, default=40, help="of each place, or file (default: %(default)s)")
    parser.add_argument("--seed", default="1", help="another one draws others (default: %(default)s)")
    parser.add_argument(
        "--changed", metavar="COMMIT", help="only lines that differ from a commit; fails on a miss"
    )
    parser.add_argument("--tell", action="store_true", help="do not fail on a miss")
    parser.add_argument(
        "--minutes",
        type=float,
        default=math.inf,
        help="end after these, of which half at most goes into which tests run which lines",
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes (default: %(default)s)")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the table into a page")
    return parser


def _drawn(options: argparse.Namespace) -> Iterator[tuple[str, Mutation]]:
    for area, paths in _places(options).items():
        for path, count in paths.items():
            lines = list(_changed_lines(options.changed, path)) if options.changed else []
            if lines or not options.changed:
                for mutation in draw(path, (ROOT / path).read_text(), count, f"{options.seed} {path}", lines):
                    yield area, mutation


def _places(options: argparse.Namespace) -> dict[str, dict[str, int]]:
    """Return how many mutations of which modules, by place: in proportion to the modules' lines."""
    if options.changed and not options.files:
        changed = git("diff", "--name-only", options.changed, "--", "florence_bt").splitlines()
        areas = {path: [path] for path in changed if path.endswith(".py") and (ROOT / path).exists()}
    elif options.files:
        areas = {file: sorted(_modules(ROOT / file)) for file in options.files}
    else:
        areas = {
            area: sorted(path for folder in folders for path in _modules(ROOT / "florence_bt" / folder))
            for area, folders in AREAS.items()
        }
    return {area: _shares(paths, options.count, options.seed) for area, paths in areas.items()}


def _modules(place: Path) -> Iterator[str]:
    for file in place.rglob("*.py") if place.is_dir() else [place]:
        yield str(file.relative_to(ROOT))


def _shares(paths: Sequence[str], count: int, seed: str) -> dict[str, int]:
    """Divide mutations among modules by chance, a line for a line."""
    lines = [path for path in paths for _ in (ROOT / path).read_text().splitlines()]
    drawn = random.Random(seed).choices(lines, k=count) if lines else []
    return {path: drawn.count(path) for path in paths if path in drawn}


def _changed_lines(commit: str, path: str) -> Iterator[range]:
    for line in git("diff", "-U0", commit, "--", path).splitlines():
        found = re.match(r"@@ .* \+(\d+)(?:,(\d+))? @@", line)
        if found:
            begin, length = int(found[1]), int(found[2] or 1)
            yield range(begin, begin + length)


def _tried(
    wanted: Sequence[tuple[str, Mutation]], covering: Covering, options: argparse.Namespace, end: float
) -> Iterator[Tried]:
    copies: queue.SimpleQueue[Copy] = queue.SimpleQueue()
    for number in range(options.jobs):
        copies.put(Copy(BUILD / "mutants" / f"copy-{number}"))
    reasons = _equivalent()
    kept = Verdicts(BUILD / "mutants" / f"verdicts-{sum_of_code_and_tests()}.txt")

    def tried(area: str, mutation: Mutation) -> Tried | None:
        copy = copies.get()
        try:
            if time.monotonic() > end:
                return None
            tests, over_ros = covering.tests_of(mutation.path, mutation.line), files_over_ros(mutation.path)
            verdict = kept.of(mutation, [*tests, *over_ros])
            if verdict is None:
                verdict = copy.judge(mutation, tests, over_ros, end)
                if verdict is None:
                    return None
                kept.keep(mutation, [*tests, *over_ros], verdict)
        finally:
            copies.put(copy)
        print(f"{verdict.value:<16} {mutation.path}:{mutation.line}", file=sys.stderr, flush=True)
        reason = reasons.get((mutation.path, mutation.before, mutation.after), "")
        what = mutation.line, mutation.family, mutation.before, mutation.after
        return Tried(area, mutation.path, *what, verdict, "" if verdict.is_noticed else reason)

    with ThreadPoolExecutor(options.jobs) as pool:
        rows = [row for row in pool.map(lambda pair: tried(*pair), wanted) if row is not None]
    if len(rows) < len(wanted):
        print(
            f"{len(wanted) - len(rows)} of {len(wanted)} were not tried: the time was over", file=sys.stderr
        )
    yield from rows


def _equivalent() -> dict[tuple[str, str, str], str]:
    """Return why a mutation cannot be noticed, by module, line and what stood there instead."""
    if not EQUIVALENT.exists():
        return {}
    entries: Iterable[dict[str, str]] = yaml.safe_load(EQUIVALENT.read_text()) or ()
    return {(each["path"], each["before"], each["after"]): each["reason"] for each in entries}


if __name__ == "__main__":
    sys.exit(main())
