"""The status of a run as text for people: one head line, the tree, the reason."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from florence_bt.behaviours.keys import readable
from florence_bt.core.declaration import Kind
from florence_bt.runtime.events import plain
from florence_bt.runtime.run import MissionRun, RunStatus
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.trees.drawings.ascii import TreeRow


def run_tree(
    run: MissionRun | None,
    now: float,
    warnings: Iterable[str] = (),
    *,
    nodes: tuple[TreeRow, ...] = (),
    text: str = "",
    accepted: str = "",
) -> RunTree:
    """Make what is shown of a run.

    Args:
        run: The run to describe, None when there was none yet.
        now: The clock's time, for the duration of a running mission.
        warnings: What else people should know, beside the run.
        nodes: The nodes of its tree.
        text: Its ASCII tree, where the nodes are not known.
        accepted: Date and time (UTC) at which the run was accepted, empty to leave it out.
    """
    if run is None:
        return RunTree(warnings=tuple(warnings))
    return RunTree(
        run_id=run.run_id,
        mission=run.mission,
        state=run.status.value,
        caller=run.request.caller,
        seconds=_seconds(run, now),
        notes=tuple(line for line in (details_line(run, accepted), note_line(run)) if line),
        nodes=nodes,
        text=text,
        outputs=dict(run.output_texts),
        why=why_line(run),
        warnings=tuple(warnings),
    )


def head_line(run: MissionRun, now: float) -> str:
    """Write one line: mission, status, duration, id and caller."""
    return run_tree(run, now).head


def duration_text(run: MissionRun, now: float) -> str:
    """Write how long a run took, or has taken; of one that died with its process what is known of it."""
    return run_tree(run, now).took


def _seconds(run: MissionRun, now: float) -> float | None:
    return None if run.started is None else (now if run.ended is None else run.ended) - run.started


_PARTS = {"x": Kind.LENGTH, "y": Kind.LENGTH, "yaw": Kind.ANGLE}
"""Kinds of the parts of a pose."""


def details_line(run: MissionRun, accepted: str = "") -> str:
    """Write when the run was accepted and with which inputs, as far as there is something to say."""
    date = accepted.replace("T", " ").partition(".")[0]
    inputs = values_text(plain(run.inputs), run.input_kinds)
    return " · ".join([*([f"accepted {date} UTC"] if date else []), *([f"inputs{inputs}"] if inputs else [])])


def values_text(values: Mapping[str, Any], kinds: Mapping[str, Kind]) -> str:
    """Write plain values by name in one line, each with a blank before it.

    Args:
        values: The values in SI units.
        kinds: What each of them is, as far as it is known: it gives the unit.
    """
    return "".join(f" {name}={_value(value, kinds.get(name))}" for name, value in values.items())


def outputs_text(run: MissionRun) -> str:
    """Write the outputs of a run in one line, as the mission language writes them; empty without any."""
    return run_tree(run, 0.0).outputs_line


def _value(value: Any, kind: Kind | None) -> str:
    if isinstance(value, Mapping):
        return f"({', '.join(f'{name} {_value(item, _PARTS.get(name))}' for name, item in value.items())})"
    if isinstance(value, list):
        item = kind.item if kind is not None else None
        return f"[{', '.join(_value(each, item) for each in value)}]"
    return repr(value) if isinstance(value, str) else readable(value, kind)


def why_line(run: MissionRun) -> str:
    """Write the cause of a failure, a stop or a pause, empty when there is none."""
    if run.status is RunStatus.PAUSED:
        return f"paused because: {run.paused}; go on with: florence resume"
    if run.why is None:
        return ""
    word = {RunStatus.STOPPED: "stopped", RunStatus.ABORTED: "aborted"}.get(run.status, "failed")
    return f"{word} because: {run.why.reason} [{run.why.code}] at {run.why.path}"


def note_line(run: MissionRun) -> str:
    """Write what the caller should know beside, empty when there is nothing."""
    return f"note: {run.note}" if run.note else ""


def status_text(
    run: MissionRun | None, tree: str, now: float, warnings: Iterable[str] = (), *, accepted: str = ""
) -> str:
    """Write the whole status: what :func:`run_tree` has, with the ASCII tree of the run."""
    return run_tree(run, now, warnings, accepted=accepted).text_with(tree)


RUN_STATES: dict[RunStatus, str] = {
    RunStatus.QUEUED: "PENDING",
    RunStatus.RUNNING: "ACTIVE",
    RunStatus.PAUSED: "ACTIVE",
    RunStatus.ENDING: "ACTIVE",
    RunStatus.SUCCEEDED: "SUCCEEDED",
    RunStatus.FAILED: "ABORTED",
    RunStatus.STOPPED: "PREEMPTED",
    RunStatus.ABORTED: "ABORTED",
}
"""Run status -> the goal states of the document (REFERENCE 10, seed strings), for ``run_state``."""
