"""Runs and events as rows of the journal, both ways. Pure: values in, values out."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import isfinite
from types import NoneType
from typing import Any

from py_trees.common import Status

from florence_bt.behaviours.why import Why
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.events import EventKind, RunEvent, plain
from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus, TriggerPolicy
from florence_bt.trees.language.model import Mission

_OWN_COLUMNS = ("node", "old", "new", "code", "reason", "skill")
_JSON_COLUMNS = ("inputs", "outputs")
_KNOWN = frozenset({*_OWN_COLUMNS, *_JSON_COLUMNS, "status"})
_NUMBER, _TEXT_OR_NULL = (int, float, NoneType), (str, NoneType)
_RUN_TYPES = (str, str, str, str, int, *[str] * 9, _NUMBER, _NUMBER, int, str, int)
_EVENT_TYPES = (int, (int, float), int, str, *[_TEXT_OR_NULL] * 9)
_KINDS = frozenset(kind.value for kind in EventKind)
_ENCODER = json.JSONEncoder(separators=(",", ":"))


@dataclass(frozen=True, slots=True)
class JournaledRun:
    """A run as it is in the journal.

    Attributes:
        run_id: Its name.
        mission: What ran.
        caller: Who asked.
        policy: What was to be done when another mission was running.
        priority: Its priority.
        inputs: Its inputs, plain values in SI units; poses as tables of x, y and yaw.
        version: Fingerprint of the mission's text, empty when unknown.
        accepted: Date and time (UTC) of its acceptance, empty when unknown.
        state: Name of a :class:`RunStatus`; of a run that died with its process the last one before.
        note: What its caller is also told.
        code: The short code of the end, empty before.
        reason: The reason of the end, empty before and after success.
        cause: The path of the node that caused the end.
        outputs: Its outputs as the mission language writes them; plain values in older journals.
        started: Clock time of the first tick, None before.
        ended: Clock time of the end, None before.
        ticks: Ticks so far.
        tree: The tree as text at the end, empty before.
        lost: How many of its events could not be kept.
    """

    run_id: str
    mission: str
    caller: str
    policy: str
    priority: int
    inputs: Mapping[str, Any]
    version: str
    accepted: str
    state: str
    note: str
    code: str
    reason: str
    cause: str
    outputs: Mapping[str, Any]
    started: float | None
    ended: float | None
    ticks: int
    tree: str
    lost: int

    @property
    def status(self) -> RunStatus:
        """The state of the run."""
        return RunStatus(self.state)

    def typed_inputs(self, mission: Mission | None) -> dict[str, Any]:
        """Return the inputs as its mission declares them, as far as it is known."""
        ports = mission.inputs if mission is not None else {}
        return {name: typed(value, ports.get(name)) for name, value in self.inputs.items()}

    def as_run(self) -> MissionRun:
        """Return the run with plain values, to be shown."""
        request = MissionRequest(
            self.mission, self.inputs, self.caller, TriggerPolicy(self.policy), self.priority
        )
        why = Why(self.cause, self.code, self.reason) if self.reason and self.status.final else None
        return MissionRun(
            self.run_id,
            request,
            self.inputs,
            self.status,
            self.started,
            self.ended,
            why,
            output_texts={name: str(value) for name, value in self.outputs.items()},
            tree=self.tree,
            ticks=self.ticks,
            note=self.note,
            paused=self.reason if self.status is RunStatus.PAUSED else "",
            version=self.version,
        )


@dataclass(frozen=True, slots=True)
class JournaledEvent:
    """An event as it is in the journal.

    Attributes:
        seq: Its number in the run, beginning with 1.
        time: Seconds on the clock of the process that ran it.
        tick: The tick in which it happened, or the last one before.
        kind: The value of an :class:`EventKind`.
        node: Path of the node, empty when none is concerned.
        old: Status of the node before.
        new: Status of the node from now on; at the end of a run that of the run.
        code: Short code of a failure.
        reason: A sentence for people.
        skill: Name of the skill.
        inputs: Its inputs as plain values.
        outputs: Its outputs as plain values.
        data: Anything else.
    """

    seq: int
    time: float
    tick: int
    kind: str
    node: str
    old: str
    new: str
    code: str
    reason: str
    skill: str
    inputs: Mapping[str, Any]
    outputs: Mapping[str, Any]
    data: Mapping[str, Any]


RUN_COLUMNS = ", ".join(field.name for field in fields(JournaledRun))
EVENT_COLUMNS = ", ".join(field.name for field in fields(JournaledEvent))


def run_values(run: MissionRun, accepted: str) -> tuple[Any, ...]:
    """Return the values of :data:`RUN_COLUMNS` for a new run."""
    request = run.request
    head = (run.run_id, run.mission, request.caller, request.policy.value, request.priority)
    return (*head, _json(run.inputs), run.version, accepted, *_state_values(run), 0)


def run_changes(run: MissionRun, lost: int) -> tuple[Any, ...]:
    """Return the values for ``UPDATE runs``, in the order of :data:`CHANGED_COLUMNS`."""
    return (*_state_values(run), lost)


CHANGED_COLUMNS = ("state", "note", "code", "reason", "cause", "outputs", "started", "ended", "ticks", "tree")


def _state_values(run: MissionRun) -> tuple[Any, ...]:
    cause = run.why.path if run.why is not None and run.status.final else ""
    reason = run.reason if run.status.final else run.paused
    tree = run.tree if run.status.final else ""
    outputs = _json(run.output_texts)
    times = (run.started, run.ended)
    return (run.status.value, run.note, run.code, reason, cause, outputs, *times, run.ticks, tree)


def event_values(seq: int, event: RunEvent) -> tuple[Any, ...]:
    """Return the values of :data:`EVENT_COLUMNS` for an event."""
    data = event.data
    find = data.get
    own = [find(name) for name in _OWN_COLUMNS]
    own[2] = find("status", own[2])
    tables = [_json(table) if (table := find(name)) else None for name in _JSON_COLUMNS]
    # Most events are changes of nodes, which have nothing else.
    more = None if _KNOWN.issuperset(data) else _json({k: data[k] for k in data if k not in _KNOWN})
    return (seq, event.time, event.tick, event.kind.value, *own, *tables, more)


def run_from_row(row: Sequence[Any]) -> JournaledRun:
    """Make a run from the values of :data:`RUN_COLUMNS`.

    Raises:
        ValueError: A value is damaged; names its column.
    """
    _check_types(RUN_COLUMNS, _RUN_TYPES, row)
    values = list(row)
    values[5] = _mapping(values[5])
    values[13] = _mapping(values[13])
    RunStatus(values[8])
    TriggerPolicy(values[3])
    return JournaledRun(*values)


def event_from_row(row: Sequence[Any]) -> JournaledEvent:
    """Make an event from the values of :data:`EVENT_COLUMNS`.

    Raises:
        ValueError: A value is damaged; names its column.
    """
    _check_types(EVENT_COLUMNS, _EVENT_TYPES, row)
    head, texts, tables = row[:4], row[4:10], row[10:]
    if head[3] not in _KINDS or (head[3] == EventKind.NODE.value and row[6] not in Status.__members__):
        raise ValueError(f"an event of the kind {head[3]!r:.50} with the status {row[6]!r:.50}")
    return JournaledEvent(
        *head, *(text or "" for text in texts), *(_mapping(table) if table else {} for table in tables)
    )


def typed(value: Any, port: Port | None) -> Any:
    """Convert a plain value of the journal to the kind of a port."""
    is_pose = isinstance(value, Mapping) and value.keys() == {"x", "y", "yaw"}
    if port is not None and port.kind is Kind.POSE and is_pose:
        return Pose2(**value)
    if port is not None and port.kind.item is not None and isinstance(value, list):
        return tuple(typed(item, Port(port.kind.item, "")) for item in value)
    return value


def _check_types(columns: str, types: Sequence[Any], row: Sequence[Any]) -> None:
    """Check the types: SQLite keeps a value of any type in any column."""
    for index, value in enumerate(row):
        if not isinstance(value, types[index]) or (type(value) is float and not isfinite(value)):
            raise ValueError(f"{columns.split(', ')[index]} is {value!r:.50}")


def _mapping(text: str) -> Mapping[str, Any]:
    try:
        value = json.loads(text)
    except RecursionError as error:
        raise ValueError("a JSON value is nested too deeply") from error
    if not isinstance(value, dict):
        raise ValueError(f"a JSON object was expected, not {text:.50}")
    return value


def _json(value: Any) -> str:
    return _ENCODER.encode(plain(value))
