"""What a sweep has shown, as tables for people."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from florence_sweep.outcome import BROKEN, NOT_RUN, Outcome
from florence_sweep.statistics import mcnemar, wilson

MOST_REASONS = 8
MOST_WORST = 10

Table = tuple[list[str], list[list[str]]]
"""The head and the lines of a table."""


def share(hits: int, of: int) -> str:
    """Write a share with its interval: ``18 of 20 (70 to 97 %)``."""
    if not of:
        return ""
    low, high = wilson(hits, of)
    return f"{hits} of {of} ({100 * low:.0f} to {100 * high:.0f} %)"


def variations_of(outcomes: Iterable[Outcome]) -> dict[str, list[Outcome]]:
    """Return the outcomes by what was varied, in the order of the experiment."""
    found: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        found.setdefault(outcome.variation, []).append(outcome)
    return found


def table_of(outcomes: Sequence[Outcome]) -> Table:
    """Return a line for each variation, and one for all."""
    head = ["", "good", "succeeded", "polite", "contacts", "false finds", "median time", "to ideal"]
    by_variation = variations_of(outcomes)
    lines = [_line(name or "runs", of) for name, of in by_variation.items()]
    return head, [*lines, _line("all", outcomes)] if len(by_variation) > 1 else lines


def _line(title: str, outcomes: Sequence[Outcome]) -> list[str]:
    run = [each for each in outcomes if each.was_run]
    met = [each for each in run if each.polite is not None]
    good = [each for each in run if each.good]
    ratios = [each.seconds / each.ideal for each in good if each.ideal]
    return [
        title,
        share(len(good), len(run)),
        str(sum(each.status == "SUCCEEDED" for each in run)),
        share(sum(bool(each.polite) for each in met), len(met)),
        str(sum(len(each.contacts) for each in run)),
        str(sum(each.false_find for each in run)),
        f"{statistics.median(each.seconds for each in good):.0f} s" if good else "",
        f"{statistics.median(ratios):.1f}" if ratios else "",
    ]


def reasons_of(outcomes: Iterable[Outcome]) -> Table:
    """Return why runs were not good, the most frequent first, each with a run to look at."""
    found: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        if not outcome.good:
            found.setdefault(why(outcome), []).append(outcome)
    ranked = sorted(found.items(), key=lambda each: (-len(each[1]), each[0]))[:MOST_REASONS]
    lines = [[str(len(of)), text, str(of[0].number), of[0].reason] for text, of in ranked]
    return ["runs", "not good because", "such as number", "which said"], lines


def why(outcome: Outcome) -> str:
    """Say in some words what is not good about a run."""
    if outcome.status == NOT_RUN:
        return "the home has no place for it"
    if outcome.status == BROKEN:
        return "the program broke down"
    parts = [f"touched {', '.join(sorted(set(outcome.contacts)))}"] if outcome.contacts else []
    parts += ["found somebody where nobody is"] if outcome.false_find else []
    if outcome.status != "SUCCEEDED":
        parts.append(f"{outcome.status} {outcome.code}".strip())
    elif outcome.polite is False:
        parts.append("succeeded, but does not stand politely")
    return "; ".join(parts) or "succeeded"


def worst_of(outcomes: Iterable[Outcome]) -> list[Outcome]:
    """Return the runs to look at first: broken ones, then those that touched or lied, then failures."""

    def badness(outcome: Outcome) -> tuple[int, float]:
        lied = outcome.status == "SUCCEEDED" and outcome.polite is False
        weight = (
            8 * (outcome.status == BROKEN) + 4 * len(outcome.contacts) + 3 * lied + 2 * outcome.false_find
        )
        return weight, outcome.seconds

    bad = [each for each in outcomes if not each.good and each.status != NOT_RUN]
    return sorted(bad, key=badness, reverse=True)[:MOST_WORST]


@dataclass(frozen=True, slots=True)
class Compared:
    """Two sets of runs on the same seeds, of one variation.

    Attributes:
        both: Pairs in which both were good.
        gained: Only the second.
        lost: Only the first.
        neither: Neither.
    """

    both: int
    gained: int
    lost: int
    neither: int

    @property
    def chance(self) -> float:
        """The probability that chance alone parts the pairs so unevenly or more."""
        return mcnemar(self.gained, self.lost)


def compared(
    first: Iterable[Outcome], second: Iterable[Outcome], key: Callable[[Outcome], object]
) -> Compared:
    """Compare runs that have the same key."""
    other = {key(each): each.good for each in second if each.was_run}
    pairs = Counter((each.good, other[key(each)]) for each in first if each.was_run and key(each) in other)
    return Compared(pairs[True, True], pairs[False, True], pairs[True, False], pairs[False, False])


def comparison_of(first: Sequence[Outcome], second: Sequence[Outcome]) -> Table:
    """Return two sweeps side by side, paired by variation and seed."""
    head = ["", "first good", "second good", "only second", "only first", "by chance"]
    lines = []
    there = variations_of(second)
    for name, here in variations_of(first).items():
        if name in there:
            lines.append(_compared_line(name or "runs", here, there[name], lambda each: each.seed))
    if len(lines) > 1:
        lines.append(_compared_line("all", first, second, lambda each: (each.variation, each.seed)))
    return head, lines


def variations_side_by_side(outcomes: Sequence[Outcome]) -> Table:
    """Return each variation beside the first one, paired by seed."""
    head = ["", "first good", "this good", "only this", "only first", "by chance"]
    (first, base), *others = variations_of(outcomes).items()
    lines = [
        _compared_line(f"{name} beside {first}", base, of, lambda each: each.seed) for name, of in others
    ]
    return head, lines


def _compared_line(
    title: str, first: Sequence[Outcome], second: Sequence[Outcome], key: Callable[[Outcome], object]
) -> list[str]:
    found = compared(first, second, key)
    of = found.both + found.gained + found.lost + found.neither
    return [
        title,
        share(found.both + found.lost, of),
        share(found.both + found.gained, of),
        str(found.gained),
        str(found.lost),
        f"{100 * found.chance:.0f} %" if found.gained + found.lost else "",
    ]
