"""The status of a run as text for people: one head line, the tree, the reason."""

from __future__ import annotations

from florence_bt.runtime.events import seconds_text
from florence_bt.runtime.run import MissionRun, RunStatus


def head_line(run: MissionRun, now: float) -> str:
    """One line: mission, status, duration, id and caller."""
    duration = seconds_text(run.started, run.ended if run.ended is not None else now)
    parts = [
        f"{run.mission}: {run.status.value}",
        duration,
        f"run {run.run_id}",
        f"asked by {run.request.caller}",
    ]
    return " · ".join(part for part in parts if part)


def why_line(run: MissionRun) -> str:
    """The cause of a failure or a stop, empty when there is none."""
    if run.why is None:
        return ""
    word = "stopped" if run.status is RunStatus.STOPPED else "failed"
    return f"{word} because: {run.why.reason} [{run.why.code}] at {run.why.path}"


def status_text(run: MissionRun | None, tree: str, now: float) -> str:
    """The whole status.

    Args:
        run: The run to describe, None when there was none yet.
        tree: Its ASCII tree.
        now: The clock's time, for the duration of a running mission.
    """
    if run is None:
        return "no mission has run yet"
    return "\n".join(line for line in (head_line(run, now), tree.rstrip("\n"), why_line(run)) if line)


RUN_STATES: dict[RunStatus, str] = {
    RunStatus.QUEUED: "PENDING",
    RunStatus.RUNNING: "ACTIVE",
    RunStatus.ENDING: "ACTIVE",
    RunStatus.SUCCEEDED: "SUCCEEDED",
    RunStatus.FAILED: "ABORTED",
    RunStatus.STOPPED: "PREEMPTED",
}
"""Run status -> the goal states of the document (REFERENCE 10, seed strings), for ``run_state``."""
