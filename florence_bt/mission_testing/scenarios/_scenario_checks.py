"""The part of a scenario under ``then``: what must hold."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from typing import Any

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlScalar, YamlSequence
from florence_bt.mission_testing.paths import MissionMap, Place, matching
from florence_bt.mission_testing.play import Play
from florence_bt.mission_testing.record import INVALID, STATUSES
from florence_bt.mission_testing.scenarios._reading import Reading, plain
from florence_bt.mission_testing.scenarios._scenario_sense import check_sense
from florence_bt.mission_testing.scenarios.scenario import Check, Expectation
from florence_bt.mission_testing.trace import read_line
from florence_bt.mission_testing.values import read_kind
from florence_bt.runtime.run import RunStatus

THEN_KEYS = (
    *("status", "code", "reason", "leaf", "outputs", "keys", "duration", "within", "calls", "only_calls"),
    *("called", "not_called", "nodes", "trace", "tree"),
)
"""What may stand under ``then`` and ``expect``."""
STATUS_WORDS = {
    **{status.value.lower(): status for status in RunStatus},
    "success": RunStatus.SUCCEEDED,
    "failure": RunStatus.FAILED,
}
"""How the status of a run may be written, in any case."""
GO_ON = frozenset({RunStatus.QUEUED, RunStatus.RUNNING, RunStatus.PAUSED, RunStatus.ENDING})

Assertion = Callable[[Play], object]


def read_expectation(
    reading: Reading,
    source: YamlNode | None,
    places: MissionMap | None,
    what: str,
    happens: Collection[str] | None = None,
) -> Expectation:
    """Read the table under ``then`` or ``expect``.

    Args:
        reading: Notes what is wrong.
        source: The table.
        places: The nodes of the mission; None when it is not known.
        what: What the table is called, for messages.
        happens: What happens before; None when that is not known.
    """
    if isinstance(source, YamlScalar) and source.text.lower() in STATUS_WORDS:
        valid = [f"{what}: {{status: {source.text}}}"]
        reading.problem(source.position, f"{what} must be a table (key: value)", valid)
        source = None
    entries = reading.entries(source, what, THEN_KEYS)
    checks: list[Check] = []
    status: RunStatus | None = None
    for name, (key, value) in entries.items():
        before = len(reading.findings)
        if name == "status":
            status = _status(reading, value)
            assertions: list[Assertion] = []
            if status is not None:
                assertions.append(partial(Play.assert_status, status=status.value))
        else:
            assertions = _READERS[name](reading, value, places)
        if not assertions and len(reading.findings) == before:
            reading.problem(key.position, f"{name} expects nothing", ["leaving it out"])
        checks += [Check(assertion, key.position) for assertion in assertions]
    check_sense(reading, entries, status, places, happens)
    return Expectation(tuple(checks), status in GO_ON)


def _status(reading: Reading, value: YamlNode) -> RunStatus | None:
    word = reading.text(value, "status")
    if word is None:
        return None
    if word.lower() not in STATUS_WORDS:
        close = closest_first(word.lower(), STATUS_WORDS)
        known = close if len(close) <= 3 else tuple(STATUS_WORDS)
        reading.problem(value.position, f"a run has no status {word!r}", [name.upper() for name in known])
        return None
    return STATUS_WORDS[word.lower()]


def _code(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    text = reading.text(value, "code")
    return [partial(Play.assert_why, code=text)] if text is not None else []


def _reason(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    text = reading.text(value, "reason")
    return [partial(Play.assert_why, reason=text)] if text is not None else []


def _leaf(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    text = reading.text(value, "leaf")
    if text is None or not isinstance(value, YamlScalar) or reading.pattern(value, places) is None:
        return []
    return [partial(Play.assert_why, leaf=text)]


def _outputs(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    """Outputs by name; an empty table stands for none at all."""
    if places is None:
        return [lambda play: play]
    wanted: dict[str, Any] = {}
    for key, item in reading.table(value, "outputs"):
        port = places.outputs.get(key.text)
        if port is None:
            valid = closest_first(key.text, places.outputs) or ("no outputs",)
            reading.problem(key.position, f"{places.mission} has no output {key.text!r}", valid)
            continue
        try:
            wanted[key.text] = read_kind(plain(item), port.kind)
        except ConfigError as error:
            reading.wrong(item.position, error)
    if isinstance(value, YamlMapping) and not value.entries:
        return [_assert_no_outputs]
    return [partial(Play.assert_outputs, outputs=wanted)] if wanted else []


def _assert_no_outputs(play: Play) -> None:
    if play.outputs:
        play.fail(f"{play.run.mission} gave the outputs {', '.join(play.outputs)}, not none")


def _keys(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    wanted: dict[str, Any] = {}
    for key, item in reading.table(value, "keys"):
        wanted[key.text] = plain(item)
        if places is None:
            continue
        kind = places.prospects.kinds.get(key.text)
        try:
            if key.text not in places.prospects.keys:
                valid = closest_first(key.text, places.prospects.keys) or ("no keys",)
                reading.problem(key.position, f"{places.mission} has no key {key.text!r}", valid)
            elif kind is not None:
                wanted[key.text] = read_kind(plain(item), kind)
        except ConfigError as error:
            reading.wrong(item.position, error)
    return [partial(Play.assert_keys, keys=wanted)] if wanted else []


def _duration(
    reading: Reading, value: YamlNode, places: MissionMap | None, *, at_most: bool = False
) -> list[Assertion]:
    seconds = reading.duration(value, "a duration")
    if seconds is None:
        return []
    return [lambda play: play.assert_duration(seconds, at_most=at_most)]


def _calls(
    reading: Reading, value: YamlNode, places: MissionMap | None, *, only: bool = False
) -> list[Assertion]:
    """Calls in their order: patterns, or tables of a pattern and inputs."""
    wanted: list[tuple[str, Mapping[str, Any]]] = []
    for item in reading.items(value):
        if isinstance(item, YamlScalar):
            pairs: tuple[tuple[YamlScalar, YamlNode | None], ...] = ((item, None),)
        elif isinstance(item, YamlMapping) and len(item.entries) == 1:
            pairs = item.entries
        else:
            reading.problem(
                item.position, "a call is a skill, or a skill and inputs", ["turn: {angle: 45 deg}"]
            )
            continue
        for key, inputs in pairs:
            found = reading.pattern(key, places, skills_only=True)
            if found is not None:
                wanted.append((key.text, _inputs(reading, inputs, found)))
    return [lambda play: play.assert_calls(wanted, only=only)] if wanted or only else []


def _inputs(reading: Reading, source: YamlNode | None, users: list[Place]) -> dict[str, Any]:
    """The inputs that a call must have, in SI units."""
    wanted: dict[str, Any] = {}
    count = isinstance(source, YamlScalar) and source.text.isdigit() and users
    valid = (
        [f"called: {{{users[0].skill}: {source.text}}}"] if count and isinstance(source, YamlScalar) else []
    )
    for key, item in reading.table(source, "the inputs of a call", valid=valid):
        for skill in dict.fromkeys(place.skill for place in users if place.skill):
            ports = reading.declarations[skill].inputs
            if key.text not in ports:
                reading.problem(
                    key.position,
                    f"{skill} has no input {key.text!r}",
                    closest_first(key.text, ports) or ("no inputs",),
                )
                break
            try:
                wanted[key.text] = read_kind(plain(item), ports[key.text].kind)
            except ConfigError as error:
                reading.wrong(item.position, error)
                break
    return wanted


def _called(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    """Numbers of calls by pattern; or a list of patterns that were called at least once."""
    assertions: list[Assertion] = []
    if not isinstance(value, YamlMapping):
        for item in reading.items(value):
            if isinstance(item, YamlScalar) and reading.pattern(item, places, skills_only=True) is not None:
                assertions.append(partial(_assert_called, pattern=item.text, times=None, inputs={}))
        return assertions
    for key, item in value.entries:
        users = reading.pattern(key, places, skills_only=True, unused=True)
        if users is None:
            continue
        inputs: dict[str, Any] = {}
        times_source = item.get("times") if isinstance(item, YamlMapping) else item
        times = reading.whole(times_source, "a number of calls", 0) if times_source is not None else None
        if isinstance(item, YamlMapping):
            rest = tuple((k, v) for k, v in item.entries if k.text != "times")
            inputs = _inputs(reading, YamlMapping(rest, item.position), users)
        assertions.append(partial(_assert_called, pattern=key.text, times=times, inputs=inputs))
    return assertions


def _assert_called(play: Play, pattern: str, times: int | None, inputs: Mapping[str, Any]) -> None:
    play.assert_called(pattern, times=times, inputs=inputs)


def _not_called(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    assertions: list[Assertion] = []
    for item in reading.items(value):
        name = reading.text(item, "a skill")
        if name is None or not isinstance(item, YamlScalar):
            continue
        if reading.pattern(item, places, skills_only=True, unused=True) is not None:
            assertions.append(partial(_assert_called, pattern=name, times=0, inputs={}))
    return assertions


def _nodes(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    """Statuses by pattern: every node that it means has the status."""
    assertions: list[Assertion] = []
    for key, item in reading.table(value, "nodes"):
        status = (reading.text(item, "the status of a node") or "").upper()
        if status not in STATUSES:
            reading.problem(item.position, f"a node has no status {status!r}", STATUSES)
        elif reading.pattern(key, places) is not None:
            assertions.append(partial(_assert_nodes, pattern=key.text, status=status))
    return assertions


def _assert_nodes(play: Play, pattern: str, status: str) -> None:
    for place in matching(pattern, play.places.places.values()):
        now = play.record.statuses.get(place.path, INVALID)
        if now != status:
            play.fail(f"{place.short} is {now}, not {status}")


def _trace(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    """The lines of a trace, or a table of ``of`` (a pattern), ``inner`` and ``lines``."""
    pattern, inner = "**", False
    if isinstance(value, YamlMapping):
        entries = reading.entries(value, "trace", ("of", "inner", "lines"))
        if "of" in entries:
            pattern = reading.text(entries["of"][1], "of") or pattern
            if reading.pattern(YamlScalar(pattern, True, entries["of"][1].position), places) is None:
                return []
        inner = "inner" in entries and reading.flag(entries["inner"][1], "inner")
        if "lines" not in entries:
            reading.problem(value.position, "the trace has no lines", ["lines: [...]"])
            return []
        value = entries["lines"][1]
    lines = [line for item in reading.items(value) for line in _trace_lines(reading, item, places)]
    if not lines and not isinstance(value, YamlSequence):
        return []
    return [lambda play: play.assert_trace("\n".join(lines), pattern, inner=inner)]


def _trace_lines(reading: Reading, item: YamlNode, places: MissionMap | None) -> Iterator[str]:
    """The lines in one item of a list: one, or those of a block of text."""
    for text in (reading.text(item, "a line of a trace") or "").splitlines():
        try:
            line = read_line(text)
        except ConfigError as error:
            reading.wrong(item.position, error)
            continue
        if reading.pattern(YamlScalar(line.node, True, item.position), places) is not None:
            yield text


def _tree(reading: Reading, value: YamlNode, places: MissionMap | None) -> list[Assertion]:
    text = reading.text(value, "tree")
    return [partial(Play.assert_tree, expected=text)] if text is not None else []


_READERS: dict[str, Callable[[Reading, YamlNode, MissionMap | None], list[Assertion]]] = {
    "code": _code,
    "reason": _reason,
    "leaf": _leaf,
    "outputs": _outputs,
    "keys": _keys,
    "duration": _duration,
    "within": partial(_duration, at_most=True),
    "calls": _calls,
    "only_calls": partial(_calls, only=True),
    "called": _called,
    "not_called": _not_called,
    "nodes": _nodes,
    "trace": _trace,
    "tree": _tree,
}
