"""Finds what can never hold in ``then`` and ``expect``, before anything is played."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from florence_bt.core.errors import closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar
from florence_bt.mission_testing.paths import MissionMap
from florence_bt.mission_testing.scenarios._reading import Reading
from florence_bt.runtime.run import RunStatus

Entries = Mapping[str, tuple[YamlScalar, YamlNode]]

RUN_CODES = frozenset({"internal_error", "timed_out", "spinning", "failed", "cancelled"})
"""Codes with which the executor itself ends a run, whatever its mission is."""
STOPPED_CODE = "stopped"
_STOPS = ("stop", "override", "start")
"""What can stop a run: a start may preempt it."""


def check_sense(
    reading: Reading,
    entries: Entries,
    status: RunStatus | None,
    places: MissionMap | None,
    happens: Collection[str] | None = None,
) -> None:
    """Note what can never hold.

    Args:
        reading: Notes what is wrong.
        entries: What is expected, by key.
        status: The status that is expected, None when none is.
        places: The nodes of the mission; None when it is not known.
        happens: What happens before, as far as that is known.
    """
    _check_code(reading, entries, status, places)
    _check_ending(reading, entries, status, places)
    _check_times(reading, entries)
    _check_calls(reading, entries)
    if happens is not None and status is not None:
        _check_status(reading, entries["status"][1].position, status, happens)


def _check_code(
    reading: Reading, entries: Entries, status: RunStatus | None, places: MissionMap | None
) -> None:
    source = entries["code"][1] if "code" in entries else None
    if not isinstance(source, YamlScalar) or places is None or not source.text:
        return
    code = source.text
    fails = places.prospects.codes | RUN_CODES
    known = {
        None: {"ok", STOPPED_CODE, *fails},
        RunStatus.SUCCEEDED: {"ok"},
        RunStatus.STOPPED: {STOPPED_CODE},
        RunStatus.FAILED: fails,
    }.get(status)
    if known is None or code in known:
        return
    word = f"a run that is {status.value}" if status is not None else "a run"
    if status is None or status is RunStatus.FAILED:
        word = places.mission
    reading.problem(source.position, f"{word} cannot end with the code {code!r}", closest_first(code, known))


def _check_ending(
    reading: Reading, entries: Entries, status: RunStatus | None, places: MissionMap | None
) -> None:
    if status is None:
        return
    never: tuple[str, ...] = ()
    if not status.final:
        never = ("duration", "within", "code", "leaf", "outputs")
        why = f"a run that is {status.value} has not ended"
    elif status is RunStatus.SUCCEEDED:
        never = ("reason", "leaf")
        why = "a run that is SUCCEEDED has no cause of a failure"
        if places is not None and not places.prospects.can_succeed:
            reading.problem(entries["status"][1].position, f"{places.mission} cannot succeed", ["FAILED"])
    else:
        never = ("outputs",)
        why = f"a run that is {status.value} gives no outputs"
    for name in never:
        key, value = entries.get(name, (None, None))
        if key is not None and value is not None and not _nothing(value):
            reading.problem(key.position, f"{name} can never hold: {why}", ["leaving it out"])


def _nothing(value: YamlNode) -> bool:
    return (isinstance(value, YamlMapping) and not value.entries) or (
        isinstance(value, YamlScalar) and not value.text
    )


def _check_times(reading: Reading, entries: Entries) -> None:
    if "duration" not in entries or "within" not in entries:
        return
    sources = [entries[name][1] for name in ("duration", "within")]
    before = len(reading.findings)
    duration, within = (reading.duration(source, "a duration") for source in sources)
    del reading.findings[before:]  # whoever reads the keys tells what is wrong with them
    if duration is not None and within is not None and duration > within:
        position = entries["within"][0].position
        reading.problem(position, "within is shorter than duration", ["leaving it out"])


def _check_calls(reading: Reading, entries: Entries) -> None:
    """A skill that is called and not called."""
    called = {text.text: text.position for text in _called(reading, entries)}
    for item in reading.items(entries["not_called"][1]) if "not_called" in entries else ():
        if isinstance(item, YamlScalar) and item.text in called:
            message = f"{item.text!r} cannot be called (line {called[item.text].line}) and not called"
            reading.problem(item.position, message, ["one of the two"])


def _called(reading: Reading, entries: Entries) -> Iterator[YamlScalar]:
    """The patterns that are called at least once."""
    for name in ("calls", "only_calls", "called"):
        value = entries[name][1] if name in entries else None
        if isinstance(value, YamlMapping) and name == "called":
            for key, times in value.entries:
                count = times.get("times") if isinstance(times, YamlMapping) else times
                if not isinstance(count, YamlScalar) or count.text != "0":
                    yield key
            continue
        for item in reading.items(value):
            if isinstance(item, YamlScalar):
                yield item
            elif isinstance(item, YamlMapping):
                yield from (key for key, _ in item.entries)


def _check_status(reading: Reading, position: Position, status: RunStatus, happens: Collection[str]) -> None:
    wanted: tuple[str, ...] = ()
    if status is RunStatus.STOPPED:
        wanted = _STOPS
    elif status is RunStatus.PAUSED:
        wanted = ("pause",)
    if wanted and not any(word in happens for word in wanted):
        reading.problem(
            position,
            f"the run cannot be {status.value}: nothing under 'when' does that",
            [f"when: [{{at: 3 s, {wanted[0]}: enough}}]"],
        )
    elif status is RunStatus.QUEUED:
        message = "the mission of a scenario starts first and is never QUEUED"
        reading.problem(position, message, ["runs: {NAME: {status: QUEUED}}", "RUNNING"])
