"""Two versions of a mission that are explored side by side: the same happens to both.

Skills answer both alike, call by call. What one starts, cancels or ends with and the other does not at that
moment is a difference. When every way was explored without one, nobody can tell the two apart.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from florence_bt.assurance.choices import Choices
from florence_bt.assurance.plan import Plan
from florence_bt.assurance.replay import A_MOMENT_S, Replayed
from florence_bt.assurance.skills import End, OpenEnd, Outputs
from florence_bt.assurance.snapshot import Snapshot
from florence_bt.assurance.states import Term
from florence_bt.assurance.unknown import Facts, term_of, unknown
from florence_bt.assurance.verifier import Verifier
from florence_bt.assurance.world import (
    JUST_BEFORE_S,
    OVERRIDE,
    STOP,
    Ended,
    Happening,
    NextEvent,
    World,
    end_events,
)
from florence_bt.behaviours.why import explain
from florence_bt.core.declaration import Port, SkillDeclaration
from florence_bt.core.outcome import Result

PLACE, TEXT = "place", "text"
"""How the texts begin that stand for labels of places, and for others; a number tells one from another."""
MAX_TICKS = 200
"""How many ticks may follow each other at one moment; beyond that a mission goes round without a pause."""
MAX_TAIL = 60
"""How many steps a scenario goes on after a difference, until the mission is stopped."""


@dataclass(slots=True)
class Answers:
    """The answers of skills in one step: the second one who asks is told what the first one was told.

    Attributes:
        known: Who was asked, for the how many-th time -> the answer.
    """

    known: dict[tuple[str, str, int], Any] = field(default_factory=dict)


class _SharedOutputs(Outputs):
    """Makes outputs of which every value counts, and the same for both versions."""

    def __init__(self, outputs: Outputs, version: _Version) -> None:
        super().__init__(outputs._facts, outputs._deciding, outputs._needed, outputs._note)
        self._version = version

    def result_of(self, declaration: SkillDeclaration, end: End) -> Result:
        """Return the result of a run that ends in a way."""
        made: Result = self._version.answer(
            f"result {end.shown}",
            declaration.name,
            lambda: super(_SharedOutputs, self).result_of(declaration, end),
        )
        return made

    def _any(self, skill: str, name: str, port: Port) -> Any:
        if name in self._needed.get(skill, frozenset()) or port.kind.item is not None:
            return super()._any(skill, name, port)
        return self.any_of(port)

    def _new(self, port: Port) -> Any:
        made = super()._new(port)
        if isinstance(made, str) and not port.choices:  # two texts are told apart where they are said
            made = unknown(self._facts, term_of(made), f"{PLACE if port.names else TEXT} {self._facts.count}")
        if isinstance(made, (int, float)):
            term = term_of(made)
            if port.minimum is not None:
                self._facts.decided["<", term, ("=", port.minimum)] = False
            if port.maximum is not None:
                self._facts.decided["<", ("=", port.maximum), term] = False
        return made


class _Version(World):
    """One of the two versions."""

    def __init__(
        self, answers: Answers, verifier: Verifier, name: str, plan: Plan, facts: Facts, at_once: bool
    ) -> None:
        self._answers = answers
        self._at_once = at_once
        self._asked: Counter[tuple[str, str]] = Counter()
        self.ended: tuple[Any, ...] = ()
        mission = verifier.library.get(name)
        library = verifier.with_stubs(mission)
        super().__init__(mission, library, verifier.declarations, plan, {}, verifier.called, facts=facts)

    def answer(self, what: str, who: str, make: Any) -> Any:
        """Return the answer to a question that both versions ask for the same number of times."""
        number = self._asked[what, who]
        self._asked[what, who] += 1
        key = (what, who, number)
        if key not in self._answers.known:
            self._answers.known[key] = make()
        return self._answers.known[key]

    def _settle(self) -> bool:
        for _ in range(MAX_TICKS):
            if self.moment.asked and not self.over:
                self._tick()
            elif any(run.asked_to_stop for run in self._all_open()):
                self._report_stops()
            else:
                return True
        return False

    def happen(self, event: NextEvent, due: float | None) -> bool:
        """Let something happen, and tick until nothing more follows at this moment.

        Args:
            event: What happens.
            due: When the next timer of the two versions is due; None: none is.

        Returns:
            Whether what follows has an end.
        """
        self._asked.clear()
        self.happened.clear()
        if event.what == "begin":
            self._begin()
        elif event.what in ("stop", "override"):
            self._stop(event.what)
        else:
            runs = self._open_runs()
            if due is not None and (event.late or event.what == "time"):
                self._let_pass(due, event.late)
            for ended in event.ends:
                self._end_run(runs[ended.run], ended.end)
        return self._settle()

    def _let_pass(self, due: float, before: bool) -> None:
        if before:
            self.clock.advance_to(due - JUST_BEFORE_S)
            return
        while (when := self.clock.next_time()) is not None and when <= due + 2 * JUST_BEFORE_S:
            self.clock.run_next()
        self.clock.advance_to(due)

    def open(self) -> list[tuple[str, int]]:
        """Return the skills that go on, each with the number of its ends."""
        return [
            (entry.skill, len(entry.run.ends))
            for entry in self._open_runs()
            if isinstance(entry.run, OpenEnd)
        ]

    @property
    def has_other_timers(self) -> bool:
        """Tell whether more waits than the limits of one skill."""
        return self._timers_beside(self._open_runs()) > 0

    @property
    def may_wait(self) -> bool:
        """Tell whether time may pass up to its own next timer."""
        return self._may_wait()

    def part(self, symbols: dict[Term, int]) -> tuple[Any, ...]:
        """Return what decides how it goes on."""
        return self._keys.moment(symbols, *self._marks())

    def decided(self, symbols: dict[Term, int]) -> tuple[tuple[str, bool], ...]:
        """Return what was decided about values."""
        return self._keys.decided(symbols)

    def values(self) -> Mapping[str, Any]:
        """Return the keys with their values."""
        return self._context.keys.as_dict()

    def roots(self) -> tuple[Any, ...]:
        """Return where a snapshot of it begins."""
        return (self.moment, self.tree.root, self._context, self.clock)

    def did(self) -> tuple[Any, ...]:
        """Return what somebody can tell of the last step: starts, cancels, the end."""
        starts = [
            (each.skill, dict(each.inputs))
            for each in self.happened
            if each.what == "start" and each.skill != "finally"
        ]
        cancels = sorted(each.skill for each in self.happened if each.what == "cancel")
        return (starts, cancels, self.moment.end, self.ended if self.moment.end else ())

    # ---- what both share ------------------------------------------------------------------------------

    def _outputs(self) -> Outputs:
        return _SharedOutputs(super()._outputs(), self)

    def _choose(self, path: str, declaration: SkillDeclaration, ends: tuple[End, ...]) -> End:
        if not self._at_once and not declaration.instant:
            return ends[0]  # it goes on
        choose = super()._choose
        end: End = self.answer("start", declaration.name, lambda: choose(path, declaration, ends))
        return end

    def note_cancel(self, run: OpenEnd) -> None:
        """Note that a skill is cancelled; what may last of a mission makes no difference here."""
        self.happened.append(Happening("cancel", run.path, run.declaration.name))

    def _is_open(self, name: str, port: Port) -> bool:
        return (name not in self.plan.needed and port.kind.item is None) or super()._is_open(name, port)

    def _begin(self) -> None:
        self.moment.begun = True
        keys = self._context.keys
        chosen = {
            name: self.answer("input", name, lambda port=port: self.results.any_of(port))
            for name, port in self._open_inputs.items()
        }
        keys.reset({**keys.as_dict(), **chosen})

    def _finish(self, status: str, code: str) -> None:
        why = explain(self.tree.root) if status == "FAILED" else None
        self.ended = (why.reason if why is not None else "", dict(self.moment.outputs))
        super()._finish(status, code)

    def _look_at_changes(self) -> None:
        """Leave out what only the check of one mission asks for."""

    def _look_for_rivals(self) -> None:
        """Leave out what only the check of one mission asks for."""


Way = tuple[tuple[NextEvent, tuple[int, ...]], ...]
"""Steps from the start, each with what was chosen in it."""


@dataclass(slots=True)
class Exploration:
    """All that is known of two versions.

    Attributes:
        states: How many pairs of states were looked at.
        complete: Whether these are all.
        differences: How many differences were met.
    """

    states: int = 0
    complete: bool = False
    differences: int = 0

    @property
    def equivalent(self) -> bool:
        """Tell whether nobody can tell the two versions apart."""
        return self.complete and not self.differences


@dataclass(frozen=True, slots=True)
class LastStep:
    """A step in which two versions do differently.

    Attributes:
        event: What happened to both.
        seconds: When.
        first: What the first version did.
        second: What the second one did.
        first_end: How the first one has ended, as status and code; None: it goes on.
        second_end: The same of the second one.
    """

    event: str
    seconds: float
    first: tuple[Happening, ...]
    second: tuple[Happening, ...]
    first_end: tuple[str, str] | None
    second_end: tuple[str, str] | None


class Pair:
    """Two versions of a mission.

    Args:
        first: Explores the first version, and what it calls.
        second: Explores the second one.
        name: The mission.
        at_once: Whether skills that take time may also end while they are started. Without these ways
            differences are found sooner.
    """

    def __init__(self, first: Verifier, second: Verifier, name: str, *, at_once: bool = True) -> None:
        self._facts = Facts(Choices())
        self._answers = Answers()
        plan = _joined(first.plan(name), second.plan(name))
        self._versions = tuple(
            _Version(self._answers, each, name, plan, self._facts, at_once) for each in (first, second)
        )
        self._first, self._second = self._versions
        self._deciding = plan.deciding | plan.needed
        self._start = self._snapshot()
        self.explored = Exploration()

    # ---- exploring ------------------------------------------------------------------------------------

    def differences(self, seconds: float, steps: int) -> Iterator[Way]:
        """Yield ways to a difference, the shortest first.

        Args:
            seconds: How long it may take, in seconds of the processor.
            steps: How many steps may be taken.
        """
        began, taken = time.process_time(), 0
        known: set[Any] = set()
        todo: deque[tuple[Way, Snapshot]] = deque([((), self._start)])
        explored = self.explored
        while todo:
            way, snapshot = todo.popleft()
            explored.states += 1
            snapshot.restore()
            for event in list(self._events()):
                path: list[int] | None = []
                while path is not None:
                    taken += 1
                    if time.process_time() - began > seconds or taken > steps:
                        return
                    snapshot.restore()
                    settled = self._do(event, path)
                    further = (*way, (event, tuple(self._facts.choices.path)))
                    path = self._facts.choices.next()
                    if not settled:
                        continue
                    if self._first.did() != self._second.did():
                        explored.differences += 1
                        yield further
                        continue
                    key = self._key()
                    if key not in known:
                        known.add(key)
                        if not self._first.over or not self._second.over:
                            todo.append((further, self._snapshot()))
        explored.complete = True

    def _snapshot(self) -> Snapshot:
        roots = (root for each in self._versions for root in each.roots())
        return Snapshot((*roots, self._facts.decided, self._facts.texts))

    def _key(self) -> Any:
        symbols: dict[Term, int] = {}
        parts = tuple(each.part(symbols) for each in self._versions)
        first, second = (each.values() for each in self._versions)
        apart = tuple(
            key
            for key in sorted({*first, *second})
            if key not in self._deciding and first.get(key) != second.get(key)
        )
        return (*parts, apart, self._first.decided(symbols))

    def _due(self) -> float | None:
        due = [when for each in self._versions if (when := each.clock.next_due()) is not None]
        return min(due, default=None)

    def _events(self) -> Iterator[NextEvent]:
        """Yield what may happen next."""
        if not self._first.moment.begun:
            yield NextEvent("begin")
            return
        due, runs = self._due(), self._first.open()
        now = self._first.clock.now()
        passes = due is not None and due - now > 2 * JUST_BEFORE_S
        late = passes and any(each.has_other_timers for each in self._versions)
        ways = [[Ended(number, end) for end in range(ends)] for number, (_, ends) in enumerate(runs)]
        yield from end_events(ways, late=late)
        if due is not None and all(each.may_wait for each in self._versions if each.clock.next_due() == due):
            yield NextEvent("time")
            if len(runs) > 1 or late:
                yield from (NextEvent("time", (ended,)) for own in ways for ended in own)
        if self._first.moment.end is None:
            yield STOP
            if any(each.drives_in_cleanup for each in self._versions):
                yield OVERRIDE

    def _do(self, event: NextEvent, path: list[int] | tuple[int, ...]) -> bool:
        """Let something happen to both; False when there is no end to what follows."""
        self._answers.known.clear()
        self._facts.choices.begin(path)
        due = self._due()
        settled = [each.happen(event, due) for each in self._versions]
        return all(settled)

    # ---- playing one way ------------------------------------------------------------------------------

    def replay(self, way: Way) -> Replayed:
        """Play a way once more, of the first version, with times and up to an end."""
        played = Replayed()
        self._start.restore()
        first = self._first
        for event, path in way:
            self._take_a_moment(event)
            self._do(event, path)
            self._note(played, event)
        for _ in range(MAX_TAIL):
            onward = None if first.over else self._onward()
            if onward is None:
                break
            self._take_a_moment(onward)
            self._answers.known.clear()
            first.choices.begin()
            first.happen(onward, first.clock.next_due())
            self._note(played, onward)
        if not first.over:
            self._take_a_moment(STOP)
            first.happen(STOP, None)
            self._note(played, STOP)
        played.seconds = round(first.clock.now(), 3)
        return played

    def last_step(self, way: Way) -> LastStep:
        """Return what both versions did in the last step of a way."""
        self._start.restore()
        for event, path in way:
            self._do(event, path)
        first, second = self._versions
        return LastStep(
            way[-1][0].what,
            round(first.clock.now(), 1),
            tuple(first.happened),
            tuple(second.happened),
            first.moment.end,
            second.moment.end,
        )

    @property
    def declarations(self) -> Mapping[str, SkillDeclaration]:
        """The skills, the missions that are called among them."""
        return self._first.declarations

    def _onward(self) -> NextEvent | None:
        """Return what leads to an end: each skill succeeds, or time passes."""
        if self._first.open():
            return NextEvent("end", (Ended(0, 0),))
        return NextEvent("time") if self._first.clock.next_due() is not None else None

    def _take_a_moment(self, event: NextEvent) -> None:
        if event.what in ("end", "stop", "override") and not event.late:
            now, due = self._first.clock.now(), self._due()
            left = A_MOMENT_S if due is None else min(A_MOMENT_S, (due - now) / 2.0)
            for each in self._versions:
                each.clock.advance_to(now + left)

    def _note(self, played: Replayed, event: NextEvent) -> None:
        first = self._first
        played.decided.update(self._facts.decided)
        for each in first.happened:
            played.note(round(first.clock.now(), 3), each)
        if event.what == "begin":
            played.inputs = {name: first.tree.keys.read(name) for name in first.mission.inputs}


def _joined(first: Plan | None, second: Plan | None) -> Plan:
    """Return what decides in one of two versions."""
    assert first is not None and second is not None  # both missions are there
    return Plan(first.deciding | second.deciding, first.needed | second.needed, first.words | second.words)
