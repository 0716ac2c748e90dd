"""A name for a scenario: what the original does at the moment when the other version does differently."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from florence_bt.assurance.mutating.pairs import LastStep
from florence_bt.assurance.world import Happening


def name_of(step: LastStep) -> str:
    """Say what is noticed: what the original does, and when."""
    effect, cause = _effect(step), _cause(step)
    return f"{effect} {cause}" if cause else effect


def named_by(step: LastStep) -> frozenset[str]:
    """Return the skills of whose failures the name speaks."""
    return frozenset(each.skill for each, _ in _failures(step))


def _cause(step: LastStep) -> str:
    if step.event in ("stop", "override"):
        return "when somebody stops it" if step.event == "stop" else "when somebody takes the robot over"
    causes = [f"{_node(each)} fails with {code}" for each, code in _failures(step)]
    if causes:
        return f"when {' and '.join(dict.fromkeys(causes))}"
    if step.event == "time":
        return f"after {step.seconds:g} s"
    ended = [each for each in step.first if each.what == "end" and each.result is not None]
    return f"after {_node(ended[-1])}" if ended and step.event != "begin" else ""


def _failures(step: LastStep) -> list[tuple[Happening, str]]:
    """Return the failures at that moment, each with its code."""
    return [
        (each, each.result.code)
        for each in step.first
        if each.what == "end" and each.result is not None
        if not each.result.succeeded and each.result.code != "cancelled"
    ]


def _effect(step: LastStep) -> str:
    mine, theirs = _started(step.first), _started(step.second)
    more, fewer = _without(mine, theirs), _without(theirs, mine)
    if more:
        begins = step.event == "begin" and mine[0] is more[0]
        return f"it {'begins' if begins else 'goes on'} with {_node(more[0])}"
    if fewer:
        return f"it does not go on with {_node(fewer[0])}"
    if step.first_end != step.second_end and step.first_end is not None:
        status, code = step.first_end
        return {"SUCCEEDED": "it succeeds", "FAILED": f"it fails with {code}"}.get(status, "it is stopped")
    if step.first_end != step.second_end:
        return "it is not over"
    for one, other in zip(mine, theirs, strict=True):
        if one.skill != other.skill:
            return f"{_node(one)} comes first"
    if given := _given_other(step):
        return given
    stopped, let = _cancels(step.first), _cancels(step.second)
    ended = _without(stopped, let)
    if ended:
        return f"{_node(ended[0])} is stopped"
    if _without(let, stopped):
        return "nothing is stopped"
    return "it gives its outputs" if step.first_end and step.first_end[0] == "SUCCEEDED" else "it says why"


def _given_other(step: LastStep) -> str:
    """Name the first input that the original gives otherwise; empty: there is none."""
    pairs = zip(_started(step.first), _started(step.second), strict=True)
    for mine, theirs in pairs:
        for name, value in mine.inputs.items():
            if theirs.inputs.get(name) != value:
                return f"{_node(mine)} is given its {name.replace('_', ' ')}"
    return ""


def _started(happened: Iterable[Happening]) -> list[Happening]:
    return [each for each in happened if each.what == "start" and each.skill != "finally"]


def _cancels(happened: Iterable[Happening]) -> list[Happening]:
    return [each for each in happened if each.what == "cancel"]


def _without(happened: list[Happening], others: list[Happening]) -> list[Happening]:
    """Return what is about skills that come more often than among the others."""
    left = Counter(each.skill for each in others)
    found = []
    for each in happened:
        left[each.skill] -= 1
        if left[each.skill] < 0:
            found.append(each)
    return found


def _node(each: Happening) -> str:
    return each.path.rsplit("/", 1)[-1]
