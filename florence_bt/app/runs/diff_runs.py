"""Compares two recorded runs: the first thing that one does and the other does not, and why."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from py_trees.common import Status

from florence_bt.app.runs.journal_view import journal_folder, read_run
from florence_bt.core.declaration import Kind
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.journal import JournaledEvent, JournaledRun
from florence_bt.runtime.journal.text import event_words, match_ends, with_one_clock
from florence_bt.runtime.replay.moments import FROM_OUTSIDE, TICKED
from florence_bt.runtime.status import values_text
from florence_bt.trees.language.declarations import collect_declarations

MOST_VALUES = 5
"""Values that are listed at most, of those that differed before two runs parted."""


@dataclass(frozen=True, slots=True)
class RunSide:
    """One of two runs that are compared.

    Attributes:
        row: The run.
        events: What is compared of it, in order: not the questions that were asked again in the background
            and answered as before.
        started: When it began, on the clock of its events.
    """

    row: JournaledRun
    events: Sequence[JournaledEvent]
    started: float

    def when(self, event: JournaledEvent) -> str:
        """Say when something happened in it."""
        return f"tick {event.tick}, {event.time - self.started:.1f} s"


@dataclass(frozen=True, slots=True)
class Parting:
    """The place where two runs part.

    Attributes:
        number: How many events they have in common.
        first: What the first run does then; None when it does nothing more.
        second: The same of the second run.
    """

    number: int
    first: JournaledEvent | None
    second: JournaledEvent | None


def diff_runs(folder: Path | None, first_id: str, second_id: str) -> tuple[bool, str]:
    """Compare two runs of a journal.

    Args:
        folder: The folder of the journal; that of ``journal_view.journal_folder`` when not given.
        first_id: The one run.
        second_id: The other.

    Returns:
        Whether they do the same, and the answer for people.

    Raises:
        ConfigError: There is no journal or no such run.
    """
    place = journal_folder(folder)
    first, second = (_side(*read_run(place, run_id)) for run_id in (first_id, second_id))
    parting = part(first, second)
    head = [f"{letter}  {_head(side.row)}" for letter, side in (("A", first), ("B", second))]
    common = list(zip(first.events, second.events, strict=False))
    if parting is None:
        lines = ["", "Both do the same."]
    else:
        common = common[: parting.number]
        lines = ["", *_common_lines(first, second, common), *_parting_lines(first, second, parting)]
    return parting is None, "\n".join([*head, *lines, *_value_lines(common)])


def part(first: RunSide, second: RunSide) -> Parting | None:
    """Return where two runs part, None when they do the same."""
    for number, (one, other) in enumerate(zip_longest(first.events, second.events)):
        if one is None or other is None or _what(one) != _what(other):
            return Parting(number, one, other)
    return None


def _side(row: JournaledRun, events: Sequence[JournaledEvent]) -> RunSide:
    one_clock = list(with_one_clock(events))
    begun = [event.time for event in one_clock if event.kind == EventKind.STARTED.value]
    return RunSide(row, list(_compared(one_clock)), begun[0] if begun else 0.0)


def _compared(events: Sequence[JournaledEvent]) -> Iterator[JournaledEvent]:
    """Yield what is compared: how often a condition was asked in the background is a matter of time."""
    starts = {end: start for start, end in match_ends(events)}
    answers: dict[str, str] = {}
    for index, event in enumerate(events):
        if event.kind not in TICKED and event.kind not in FROM_OUTSIDE:
            continue
        again = events[starts.get(index, index)].data.get("again")
        if again and (index not in starts or answers.get(event.node) == event.code):
            continue
        if event.kind == EventKind.SKILL_ENDED.value:
            answers[event.node] = event.code
        yield event


def _what(event: JournaledEvent) -> tuple[str, ...]:
    """Return what an event is, without its time, its sentence and its values."""
    return (event.kind, event.node, event.new, event.skill, event.code)


def _head(row: JournaledRun) -> str:
    why = f", {row.code}: {row.reason}" if row.reason else ""
    return f"{row.run_id}  {row.state}{why}"


def _common_lines(
    first: RunSide, second: RunSide, common: Sequence[tuple[JournaledEvent, JournaledEvent]]
) -> list[str]:
    if not common:
        return ["They part at once."]
    one, other = common[-1]
    return [f"Both do the same up to {first.when(one)} in A and {second.when(other)} in B. Then:"]


def _parting_lines(first: RunSide, second: RunSide, parting: Parting) -> list[str]:
    lines = []
    for letter, side, event in (("A", first, parting.first), ("B", second, parting.second)):
        if event is None:
            lines.append(f"  {letter}  does nothing more")
            continue
        lines.append(f"  {letter}  {side.when(event)}: {event_words(event)}")
        lines += [f"     at {event.node}"] if event.node else []
        lines += [f"     and so it {line}" for line in _failure(side, event)]
    return lines


def _failure(side: RunSide, event: JournaledEvent) -> Iterator[str]:
    """Yield why a node fails in the tick in which its skill ends, when that end does not say it."""
    for later in side.events if event.kind == EventKind.SKILL_ENDED.value else ():
        if (later.tick, later.node, later.new) == (event.tick, event.node, Status.FAILURE.name):
            if later.code != event.code:
                yield f"fails, {later.code}: {later.reason}"
            return


def _value_lines(common: Sequence[tuple[JournaledEvent, JournaledEvent]]) -> list[str]:
    """List the first values that skills were given, or gave, otherwise while both runs went the same way."""
    found = [line for one, other in common for line in _other_values(one, other)]
    if not found:
        return []
    more = len(found) - MOST_VALUES
    rest = [f"  and {more} more"] if more > 0 else []
    return ["", "These values differ while both go the same way:", *found[:MOST_VALUES], *rest]


def _other_values(one: JournaledEvent, other: JournaledEvent) -> Iterator[str]:
    declaration = collect_declarations().get(one.skill)
    for word, tables in (("is given", (one.inputs, other.inputs)), ("gives", (one.outputs, other.outputs))):
        names = [name for name in tables[0] if tables[0][name] != tables[1].get(name)]
        if names:
            ports = {**declaration.inputs, **declaration.outputs} if declaration is not None else {}
            kinds: dict[str, Kind] = {name: port.kind for name, port in ports.items()}
            texts = [values_text({n: table.get(n) for n in names}, kinds) for table in tables]
            yield f"  {one.skill} {word}{texts[0]} in A,{texts[1]} in B (tick {one.tick})"
