"""Compares what a replay does with what the journal has, and says the first difference for people."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from py_trees.common import Status

from florence_bt.behaviours.why import Why
from florence_bt.runtime.events import EventKind, RunEvent, plain
from florence_bt.runtime.journal import JournaledEvent
from florence_bt.runtime.replay.moments import Moment
from florence_bt.runtime.run import RunStatus
from florence_bt.runtime.status import values_text

NOTHING = "nothing more"
_WHERE_IT_WAS = re.compile(r"\(it was at ([^:)]+)[:)].*")
_BECOMES = {
    Status.RUNNING.name: "begins",
    Status.SUCCESS.name: "succeeds",
    Status.FAILURE.name: "fails",
    Status.INVALID.name: "is left",
}


@dataclass(frozen=True, slots=True)
class Deed:
    """A thing that a run does by itself.

    Attributes:
        node: The path of the node that does it; empty for the run as a whole.
        what: What it does, for people.
        because: Why a node fails.
        values: What a skill is given, exactly; people are shown it rounded.
    """

    node: str
    what: str
    because: str = ""
    values: str = ""

    def __str__(self) -> str:
        return f"{self.what}: {self.because}" if self.because else self.what


@dataclass(frozen=True, slots=True)
class Difference:
    """The first thing that a run does otherwise than the journal says.

    Attributes:
        moment: The number of the moment.
        tick: The number of its tick.
        at: Seconds since the start of the run, pauses counted.
        node: The path of the node; empty when it is the end of the run as a whole.
        recorded: What it did then, for people.
        replayed: What it does now, for people.
    """

    moment: int
    tick: int
    at: float
    node: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        where = f"at {self.node}" if self.node else "at the end"
        return (
            f"in tick {self.tick} (+{self.at:.1f} s) {where} the journal has: {self.recorded}; "
            f"the mission now does: {self.replayed}"
        )


def without_feedback(reason: str) -> str:
    """Return the reason of a failure without what a skill had fed back when its time was over.

    ``timeout`` says where it was, ``(it was at drive: 2 m to go)``. A skill's feedback is not recorded, so a
    replay says ``(it was at drive)``.
    """
    return _WHERE_IT_WAS.sub(r"(it was at \1)", reason)


def first_difference(
    moment: Moment, done: Sequence[RunEvent], started: float, *, complete: bool
) -> Difference | None:
    """Return the first difference in a moment, None when there is none.

    Args:
        moment: The moment as it was recorded.
        done: What the mission has done in it now: changes of nodes and starts of skills, in order.
        started: When the run started.
        complete: Whether the journal has all of the moment.
    """
    wanted = [deed_of_journaled(event) for event in moment.compared]
    now = [_deed_of(event) for event in done]
    if not complete:
        now = now[: len(wanted)]
    for recorded, replayed in zip_longest(wanted, now):
        if recorded != replayed:
            return _difference(moment, started, recorded, replayed)
    return None


def ending_difference(
    moment: Moment, over: tuple[RunStatus, Why | None] | None, tip: str, started: float
) -> Difference | None:
    """Return how the end of a run differs from the one that a moment has, None when it does not.

    Args:
        moment: The moment of the end.
        over: How the run ends now, and why when it is no success; None when it goes on.
        tip: The node that it waits for when it goes on.
        started: When the run started.
    """
    event = moment.events[0]
    cause = str(event.data.get("cause", ""))
    recorded = Deed(cause, f"the run ends {event.new}, {event.code}", without_feedback(event.reason))
    replayed = Deed(cause, f"the run goes on at {tip!r}") if over is None else _of_end(*over)
    return _difference(moment, started, recorded, replayed) if recorded != replayed else None


def _of_end(status: RunStatus, why: Why | None) -> Deed:
    path, code, reason = ("", "", "") if why is None else (why.path, why.code, why.reason)
    ends = f"the run ends {status.value}, {'ok' if status is RunStatus.SUCCEEDED else code}"
    return Deed(path, ends, without_feedback(reason))


def _difference(moment: Moment, started: float, recorded: Deed | None, replayed: Deed | None) -> Difference:
    first = recorded or replayed
    assert first is not None
    texts = [NOTHING if deed is None else str(deed) for deed in (recorded, replayed)]
    if recorded is not None and replayed is not None:
        if recorded.node != replayed.node:
            texts[1] = f"{replayed.node} {texts[1]}"
        elif texts[0] == texts[1]:
            texts = [f"{deed} {deed.values}" for deed in (recorded, replayed)]
    return Difference(moment.number, moment.tick, moment.time - started, first.node, texts[0], texts[1])


def deed_of_journaled(event: JournaledEvent) -> Deed:
    """Return what an event of the journal says that a node did."""
    if event.kind == EventKind.NODE.value:
        return _of_node(event.node, event.new, event.code, event.reason)
    return _of_start(event.node, event.skill, event.inputs)


def _deed_of(event: RunEvent) -> Deed:
    data = event.data
    if event.kind is EventKind.NODE:
        return _of_node(data["node"], data["new"], data.get("code", ""), data["reason"])
    return _of_start(data["node"], data["skill"], plain(data["inputs"]))


def _of_node(node: str, new: str, code: str, reason: str) -> Deed:
    # What a node says that does not fail may come from the feedback of a skill, which is not recorded.
    because = f"{code}, {without_feedback(reason)}" if new == Status.FAILURE.name else ""
    return Deed(node, _BECOMES[new], because)


def _of_start(node: str, skill: str, inputs: Mapping[str, Any]) -> Deed:
    values = dict(sorted(inputs.items()))
    return Deed(node, f"starts {skill}{values_text(values, {})}", values=repr(values))
