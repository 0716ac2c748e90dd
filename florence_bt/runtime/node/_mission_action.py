"""An action whose goals are runs of missions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from florence_interfaces.action import ExecuteMission, FollowMe, FollowUser

from florence_bt.core.outcome import Outcome
from florence_bt.ros.action_server import PREEMPTED, SingleGoalServer
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE
from florence_bt.runtime.background_check import BackgroundCheck
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import MissionRun, RunStatus

_OUTCOMES = {RunStatus.SUCCEEDED: Outcome.SUCCEEDED, RunStatus.STOPPED: Outcome.CANCELLED}


class MissionAction:
    """Serves an action: each goal starts a mission, and its result is that of the run.

    Attributes:
        run_id: The run of the goal that is worked on, None without one.

    Args:
        node: The node that serves it.
        missions: What runs the missions.
        edits: Reads and checks edited missions; a goal that comes during a check is refused.
        action_type: The action.
        name: Its name.
        start: Given the goal, starts a mission: (accepted, run id, why not).
        result: The result message for a run; for None, of a goal that a newer one replaced before it began.
    """

    def __init__(
        self,
        node: FlorenceNode,
        missions: Executor,
        edits: BackgroundCheck,
        action_type: Any,
        name: str,
        start: Callable[[Any], tuple[bool, str, str]],
        result: Callable[[MissionRun | None, str], Any],
    ) -> None:
        self._missions = missions
        self._edits = edits
        self._start = start
        self._result = result
        self._replaced: MissionRun | None = None
        self.run_id: str | None = None
        self._server = SingleGoalServer(
            node,
            action_type,
            name,
            on_goal=self._on_goal,
            on_cancel=self._on_cancel,
            on_replaced=lambda: result(
                self._replaced, f"replaced by {self.run_id}, a newer goal of the action"
            ),
        )

    def publish_feedback(self, message: Any) -> None:
        """Send feedback to the client of the goal that is worked on."""
        self._server.publish_feedback(message)

    def on_end(self, run: MissionRun) -> None:
        """A run has ended; if it is the goal's, its client gets the result."""
        if run.run_id != self.run_id:
            return
        self.run_id = None
        self._server.finish(self._result(run, ""), _OUTCOMES.get(run.status, Outcome.FAILED))

    def _on_goal(self, goal: Any) -> str | None:
        checked: list[str] = []
        self._edits.when_fresh(lambda problem, report: checked.append(problem))
        if not checked:
            return "missions were edited and are being checked; send the goal again in a moment"
        older = self.run_id
        accepted, run_id, message = self._start(goal)
        if not accepted:
            return message
        self.run_id = run_id
        self._replaced = self._missions.find(older) if older is not None else None
        if older is not None:
            # It may still wait in the queue; its client gets the result that it was replaced.
            self._missions.stop(f"replaced by {run_id}, a newer goal of the action", older)
        return None

    def _on_cancel(self) -> None:
        if self.run_id is not None:
            self._missions.stop("cancelled by the action client", self.run_id)


def execute_result(run: MissionRun | None, replaced: str) -> ExecuteMission.Result:
    """The result of ``execute_mission``.

    Args:
        run: The run; None when it is not known any more.
        replaced: Why it did not go on to its end, when it has none yet.
    """
    if run is None:
        return ExecuteMission.Result(reason=PREEMPTED)
    result = ExecuteMission.Result(
        run_id=run.run_id,
        state=run.status.value,
        code=run.code,
        reason=run.reason,
        cause=run.why.path if run.why else "",
        tree=run.tree,
        output_names=list(run.output_texts),
        output_values=list(run.output_texts.values()),
    )
    if replaced and run.why is None:
        result.state, result.code, result.reason = RunStatus.STOPPED.value, "stopped", replaced
        result.cause = run.mission
    return result


class Following:
    """What the document's action ``follow_me`` says beside the run: where the person is.

    Args:
        node: Listens to the feedback of the skill ``follow_user``.
        on_feedback: Given each feedback of the action.

    Source:
        Document, table 54.
    """

    def __init__(self, node: FlorenceNode, on_feedback: Callable[[FollowMe.Feedback], None]) -> None:
        self._on_feedback = on_feedback
        self._last = FollowMe.Feedback()
        topic = "follow_user/_action/feedback"
        node.create_subscription(FollowUser.Impl.FeedbackMessage, topic, self._take, RELIABLE)

    def _take(self, message: Any) -> None:
        self._last = FollowMe.Feedback(x=message.feedback.x, y=message.feedback.y)
        self._on_feedback(self._last)

    def result(self, run: MissionRun | None, replaced: str) -> FollowMe.Result:
        """The result of ``follow_me``, as :func:`execute_result`."""
        reason = run.reason if run is not None and run.why is not None else replaced or PREEMPTED
        code = run.code if run is not None else ""
        return FollowMe.Result(x=self._last.x, y=self._last.y, code=code, reason=reason)
