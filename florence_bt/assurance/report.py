"""What ``florence verify`` says of a mission."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from florence_bt.assurance.events import Happening
from florence_bt.assurance.paths import longest
from florence_bt.assurance.plan import codes_behind
from florence_bt.assurance.problems import BROKEN, Problem, occurring_codes, problems_of
from florence_bt.assurance.replay import Replayed, replay
from florence_bt.assurance.verifier import Explored, Verifier
from florence_bt.core.declaration import Kind, quantity_text
from florence_bt.trees.language.model import Mission


@dataclass(frozen=True, slots=True)
class Verdict:
    """All that is known of a mission that was explored.

    Attributes:
        mission: The mission.
        explored: Its states.
        problems: What does not hold.
        called: Missions that it calls of which something does not hold.
        codes: With what it can fail.
        longest_s: How long it takes at most, in seconds; infinite: as long as it takes.
        assumed: What was assumed, in the missions that it calls, too.
        coarse: Whether somewhere what takes long was let end at any moment.
    """

    mission: Mission
    explored: Explored
    problems: tuple[Problem, ...]
    called: tuple[str, ...]
    codes: frozenset[str]
    longest_s: float
    assumed: tuple[str, ...]
    coarse: bool

    @property
    def complete(self) -> bool:
        """Tell whether every state was explored."""
        return not self.explored.graph.unexplored

    @property
    def broken(self) -> list[Problem]:
        """Return what is broken."""
        return [each for each in self.problems if each.severity == BROKEN]

    @property
    def holds(self) -> bool:
        """Tell whether everything holds that must, in every state."""
        return self.complete and not self.broken and not self.called


def verdict_on(name: str, verifier: Verifier) -> Verdict:
    """Explore a mission and say what is known of it."""
    explored = verifier.explored(name)
    mission = explored.mission
    ways = [explored, *verifier.ways_below(mission)]
    called = [
        each
        for each in sorted(verifier.analysis.callees(mission))
        if any(way.graph.unexplored or _is_broken(way, verifier) for way in verifier.ways_of(each))
    ]
    return Verdict(
        mission,
        explored,
        tuple(problems_of(explored, verifier)),
        tuple(called),
        occurring_codes(explored),
        longest(explored.graph)[0],
        tuple(dict.fromkeys(each for way in ways for each in way.world.assumed)),
        any(way.world.coarse for way in ways),
    )


def _is_broken(way: Explored, verifier: Verifier) -> bool:
    return any(each.severity == BROKEN for each in problems_of(way, verifier))


def text_of(verdict: Verdict, scenarios: dict[int, Path] | None = None, *, details: bool = False) -> str:
    """Write what is known of a mission, for people.

    Args:
        verdict: What is known.
        scenarios: Number of a problem -> the scenario file that shows it.
        details: Whether to show how the longest run goes.
    """
    lines = [f"{verdict.mission.name}: {headline_of(verdict)}", *(f"  {line}" for line in facts_of(verdict))]
    for number, problem in enumerate(verdict.problems):
        lines += ["", *_problem(verdict, problem)]
        if scenarios and number in scenarios:
            lines.append(f"    Play it: florence test {scenarios[number]}")
    if details and math.isfinite(verdict.longest_s):
        way = longest(verdict.explored.graph)[1]
        lines += [
            "",
            "  The longest run:",
            *(f"      {each}" for each in _trace(replay(verdict.explored, way, slow=True))),
        ]
    return "\n".join(lines)


def headline_of(verdict: Verdict) -> str:
    """Return in a few words whether everything holds."""
    broken = len(verdict.broken)
    if broken:
        return f"BROKEN, {broken} thing{'s' if broken > 1 else ''}"
    if not verdict.complete:
        return "NOT PROVED: not every way was explored"
    if verdict.called:
        return "NOT PROVED: it calls a mission that is broken"
    warnings = len(verdict.problems)
    return "holds" + (f", {warnings} warning{'s' if warnings > 1 else ''}" if warnings else "")


def facts_of(verdict: Verdict) -> list[str]:
    """Return what was explored, how it ends and what was assumed, a line each."""
    graph = verdict.explored.graph
    states = f"{len(graph.edges)} states" + (
        f", {graph.unexplored} of them were not looked at" if graph.unexplored else ", all of them"
    )
    time = (
        "as long as it takes" if math.isinf(verdict.longest_s) else f"at most {_duration(verdict.longest_s)}"
    )
    lines = [f"{states}; it takes {time}", f"it fails with: {_few_codes(verdict)}"]
    if verdict.assumed:
        lines.append(f"complete up to this: {'; '.join(verdict.assumed)}")
    if verdict.coarse:
        lines.append("what takes more than 5 s was let end at any moment, which is more than can happen")
    if verdict.called:
        lines.append(f"broken or not all explored, and called by it: {', '.join(verdict.called)}")
    return lines


def _codes(verdict: Verdict) -> str:
    return ", ".join(sorted(verdict.codes)) or "nothing"


def _few_codes(verdict: Verdict) -> str:
    """Return the codes, one for all that nothing in the mission tells apart."""
    ends = verdict.explored.graph.endings.values()
    classes = {
        min(known): known for each in ends if each.status == "FAILED" if (known := codes_behind(each.code))
    }
    shown = [
        f"{code} or {len(known) - 1} like it" if len(known) > 1 else code
        for code, known in sorted(classes.items())
    ]
    return ", ".join(shown) or "nothing"


def _duration(seconds: float) -> str:
    return quantity_text(math.ceil(seconds), Kind.DURATION, 3)


def _problem(verdict: Verdict, problem: Problem) -> list[str]:
    place = str(problem.file or verdict.mission.file)
    place += f":{problem.position.line}" if problem.position is not None else ""
    lines = [f"  {problem.severity}: {problem.text}", f"    {place}"]
    if problem.path:
        lines += ["    It comes like this:", *(f"      {line}" for line in way_to(verdict, problem))]
    return lines


def way_to(verdict: Verdict, problem: Problem) -> list[str]:
    """Return what happens on the way to a problem, a line each with its time."""
    return _trace(replay(verdict.explored, problem.path))


def _trace(played: Replayed) -> list[str]:
    shown = [(when, text) for when, each in played.lines if (text := _line(each))]
    width = max((len(f"{when:g}") for when, _ in shown), default=1)
    return [f"{when:>{width}g} s  {text}" for when, text in shown]


_BY_PEOPLE = {
    "pause": "somebody pauses the mission, and lets it go on",
    "stop": "somebody stops the mission",
    "override": "somebody takes the robot over",
}


def _line(each: Happening) -> str:
    """Write what happened as a trace does."""
    name = each.path.rsplit("/", 1)[-1]
    if each.what == "start":
        return f"{name}: RUNNING" if each.skill != "finally" else f"{name}: clean-up"
    if each.what == "end" and each.result is not None:
        if each.result.succeeded:
            return f"{name}: SUCCESS"
        return (
            f"{name}: stopped" if each.result.code == "cancelled" else f"{name}: FAILURE {each.result.code}"
        )
    if each.what == "unwanted":
        return f"here it holds: {each.text.removeprefix('never: ')}"
    return _BY_PEOPLE.get(each.what, "")


def table_of(verdicts: Iterable[Verdict]) -> str:
    """Write a table of missions in Markdown: states, seconds, the longest time, the codes."""
    rows = ["| mission | states | takes at most | fails with | |", "|---|---:|---:|---|---|"]
    for each in verdicts:
        time = "as long as it takes" if math.isinf(each.longest_s) else _duration(each.longest_s)
        states = len(each.explored.graph.edges)
        state = "holds" if each.holds else headline_of(each)
        rows.append(f"| `{each.mission.name}` | {states} | {time} | {_codes(each)} | {state} |")
    return "\n".join(rows)
