"""What a sweep has shown, as tables for people."""

from __future__ import annotations

import itertools
import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

from florence_sweep.experiment import Experiment
from florence_sweep.outcome import ALL_SEEN, BROKEN, CRITERIA, KEPT, NOT_RUN, Outcome
from florence_sweep.statistics import mcnemar, wilson

MOST_REASONS = 8
MOST_WORST = 10

HEAD = ["", "runs", "good", "succeeded", "could be seen", "polite", "contacts", "false finds", "median time"]
HEAD += ["to ideal"]

Table = tuple[list[str], list[list[str]]]
"""The head and the lines of a table."""


def share(hits: int, of: int) -> str:
    """Write a share with its interval: ``18 of 20 (70 to 97 %)``."""
    if not of:
        return ""
    low, high = wilson(hits, of)
    return f"{hits} of {of} ({100 * low:.0f} to {100 * high:.0f} %)"


def chance(probability: float) -> str:
    """Write a probability: ``38 %``, ``4.2 %``, ``below 0.1 %``."""
    if probability < 0.001:
        return "below 0.1 %"
    return f"{100 * probability:.{1 if probability < 0.1 else 0}f} %"


def variations_of(outcomes: Iterable[Outcome]) -> dict[str, list[Outcome]]:
    """Return the outcomes by what was varied, in the order of the experiment."""
    found: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        found.setdefault(outcome.variation, []).append(outcome)
    return found


def table_of(outcomes: Sequence[Outcome]) -> Table:
    """Return a line for each variation, and one for all."""
    return _table_by(variations_of(outcomes), outcomes)


def table_of_experiment(experiment: Experiment, outcomes: Sequence[Outcome]) -> Table:
    """Return what came of an experiment, a line for each value of each factor and one for all.

    Factors that it compares (``compare``) keep their first value: what the others change is told by
    :func:`comparisons_along`.
    """
    (_, *head), lines = _table_by(*_groups(experiment, outcomes))
    kept = [experiment.factors[each][0] for each in experiment.compare]
    return [f"with {' and '.join(kept)}" if kept else "", *head], lines


def _groups(
    experiment: Experiment, outcomes: Iterable[Outcome]
) -> tuple[dict[str, list[Outcome]], list[Outcome]]:
    """Return the outcomes by each value of what is not compared, and all of them."""
    values = experiment.values()
    kept = {experiment.factors[each][0] for each in experiment.compare}
    shown = [each for each in outcomes if kept <= {*values[each.variation]}]
    varied = [of for factor, of in experiment.factors.items() if factor not in experiment.compare]
    groups = {
        value: of
        for value in itertools.chain(*varied)
        if (of := [each for each in shown if value in values[each.variation]])
    }
    return groups or {"": shown}, shown


def measures_of(experiment: Experiment, outcomes: Sequence[Outcome]) -> Table:
    """Return what is measured in runs of a kind alone: how often it holds, or its mean, least and most."""
    groups, shown = _groups(experiment, outcomes)
    names = list(dict.fromkeys(itertools.chain(*(each.measures for each in shown))))

    def line(title: str, of: Iterable[Outcome]) -> list[str]:
        measured = [each.measures for each in of if each.measures]
        return [title, *(_measure([each[name] for each in measured]) for name in names)]

    lines = [line(title or "runs", of) for title, of in groups.items()]
    return ["", *names], lines if names else []


def _measure(values: Sequence[bool | float]) -> str:
    if not values:
        return ""
    if all(isinstance(each, bool) for each in values):
        return share(sum(map(bool, values)), len(values))
    mean, least, most = (f"{of(values):.2f}" for of in (statistics.fmean, min, max))
    return f"{mean} ({least} to {most})"


def _table_by(groups: Mapping[str, Sequence[Outcome]], outcomes: Sequence[Outcome]) -> Table:
    lines = [_line(name or "runs", of) for name, of in groups.items()]
    return list(HEAD), [*lines, _line("all", outcomes)] if len(groups) > 1 else lines


def _line(title: str, outcomes: Sequence[Outcome]) -> list[str]:
    run = [each for each in outcomes if each.was_run]
    met = [each for each in run if each.polite is not None]
    good = [each for each in run if each.good]
    ratios = [each.seconds / each.ideal for each in good if each.ideal]
    return [
        title,
        str(len(run)),
        share(len(good), len(run)),
        str(sum(map(CRITERIA["succeeded"], run))),
        str(sum(bool(each.visible) for each in met)) if met else "",
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
    parts += ["was not with the person in the end"] if outcome.measures.get(KEPT) is False else []
    parts += ["did not see every room"] if outcome.measures.get(ALL_SEEN) is False else []
    if outcome.status == "STOPPED" and parts:
        return "; ".join(parts)
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
    """Pairs of runs on the same seeds, and whether something holds in them.

    Attributes:
        both: Pairs in which it holds in both.
        gained: Only in the second.
        lost: Only in the first.
        neither: In neither.
    """

    both: int
    gained: int
    lost: int
    neither: int

    @property
    def pairs(self) -> int:
        """The number of pairs."""
        return self.both + self.gained + self.lost + self.neither

    @property
    def chance(self) -> float:
        """The probability that chance alone parts the pairs so unevenly or more."""
        return mcnemar(self.gained, self.lost)

    def line(self, title: str) -> list[str]:
        """Write it as a line of a table."""
        return [
            title,
            share(self.both + self.lost, self.pairs),
            share(self.both + self.gained, self.pairs),
            str(self.gained),
            str(self.lost),
            chance(self.chance) if self.gained + self.lost else "",
        ]


Pair = tuple[Outcome, Outcome]
_COMPARISON = ["", "first good", "second good", "only second", "only first", "by chance"]


def compared(pairs: Iterable[Pair], holds: Callable[[Outcome], bool] = attrgetter("good")) -> Compared:
    """Compare pairs of runs by what holds in them; without a word by whether they are good."""
    found = Counter((holds(first), holds(second)) for first, second in pairs)
    return Compared(found[True, True], found[False, True], found[True, False], found[False, False])


def pairs_of(
    first: Iterable[Outcome], second: Iterable[Outcome], key: Callable[[Outcome], object]
) -> list[Pair]:
    """Return the runs that have the same key, of those that were run."""
    other = {key(each): each for each in second if each.was_run}
    return [(each, other[key(each)]) for each in first if each.was_run and key(each) in other]


def comparison_of(first: Sequence[Outcome], second: Sequence[Outcome]) -> Table:
    """Return two sweeps side by side, paired by variation and seed."""
    pairs = pairs_of(first, second, lambda each: (each.variation, each.seed))
    by_variation: dict[str, list[Pair]] = {}
    for pair in pairs:
        by_variation.setdefault(pair[0].variation, []).append(pair)
    lines = [compared(of).line(name or "runs") for name, of in by_variation.items()]
    return _COMPARISON, [*lines, compared(pairs).line("all")] if len(lines) > 1 else lines


def comparisons_along(experiment: Experiment, outcomes: Sequence[Outcome]) -> list[Table]:
    """Return each value of a factor beside its first one, on the same seeds and with the other factors equal.

    Of factors that the experiment names (``compare``) each value has a table of its own, with what the runs
    are asked to be and with the values of the other factors; else each has a line.
    """
    sides = [
        (first, value, pairs)
        for place, (factor, (first, *others)) in enumerate(experiment.factors.items())
        if factor in (experiment.compare or experiment.factors)
        for value in others
        if (pairs := _paired_along(experiment, outcomes, place, (first, value)))
    ]
    if experiment.compare:
        return [_in_full(experiment, *side) for side in sides]
    lines = [compared(pairs).line(f"{value} beside {first}") for first, value, pairs in sides]
    return [(_COMPARISON, lines)] if lines else []


def _paired_along(
    experiment: Experiment, outcomes: Sequence[Outcome], place: int, sides: tuple[str, str]
) -> list[Pair]:
    """Return the runs that differ in one factor alone."""
    values = experiment.values()

    def others(outcome: Outcome) -> object:
        of = values[outcome.variation]
        return (*of[:place], *of[place + 1 :], outcome.seed)

    first, second = ([each for each in outcomes if values[each.variation][place] == side] for side in sides)
    return pairs_of(first, second, others)


def _in_full(experiment: Experiment, first: str, second: str, pairs: Sequence[Pair]) -> Table:
    head = [f"{second} beside {first}", "first", "second", "only second", "only first", "by chance"]
    asked = dict.fromkeys(each for setup in experiment.variations.values() for each in setup.good)
    lines = [compared(pairs).line("good")]
    for criterion in asked:
        of = [pair for pair in pairs if criterion in experiment.variations[pair[0].variation].good]
        lines.append(compared(of, CRITERIA[criterion]).line(criterion.replace("_", " ")))
    values = experiment.values()
    for value in itertools.chain(*experiment.factors.values()):
        of = [pair for pair in pairs if value in values[pair[0].variation]]
        if of and value != first:
            lines.append(compared(of).line(f"good with {value}"))
    return head, lines
