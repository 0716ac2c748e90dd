"""A scenario that is drafted from a way on which two versions of a mission do differently."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from florence_bt.assurance.mutating.names import name_of, named_by
from florence_bt.assurance.mutating.pairs import PLACE, TEXT, Pair, Way
from florence_bt.assurance.scenario import (
    inputs_of,
    quoted,
    scripts_of,
    scripts_of_others,
    values_of,
    written,
)
from florence_bt.assurance.values import Values, find_values
from florence_bt.core.declaration import Port, SkillDeclaration
from florence_bt.mission_testing.mocks.board import SkillCall
from florence_bt.mission_testing.test_run import TestRun
from florence_bt.trees.language.model import Mission

MANY_CALLS = 12
"""With more calls than this a scenario counts them instead of listing them."""
_SHOWN = {
    PLACE: ("kitchen", "hall", "bedroom", "study", "bathroom", "balcony", "attic", "cellar"),
    TEXT: ("this", "that", "another", "something"),
}
"""What stands in a scenario for texts that nothing tells apart."""


@dataclass(frozen=True, slots=True)
class Draft:
    """A scenario without what must hold in the end, or with it.

    Attributes:
        name: What it is about.
        inputs: The inputs; of an empty text: the one that all scenarios of the file share is not given.
        skills: Skill -> its script.
        when: What people do, each a line of YAML.
        then: What must hold, each a line of YAML or several.
        named: The skills of whose failures the name speaks.
    """

    name: str
    inputs: Mapping[str, str] = field(default_factory=dict)
    skills: Mapping[str, str] = field(default_factory=dict)
    when: tuple[str, ...] = ()
    then: tuple[str, ...] = ()
    named: frozenset[str] = frozenset()

    def text(self, indent: str = "  ") -> str:
        """Write it as an item of ``scenarios``."""
        lines = [f"- name: {_plain(self.name)}"]
        if self.inputs or self.skills:
            lines.append("  given:")
        if self.inputs:
            pairs = ", ".join(
                f"{name}: {_plain(text, True) if text else ''}" for name, text in self.inputs.items()
            )
            lines.append(f"    inputs: {{{pairs}}}")
        if self.skills:
            lines.append("    skills:")
            lines += [f"      {name}: {_plain(script)}" for name, script in self.skills.items()]
        if self.when:
            lines += ["  when:", *(f"    {line}" for line in self.when)]
        lines += ["  then:", *(f"    {line}" for each in self.then for line in each.split("\n"))]
        return "".join(f"{indent}{line}\n" for line in lines)


def draft_of(
    pair: Pair, way: Way, mission: Mission, declarations: Mapping[str, SkillDeclaration]
) -> Draft | None:
    """Draft a scenario that goes a way; None when no values are found with which it goes like that."""
    played = pair.replay(way)
    values = find_values(played.decided, values_of(played))
    if values is None:
        return None
    values = _with_words(values)
    scripts = {
        **scripts_of_others(mission, played, declarations),
        **scripts_of(played.calls, declarations, values),
    }
    when = tuple(
        line
        for at, how in played.stops[:1]
        for line in (f"- at: {at:g} s", f"  {how}: requested by the scenario")
    )
    step = pair.last_step(way)
    return Draft(
        name_of(step),
        inputs_of(mission, played, values),
        scripts,
        when,
        ("status: SUCCEEDED",),
        named_by(step),
    )


def _with_words(values: Values) -> Values:
    """Let words stand for texts that nothing tells apart."""
    shown: dict[Any, str] = {}
    for kind, words in _SHOWN.items():
        texts = sorted({text for text in values.values() if isinstance(text, str) and _is_made(text, kind)})
        shown |= dict(zip(texts, words, strict=False))
    return {
        term: shown.get(value, value) if isinstance(value, str) else value for term, value in values.items()
    }


def _is_made(text: str, kind: str) -> bool:
    return text.startswith(f"{kind} ") and text.removeprefix(f"{kind} ").isdigit()


# ---- what must hold ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Observed:
    """All that a scenario can tell of a run.

    Attributes:
        status: The status of the run.
        code: Its code.
        reason: Its reason.
        outputs: What it gave.
        duration: How long it took, in seconds; None: it did not end.
        calls: The starts of skills: the skill, its inputs, when.
    """

    status: str
    code: str
    reason: str
    outputs: Mapping[str, Any]
    duration: float | None
    calls: tuple[tuple[str, Mapping[str, Any], float], ...]

    @property
    def without_moments(self) -> Observed:
        """Return the same without the moments of the starts."""
        return replace(self, calls=tuple((skill, inputs, 0.0) for skill, inputs, _ in self.calls))


def observed(run: TestRun) -> Observed:
    """Return what can be told of a run."""
    calls = tuple(
        (call.skill, dict(call.inputs), round(call.started - run.started, 3)) for call in run.calls()
    )
    duration = round(run.duration, 3) if run.duration is not None else None
    return Observed(run.status, run.code, run.reason, run.outputs, duration, calls)


def expectation_of(
    run: TestRun, other: Observed, mission: Mission, ports: Mapping[str, Mapping[str, Port]]
) -> tuple[str, ...]:
    """Return what must hold as it held in a run of the original.

    Args:
        run: The run.
        other: What was observed of the other version; what is only there as a difference is expected, too.
        mission: The mission.
        ports: Skill -> what it takes.
    """
    seen = observed(run)
    lines = [f"status: {seen.status}"]
    if seen.status == "FAILED":
        lines.append(f"code: {seen.code}")
        if seen.reason != other.reason and seen.reason:
            lines.append(f"reason: {quoted(seen.reason)}")
    if seen.outputs:
        shown = ", ".join(
            f"{name}: {_plain(written(value, mission.outputs[name]), True)}"
            for name, value in seen.outputs.items()
        )
        lines.append(f"outputs: {{{shown}}}")
    if seen.duration is not None:
        lines.append(f"duration: {seen.duration:g} s")
    lines += _calls(run.calls(), ports, other)
    lines += _moments(run, seen, other)
    return tuple(lines)


def _moments(run: TestRun, seen: Observed, other: Observed) -> Iterator[str]:
    """Write when a skill did what, where only that differs."""
    if seen.without_moments != other.without_moments:
        return
    late = next(mine[0] for mine, theirs in zip(seen.calls, other.calls, strict=True) if mine != theirs)
    lines = [f"    - {_plain(line)}" for line in run.trace(late).splitlines()]
    yield "\n".join(["trace:", f"  of: {late}", "  lines:", *lines])


def _calls(
    calls: Sequence[SkillCall], ports: Mapping[str, Mapping[str, Port]], other: Observed
) -> Iterator[str]:
    if not calls:
        return
    if len(calls) > MANY_CALLS:
        names = dict.fromkeys(call.skill for call in calls)
        counts = ", ".join(f"{name}: {sum(call.skill == name for call in calls)}" for name in names)
        yield f"called: {{{counts}}}"
        return
    lines = []
    for number, call in enumerate(calls):
        elsewhere = other.calls[number][1] if number < len(other.calls) else {}
        inputs = ", ".join(_inputs(call.inputs, ports.get(call.skill, {}), elsewhere))
        lines.append(f"  - {call.skill}: {{{inputs}}}" if inputs else f"  - {call.skill}")
    yield "\n".join(["only_calls:", *lines])


def _inputs(
    inputs: Mapping[str, Any], ports: Mapping[str, Port], elsewhere: Mapping[str, Any]
) -> Iterator[str]:
    """Yield the inputs of a call, without those that are as everywhere: the default, here and elsewhere."""
    for name, value in inputs.items():
        port = ports.get(name)
        usual = port is None or (not port.required and value == port.default)
        if port is not None and (not usual or elsewhere.get(name, value) != value):
            yield f"{name}: {_plain(written(value, port), True)}"


_SPECIAL = set("{}[],:#&*!|>'\"%@`$<")


def _plain(text: str, in_braces: bool = False) -> str:
    """Write a text without quotes where YAML reads it as it stands."""
    odd = text[:1] in set("{}[]&*!|>'\"%@`-?#<") or ": " in text or " #" in text or not text.strip()
    if in_braces:
        odd = odd or bool(_SPECIAL & set(text))
    return quoted(text) if odd or text != text.strip() or text.endswith(":") else text


def shortened(draft: Draft, without: str) -> Draft:
    """Leave out an input or a script, which all scenarios of the file may share."""
    return replace(
        draft,
        inputs={name: text for name, text in draft.inputs.items() if name != without},
        skills={name: text for name, text in draft.skills.items() if name != without},
    )
