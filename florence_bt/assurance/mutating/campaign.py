"""All small changes of a mission, looked at one after the other or several at a time, and what came of it."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

from florence_bt.assurance.mutating.draft import Draft
from florence_bt.assurance.mutating.judging import (
    EQUIVALENT,
    PROPERTIES,
    REFUSED,
    SCENARIOS,
    Judge,
    Judged,
)
from florence_bt.assurance.mutating.mission_mutations import Mutation, mutations_of
from florence_bt.trees.language.code_groups import groups_of
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.parse import parse_mission

NOTICED = (REFUSED, SCENARIOS, PROPERTIES)
"""The verdicts on changes that somebody notices."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """All that came of the changes of a mission.

    Attributes:
        mission: The mission.
        judged: The changes, in the order of the file.
        drafts: Scenarios that together notice what nobody notices, as far as one does; few.
    """

    mission: Mission
    judged: tuple[Judged, ...]
    drafts: tuple[Draft, ...]

    @property
    def counting(self) -> int:
        """Count the changes that are not equivalent to the original, as far as is known."""
        return sum(each.verdict != EQUIVALENT for each in self.judged)

    @property
    def noticed(self) -> int:
        """Count the changes that somebody notices."""
        return sum(each.verdict in NOTICED for each in self.judged)

    @property
    def left(self) -> list[Judged]:
        """Return the changes that nobody notices and that are not known to be equivalent."""
        return [each for each in self.judged if each.verdict not in (*NOTICED, EQUIVALENT)]


def run_campaign(judge: Judge, jobs: int = 1) -> Campaign:
    """Look at every small change of a mission.

    Args:
        judge: Looks at one.
        jobs: How many are looked at at a time, each in a process of its own.

    Raises:
        ConfigError: A scenario of the mission fails already.
    """
    judge.see_that_all_pass()
    mutations = mutations_of(judge.mission.text, groups_of(judge.original.declarations))
    judged = tuple(_judged(judge, mutations, jobs))
    drafts, shown = _few_of(judge, [each for each in judged if each.draft is not None])
    known = [replace(each, by=shown.get(each.mutation.text, each.by)) for each in judged]
    return Campaign(judge.mission, tuple(known), tuple(drafts))


_JUDGES: list[Judge] = []
"""The judge of a process that was forked from the one that has it."""


def _judged(judge: Judge, mutations: Sequence[Mutation], jobs: int) -> Iterable[Judged]:
    if jobs < 2 or len(mutations) < 2:
        return map(judge.judge, mutations)
    judge.prepare()
    _JUDGES.append(judge)
    try:
        with ProcessPoolExecutor(jobs, multiprocessing.get_context("fork")) as pool:
            return list(pool.map(_judge, mutations))
    finally:
        _JUDGES.remove(judge)


def _judge(mutation: Mutation) -> Judged:
    return _JUDGES[-1].judge(mutation)


def _few_of(judge: Judge, unnoticed: Sequence[Judged]) -> tuple[list[Draft], dict[str, str]]:
    """Choose few scenarios that together notice all that one of them does: what notices most comes first.

    Returns:
        The scenarios, with names of their own; and the text of a changed mission -> the name of its scenario.
    """
    missions = {
        each.mutation.text: parse_mission(each.mutation.text, judge.mission.file) for each in unnoticed
    }
    drafts = [each.draft for each in unnoticed if each.draft is not None]
    notices = [
        frozenset(text for text, mission in missions.items() if not judge.passes(draft, [mission]))
        for draft in drafts
    ]
    names, chosen, shown = set(judge.scenario_text.names), list[Draft](), dict[str, str]()
    left = set(missions)
    while left:
        best = max(range(len(drafts)), key=lambda number: len(notices[number] & left))
        if not notices[best] & left:
            break
        named = replace(drafts[best], name=next(_names(drafts[best].name, names)))
        names.add(named.name)
        chosen.append(named)
        shown |= dict.fromkeys(notices[best] & left, named.name)
        left -= notices[best]
    return chosen, shown


def _names(name: str, taken: set[str]) -> Iterator[str]:
    """Yield names for a scenario that no other one has."""
    if name not in taken:
        yield name
    for number in range(2, len(taken) + 3):
        if (other := f"{name}, case {number}") not in taken:
            yield other


def counts_of(judged: Iterable[Judged]) -> dict[str, dict[str, int]]:
    """Count the verdicts: kind of change -> verdict -> how many."""
    counts: dict[str, dict[str, int]] = {}
    for each in judged:
        row = counts.setdefault(each.mutation.family, {})
        row[each.verdict] = row.get(each.verdict, 0) + 1
    return counts
