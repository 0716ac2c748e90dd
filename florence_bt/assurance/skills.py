"""Skills that end in every way in which they may: for a mission that is explored."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from florence_bt.assurance.lasting import Effects
from florence_bt.assurance.plan import CodeClass
from florence_bt.assurance.snapshot import Unchanging
from florence_bt.assurance.unknown import Facts, witness_for
from florence_bt.core.clock import Timer
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES, Result, cancelled, failure, success
from florence_bt.core.skill import FinishedRun

NOT_BY_ITSELF = frozenset({"bad_input", "cancelled"})
"""Common codes that tell of a mistake of the mission, or of a cancel from elsewhere."""
LIST_LENGTHS = (0, 1, 2)
"""How many items lists have that skills give."""


@dataclass(frozen=True, slots=True)
class End:
    """A way in which a skill may end.

    Attributes:
        code: The code of the failure, None for success.
        outputs: What outputs are known to be; others can be anything.
        effects: What lasts afterwards, of a mission that is called.
    """

    code: str | None = None
    outputs: tuple[tuple[str, Any], ...] = ()
    effects: Effects = ()

    @property
    def shown(self) -> str:
        """The code for people, ``ok`` for success."""
        return self.code or "ok"


def ends_of(
    declaration: SkillDeclaration, classes: Callable[[frozenset[str]], Sequence[CodeClass]]
) -> tuple[End, ...]:
    """Return the ways in which a skill may end: with success, and with each code that is told apart.

    Args:
        declaration: What the skill says about itself.
        classes: Puts codes together that nothing tells apart.
    """
    codes = frozenset({*declaration.failures, *COMMON_CODES}) - NOT_BY_ITSELF
    if declaration.instant:
        codes -= {"timed_out", "rejected"} - {*declaration.failures}
    return (End(), *(End(code) for code in classes(codes)))


@dataclass(slots=True)
class OpenEnd:
    """A run of a skill whose end is open.

    Attributes:
        ends: The ways in which it may end.
        declaration: What the skill says about itself.
        path: The path of the node that started it.
        longest: How long it takes at most, in seconds; None: as long as its declaration allows.
        stops: What may last after it was stopped.
        limit: The timer up to which it has ended, of a mission that is called.
        on_cancel: Called when it is cancelled.
        asked_to_stop: Whether it was cancelled and has not ended.
        result: How it ended.
    """

    ends: tuple[End, ...]
    declaration: SkillDeclaration
    path: str
    longest: float | None = None
    stops: tuple[Effects, ...] = ((),)
    limit: Timer | None = None
    on_cancel: Callable[[OpenEnd], None] | None = None
    asked_to_stop: bool = False
    result: Result | None = None
    callbacks: list[Callable[[], None]] = field(default_factory=list)

    feedback = ""

    @property
    def state(self) -> tuple[Any, ...]:
        """Return what counts of it for how the mission goes on, its result apart."""
        return (self.asked_to_stop, self.ends)

    def poll(self) -> Result | None:
        """Return the result, None as long as it goes on."""
        return self.result

    def cancel(self) -> None:
        """Ask for the end, which comes a little later."""
        if self.result is None:
            if self.on_cancel is not None and not self.asked_to_stop:
                self.on_cancel(self)
            self.asked_to_stop = True

    def on_change(self, callback: Callable[[], None]) -> None:
        """Call back at the end."""
        self.callbacks.append(callback)

    def finish(self, result: Result) -> None:
        """End."""
        self.asked_to_stop = False
        self.result = result
        if self.limit is not None:
            self.limit.cancel()
        for callback in tuple(self.callbacks):
            callback()


class Outputs(Unchanging):
    """Makes the outputs of skills: anything that they may be, where that decides something.

    Args:
        facts: What is decided about values.
        deciding: Skill -> its outputs whose values decide something.
        needed: Skill -> its outputs that are needed as they stand.
        note: Takes what was taken as it stands.
    """

    def __init__(
        self,
        facts: Facts,
        deciding: Mapping[str, frozenset[str]],
        needed: Mapping[str, frozenset[str]],
        note: Callable[[str], None],
    ) -> None:
        self._facts = facts
        self._deciding = deciding
        self._needed = needed
        self._note = note

    def result_of(self, declaration: SkillDeclaration, end: End) -> Result:
        """Return the result of a run that ends in a way."""
        if end.code is not None:
            return failure(end.code, f"{declaration.name} failed with {end.code}")
        known = dict(end.outputs)
        given = {
            name: known[name] if name in known else self._any(declaration.name, name, port)
            for name, port in declaration.outputs.items()
        }
        return success(**given)

    def _any(self, skill: str, name: str, port: Port) -> Any:
        if name in self._needed.get(skill, frozenset()):
            self._note(f"{name} of {skill} is taken as {witness_for(port)!r}")
        elif name in self._deciding.get(skill, frozenset()):
            return self.any_of(port)
        return witness_for(port)

    def any_of(self, port: Port) -> Any:
        """Return anything that fits a port; a truth value and the length of a list are chosen."""
        if port.kind is Kind.BOOLEAN:
            return self._facts.choices.take(2) == 0
        if port.kind.item is not None:
            length = LIST_LENGTHS[self._facts.choices.take(len(LIST_LENGTHS))]
            self._note(f"lists have up to {LIST_LENGTHS[-1]} items")
            item = Port(port.kind.item, "", choices=port.choices)
            if port.kind.item is Kind.BOOLEAN:
                return tuple(self.any_of(item) for _ in range(length))
            return tuple(self._new(item) for _ in range(length))
        return self._new(port)

    def _new(self, port: Port) -> Any:
        return self._facts.new(port.kind, witness_for(port), port.choices)


_LATER = End("later")
"""Stands for an end that comes after the start."""


class AnySkill(Unchanging):
    """A skill that may end in every way.

    Args:
        declaration: What it says about itself.
        ends: The ways.
        outputs: Makes what it gives.
        choose: Chooses one of some ways; for a skill that answers at once.
        on_cancel: Called when a run is cancelled.
    """

    def __init__(
        self,
        declaration: SkillDeclaration,
        ends: tuple[End, ...],
        outputs: Outputs,
        choose: Callable[[str, SkillDeclaration, tuple[End, ...]], End],
        on_cancel: Callable[[OpenEnd], None],
    ) -> None:
        self._declaration = declaration
        self._ends = ends
        self._outputs = outputs
        self._choose = choose
        self._on_cancel = on_cancel

    def start_at(self, path: str, inputs: Mapping[str, Any]) -> Any:
        """Begin a run at a node; one that answers at once has ended."""
        if self._declaration.instant:
            end = self._choose(path, self._declaration, self._ends)
            return FinishedRun(self._outputs.result_of(self._declaration, end))
        end = self._choose(path, self._declaration, (_LATER, *self._ends))
        if end is not _LATER:
            return FinishedRun(self._outputs.result_of(self._declaration, end))
        return OpenEnd(self._ends, self._declaration, path, on_cancel=self._on_cancel)

    def start(self, inputs: Mapping[str, Any]) -> Any:
        """Begin a run."""
        return self.start_at("", inputs)


def witness_result(declaration: SkillDeclaration) -> Result:
    """Return a success with outputs that fit."""
    return success(**{name: witness_for(port) for name, port in declaration.outputs.items()})


STOPPED = cancelled()
"""How a run ends that was cancelled."""
