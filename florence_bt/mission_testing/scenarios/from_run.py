"""Makes a scenario of a recorded run: its skills are mocked to answer as they did, people act as they did.

What must hold in the end comes from playing it: what the recorded run did is what is expected.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, zip_longest
from pathlib import Path
from typing import Any

from florence_bt.behaviours.cleaning_up import CLEANUP
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome
from florence_bt.mission_testing.paths import MissionMap, map_mission
from florence_bt.mission_testing.record import NodeRecord
from florence_bt.mission_testing.scenarios.scenario import Scenario, ScenarioResult, run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.mission_testing.test_run import TestRun
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.journal import JournaledEvent, JournaledRun
from florence_bt.runtime.journal.rows import typed
from florence_bt.runtime.journal.text import match_ends, with_one_clock
from florence_bt.runtime.replay.moments import FROM_OUTSIDE
from florence_bt.trees.language.findings import ERROR
from florence_bt.trees.language.loader import MissionLibrary

MARK = "# A recorded run as a scenario"
"""First line of such a file."""
LEAST_RUNNING_S = 1e-6
"""Least time of a skill that does not answer within its start."""
OVERRIDE = "manual override: "
"""Words of the executor before the reason of an override."""


@dataclass(frozen=True, slots=True)
class RecordedCall:
    """A start of a skill, and how it ended.

    Attributes:
        start: The start.
        end: The end; None when there is none.
        cancelled: When it was cancelled, seconds on the same clock; None when it ended by itself.
        until_change: Seconds until its skill reported a change, and was asked again for that; None without.
    """

    start: JournaledEvent
    end: JournaledEvent | None
    cancelled: float | None
    until_change: float | None


def scenario_of(
    row: JournaledRun,
    events: Sequence[JournaledEvent],
    library: MissionLibrary,
    declarations: Mapping[str, SkillDeclaration],
    libraries: Libraries,
    scratch: Path,
    named: str = "",
) -> str:
    """Write a scenario that does what a recorded run did.

    Args:
        row: The run.
        events: What happened in it, in order.
        library: The missions, as they were then.
        declarations: What the skills say about themselves.
        libraries: Where a scenario finds these missions.
        scratch: A folder for a file that is played.
        named: The folder of the mission for the finished file, relative to where that will be; empty for one
            that comes with Florence.

    Returns:
        The text of the file. It was played, did what the run did, and passed.

    Raises:
        ConfigError: No scenario can do that; says where it first does something else.
    """
    if any(event.kind == EventKind.HELD.value for event in events):
        raise ConfigError(f"the run {row.run_id} stood at a breakpoint, which no scenario can say")
    one_clock = list(with_one_clock(events))
    mission_map = map_mission(library.get(row.mission), library, declarations)
    writer = _Writer(row, one_clock, mission_map, library, declarations)
    played = _play(writer.text([f"status: {row.state}"]), libraries, scratch)
    if not played.runs:
        raise ConfigError(f"the run {row.run_id} cannot be played as a scenario: {_problem(played)}")
    test_run = played.runs[0]
    _compare(one_clock, test_run)
    expected = writer.expectation(test_run)
    again = _play(writer.text(expected), libraries, scratch)
    if not again.passed:
        raise ConfigError(f"the scenario of the run {row.run_id} does not pass: {_problem(again)}")
    return writer.text(expected, named)


def _play(text: str, libraries: Libraries, scratch: Path) -> ScenarioResult:
    file = scratch / "recorded_scenarios.yaml"
    file.write_text(text, encoding="utf-8")
    read = read_scenarios(file, libraries)
    wrong = [finding for finding in read.findings if finding.severity == ERROR]
    if wrong:
        raise ConfigError(
            f"the run cannot be written as a scenario: {wrong[0].message}", valid=wrong[0].valid
        )
    scenario: Scenario = read.scenarios[0]
    return run_scenario(scenario)


def _problem(result: ScenarioResult) -> str:
    return result.problems[0][1] if result.problems else "it was refused"


def _compare(events: Sequence[JournaledEvent], test_run: TestRun) -> None:
    """See that the played run did what the recorded one did, to the millisecond.

    Raises:
        ConfigError: It did not; says where.
    """
    recorded = NodeRecord(test_run.mission_map)
    for event in events:
        data = {"node": event.node, "old": event.old, "new": event.new, "reason": event.reason}
        recorded.note(RunEvent(event.time, "", EventKind(event.kind), data), event.tick)
    for then, now in zip_longest(recorded.changes(), test_run.record.changes()):
        if str(then) != str(now):
            raise ConfigError(
                f"no scenario does what this run did: recorded is {then or 'nothing more'}; "
                f"in the scenario comes {now or 'nothing more'}",
                valid=["florence replay --check, which replays what no scenario can say"],
            )


class _Writer:
    """Writes the file of a recorded run."""

    def __init__(
        self,
        row: JournaledRun,
        events: Sequence[JournaledEvent],
        mission_map: MissionMap,
        library: MissionLibrary,
        declarations: Mapping[str, SkillDeclaration],
    ) -> None:
        self._row = row
        self._events = events
        self._map = mission_map
        self._mission = library.get(row.mission)
        self._declarations = declarations
        begun = [event.time for event in events if event.kind == EventKind.STARTED.value]
        self._started = begun[0] if begun else events[0].time

    def text(self, expected: Sequence[str], named: str = "") -> str:
        """Return the file with these lines under ``then``."""
        row = self._row
        head = [f"{MARK}: {row.run_id}, which ended {row.state}.", f"mission: {row.mission}"]
        if named:
            head.append(f"missions: [{_quoted(named)}]")
        lines = [*head, "scenarios:", f"  - name: {_quoted(f'as in {row.run_id}')}", "    given:"]
        lines += [f"      inputs: {{{', '.join(self._inputs())}}}", "      skills:"]
        lines += [f"        {_quoted(pattern)}: {_quoted(script)}" for pattern, script in self._mocks()]
        acts = list(self._acts())
        lines += ["    when:", *(f"      - {{{act}}}" for act in acts)] if acts else []
        return "\n".join([*lines, "    then:", *(f"      {line}" for line in expected)]) + "\n"

    def expectation(self, test_run: TestRun) -> list[str]:
        """Return what must hold in the end, as it held when it was played."""
        lines = [f"status: {test_run.status}", f"code: {_quoted(test_run.code)}"]
        why = test_run.run.why
        if why is not None:
            lines.append(f"reason: {_quoted(why.reason)}")
            # The cause of a stop is the mission as a whole, which is none of its nodes.
            cause = self._map.nodes.get(why.path)
            lines += [f"leaf: {_quoted(cause.short)}"] if cause is not None else []
        if test_run.outputs:
            kinds = {name: port.kind for name, port in self._map.outputs.items()}
            outputs = (f"{name}: {_value(value, kinds[name])}" for name, value in test_run.outputs.items())
            lines.append(f"outputs: {{{', '.join(outputs)}}}")
        lines.append("only_calls:")
        lines += [
            f"  - {{{_quoted(call.node.short)}: {{{', '.join(self._given(call))}}}}}"
            for call in test_run.calls()
        ]
        trace = test_run.trace().splitlines()
        return [*lines, "trace:", *(f"  - {_quoted(line)}" for line in trace)]

    def _given(self, call: Any) -> Iterator[str]:
        ports = self._declarations[call.skill].inputs
        for name, value in call.inputs.items():
            yield f"{name}: {_value(value, ports[name].kind)}"

    def _inputs(self) -> Iterator[str]:
        ports = self._mission.inputs
        for name, value in self._row.typed_inputs(self._mission).items():
            yield f"{name}: {_value(value, ports[name].kind)}"

    # ---- skills ---------------------------------------------------------------------------------------

    def _mocks(self) -> Iterator[tuple[str, str]]:
        """Yield a pattern and a script for each node that has started a skill."""
        calls: dict[str, list[str]] = {}
        for call in self._calls():
            calls.setdefault(self._map.find(call.start.node).short, []).append(self._reply(call))
        for pattern, replies in calls.items():
            counted = ((reply, len(list(same))) for reply, same in groupby(replies))
            steps = [
                reply if count == 1 or " for " in reply[-20:] else f"{reply} {count} times"
                for reply, count in counted
            ]
            yield pattern, ", then ".join(steps)

    def _calls(self) -> Iterator[RecordedCall]:
        ends = dict(match_ends(self._events))
        starts = [
            index
            for index, event in enumerate(self._events)
            if event.kind == EventKind.SKILL_STARTED.value and event.skill != CLEANUP
        ]
        for number, index in enumerate(starts):
            start = self._events[index]
            end = ends.get(index)
            later = (self._events[n] for n in starts[number + 1 :] if self._events[n].node == start.node)
            following = next(later, None)
            yield RecordedCall(
                start,
                self._events[end] if end is not None else None,
                self._cancelled(index, end),
                self._until_change(start, following),
            )

    def _until_change(self, start: JournaledEvent, following: JournaledEvent | None) -> float | None:
        reports = self._declarations[start.skill].reports_changes
        if following is None or not reports or not following.data.get("again"):
            return None
        return following.time - start.time

    def _cancelled(self, start: int, end: int | None) -> float | None:
        """Return when a run was cancelled: the last time before its end that its node was left, or all."""
        if end is None or not self._events[end].data.get("between_ticks"):
            return None
        node = self._events[start].node
        root = node.split("/")[0]
        times = [
            event.time
            for event in self._events[start:end]
            if event.kind in FROM_OUTSIDE
            or (event.kind == EventKind.NODE.value and event.node in (node, root) and event.new != "RUNNING")
        ]
        return times[-1] if times else None

    def _reply(self, call: RecordedCall) -> str:
        """Write what a run of a skill did as a step of a script."""
        start, end = call.start, call.end
        if end is None:
            return "never ends"
        clauses = []
        if end.data.get("outcome") == Outcome.CANCELLED.value:
            took = end.time - (call.cancelled if call.cancelled is not None else end.time)
            clauses += [f"cancel takes {_seconds(took)}"] if took > 0.0 else []
            return ", ".join([*clauses, "never ends"])
        took = end.time - start.time
        if call.cancelled is not None:
            clauses.append(f"cancel takes {_seconds(took + 1.0)}")  # it ended by itself before that
        if took > 0.0 or end.tick != start.tick:
            clauses.append(f"running {_seconds(max(took, LEAST_RUNNING_S))}")
        ending = self._ending(end)
        if call.until_change is not None:
            ending += f" for {_seconds(call.until_change)}"
        return ", then ".join([*clauses, ending])

    def _ending(self, end: JournaledEvent) -> str:
        if end.data.get("outcome") == Outcome.SUCCEEDED.value:
            ports = self._declarations[end.skill].outputs
            outputs = [
                f"{name}={_in_script(typed(value, ports[name]), ports[name])}"
                for name, value in end.outputs.items()
            ]
            return f"SUCCESS ({', '.join(outputs)})" if outputs else "SUCCESS"
        reason = end.reason.replace('"', "'")
        return f'FAILURE {end.code} "{reason}"'

    # ---- people ---------------------------------------------------------------------------------------

    def _acts(self) -> Iterator[str]:
        """Yield what people did; a crash that the run survived is a pause of no time."""
        overridden = False
        for event in self._events:
            at = f"at: {_seconds(event.time - self._started)}"
            match event.kind:
                case EventKind.PAUSED.value:
                    yield f"{at}, pause: {_quoted(event.reason)}"
                case EventKind.RESUMED.value:
                    yield f"{at}, resume: "
                case EventKind.RECOVERED.value:
                    yield f"{at}, pause: {_quoted('the process died')}"
                    if not event.data.get("paused"):
                        yield f"{at}, resume: "
                case EventKind.OVERRIDDEN.value:
                    overridden = True
                    yield f"{at}, override: {_quoted(event.reason.removeprefix(OVERRIDE))}"
                case EventKind.STOP_ASKED.value if not overridden:
                    yield f"{at}, stop: {_quoted(event.reason)}"


def _value(value: Any, kind: Kind) -> str:
    """Write a value exactly, quoted for YAML."""
    return _quoted(_exact(value, kind))


def _exact(value: Any, kind: Kind) -> str:
    """Write a value (SI units) so that reading it gives it again, to a nanometre and the like."""
    if kind.item is not None:
        return f"[{', '.join(_in_list(each, kind.item) for each in value)}]"
    match kind:
        case Kind.BOOLEAN:
            return "true" if value else "false"
        case Kind.LENGTH:
            return f"{_number(value)} m"
        case Kind.ANGLE:
            return f"{_number(value)} rad"
        case Kind.DURATION:
            return f"{_number(value)} s"
        case Kind.SPEED:
            return f"{_number(value)} m/s"
        case Kind.NUMBER:
            return _number(value)
        case Kind.POSE if isinstance(value, Pose2):
            return f"{{x: {_number(value.x)} m, y: {_number(value.y)} m, yaw: {_number(value.yaw)} rad}}"
    return str(value)


def _in_list(value: Any, kind: Kind) -> str:
    return json.dumps(value, ensure_ascii=False) if kind is Kind.TEXT else _exact(value, kind)


def _in_script(value: Any, port: Port) -> str:
    """Write an output for a script; a text is quoted there.

    Raises:
        ConfigError: It has both kinds of quotes.
    """
    if port.kind is not Kind.TEXT:
        return _exact(value, port.kind)
    quote = "'" if '"' in value else '"'
    if quote in value:
        raise ConfigError(f"a script cannot hold the text {value!r}: it has both kinds of quotes")
    return f"{quote}{value}{quote}"


def _number(value: float) -> str:
    if isinstance(value, int):
        return str(value)
    return f"{value:.9f}".rstrip("0").rstrip(".")


def _seconds(value: float) -> str:
    return f"{_number(max(float(value), 0.0))} s"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
