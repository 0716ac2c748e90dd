"""Decides what happens to a trigger while another mission runs. Pure: two requests in, a decision out."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from florence_bt.runtime.run import MissionRequest, MissionRun, TriggerPolicy
from florence_bt.runtime.run_queue import RunQueue


class Admission(enum.Enum):
    """The ways to treat a request."""

    START = "start"
    QUEUE = "queue"
    PREEMPT = "preempt"
    REJECT = "reject"


@dataclass(frozen=True, slots=True)
class Decision:
    """The way in which a request is treated, and the reason for the caller."""

    admission: Admission
    reason: str


def name_of(run: MissionRun) -> str:
    """Name a run in messages: mission, id and priority."""
    return f"{run.mission} (run {run.run_id}, priority {run.request.priority})"


def decide(
    request: MissionRequest,
    current: MissionRun | None,
    blocked_by: str | None = None,
    queue: RunQueue | None = None,
) -> Decision:
    """Decide about a request.

    Args:
        request: The new trigger.
        current: The run that is not over yet, if there is one.
        blocked_by: Why no mission may start at all, if that is so.
        queue: The runs that wait already.

    Returns:
        The decision. ``preempt`` needs a priority at least that of the current run. It may go one above the
        limit of the queue: the run that it stops gives its place to the next one.
    """
    if blocked_by is not None:
        return Decision(Admission.REJECT, blocked_by)
    if current is None:
        return Decision(Admission.START, f"{request.mission} starts")
    word = current.status.value.lower()
    busy = f"{current.mission} is {word} (run {current.run_id}, priority {current.request.priority})"
    match request.policy:
        case TriggerPolicy.QUEUE if queue is not None and queue.full:
            return Decision(
                Admission.REJECT,
                f"{busy} and {queue.limit} runs wait already, which is the limit; stop some of them, wait, "
                "or ask with policy 'preempt'",
            )
        case TriggerPolicy.QUEUE:
            return Decision(Admission.QUEUE, f"waits because {busy}")
        case TriggerPolicy.PREEMPT if request.priority < current.request.priority:
            return Decision(
                Admission.REJECT,
                f"{busy}, above the priority {request.priority} of this request; wait, stop it, or ask with "
                f"priority {current.request.priority} or more",
            )
        case TriggerPolicy.PREEMPT if queue is not None and queue.crowded:
            return Decision(
                Admission.REJECT,
                f"{busy} and {len(queue)} runs wait already, among them one that preempted it, which is one "
                "above the limit; stop some of them or ask again in a moment",
            )
        case TriggerPolicy.PREEMPT:
            return Decision(Admission.PREEMPT, f"replaces {current.run_id}")
        case _:
            return Decision(
                Admission.REJECT, f"{busy}; stop it first or ask with policy 'queue' or 'preempt'"
            )
