"""One run of one mission: what was asked, its state, how it ended. Data; the executor acts on it."""

from __future__ import annotations

import enum
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

from florence_bt.behaviours.why import Why
from florence_bt.core.declaration import Kind
from florence_bt.trees.drawings.ascii import TreeRow


class RunStatus(enum.Enum):
    """The state of a run."""

    QUEUED = "QUEUED"
    RUNNING = "RUNNING"
    PAUSED = "PAUSED"
    """Its skills were cancelled, its tree is not ticked and no time passes for it."""
    ENDING = "ENDING"
    """The tree has ended or was stopped; skills that were cancelled have not all reported their end."""
    SUCCEEDED = "SUCCEEDED"
    FAILED = "FAILED"
    STOPPED = "STOPPED"
    ABORTED = "ABORTED"
    """The process that ran it died, and it was given up at the next start."""

    # Asked for in sets at every event; that of Enum is computed in Python.
    __hash__ = object.__hash__

    @property
    def final(self) -> bool:
        """Tell whether nothing can change any more."""
        return self in FINAL


FINAL = frozenset({RunStatus.SUCCEEDED, RunStatus.FAILED, RunStatus.STOPPED, RunStatus.ABORTED})
"""The states in which nothing can change any more."""


class TriggerPolicy(enum.Enum):
    """The wishes of a caller for when another mission is running (ARCHITECTURE.md, ROS surface)."""

    REJECT = "reject"
    QUEUE = "queue"
    PREEMPT = "preempt"


@dataclass(frozen=True, slots=True)
class MissionRequest:
    """A trigger.

    Attributes:
        mission: Name of the mission.
        inputs: Inputs by name, as given by the caller (texts are read like in a mission file).
        caller: Who asks, for the records.
        policy: What to do when another mission is running.
        priority: A higher number may preempt or overtake a lower one, never the other way round.
    """

    mission: str
    inputs: Mapping[str, Any] = field(default_factory=dict)
    caller: str = "unknown"
    policy: TriggerPolicy = TriggerPolicy.REJECT
    priority: int = 0


@dataclass(slots=True)
class MissionRun:
    """The life of one run.

    Attributes:
        run_id: Unique name, sorts by time.
        request: What was asked.
        inputs: The inputs in SI units with defaults filled in.
        input_kinds: What the inputs are, as far as it is known.
        status: The state of the run.
        started: Clock time of the first tick, None before.
        ended: Clock time of the end, None before.
        why: Cause of a failure or a stop.
        outputs: The mission's outputs, once it has succeeded.
        output_texts: The same as the mission language writes them, with units.
        tree: ASCII tree as of the end, with what was stopped and how the clean-ups ended; empty before.
        ticks: Ticks so far, the one that goes on now included.
        note: What the caller should know beside the run itself, e.g. that its edit is not used.
        paused: Why the run is paused, empty when it is not.
        rows: The nodes of :attr:`tree` with their durations, to be drawn in other ways; empty when unknown.
        version: Fingerprint of the mission's text and of everything that it calls; empty when unknown.
    """

    run_id: str
    request: MissionRequest
    inputs: Mapping[str, Any]
    status: RunStatus = RunStatus.QUEUED
    started: float | None = None
    ended: float | None = None
    why: Why | None = None
    outputs: Mapping[str, Any] = field(default_factory=dict)
    output_texts: Mapping[str, str] = field(default_factory=dict)
    tree: str = ""
    ticks: int = 0
    note: str = ""
    paused: str = ""
    version: str = ""
    rows: tuple[TreeRow, ...] = ()
    input_kinds: Mapping[str, Kind] = field(default_factory=dict)

    @property
    def mission(self) -> str:
        """Name of the mission."""
        return self.request.mission

    @property
    def reason(self) -> str:
        """The reason of the end in one sentence, empty after success and while running."""
        return self.why.reason if self.why else ""

    @property
    def code(self) -> str:
        """The short code of the end: ``ok`` after success, empty while running."""
        if self.status is RunStatus.SUCCEEDED:
            return "ok"
        return self.why.code if self.why else ""


class RunIds:
    """Makes run ids: the time of the trigger and a counter, so that they sort and never repeat in a process.

    Args:
        stamp: What the ids begin with, or a function that gives it for each, e.g. :func:`utc_stamp`.
            A date that was set back does not count: the latest stamp is used again.
    """

    def __init__(self, stamp: str | Callable[[], str]) -> None:
        self._stamp = stamp
        self._latest = ""
        self._count = 0

    def next(self, mission: str) -> str:
        """Make the id of the next run."""
        self._count += 1
        self._latest = max(self._latest, self._stamp if isinstance(self._stamp, str) else self._stamp())
        return f"{self._latest}-{self._count:03d}-{mission}"


RUN_ID = re.compile(r"\d{8}T\d{6}Z-\d+-.+")
"""The ids that begin with :func:`utc_stamp`; no mission has such a name."""


def utc_stamp() -> str:
    """Write the date and time of now in UTC, such as ``20240501T101500Z``."""
    return datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
