"""A skill that an action server performs."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from typing import Any

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from unique_identifier_msgs.msg import UUID

from florence_bt.core.errors import FlorenceError
from florence_bt.core.outcome import Outcome, Result, failure
from florence_bt.core.skill import FinishedRun, Inputs, SkillRun
from florence_bt.ros._action_run import ActionRun, Deadlines
from florence_bt.ros._goal_stop import StopAnswer
from florence_bt.ros.action_client import ActionClient
from florence_bt.ros.action_server import REFUSED
from florence_bt.ros.node import FlorenceNode

__all__ = ["ActionSkill", "Deadlines"]

_OUTCOMES = {
    GoalStatus.STATUS_SUCCEEDED: Outcome.SUCCEEDED,
    GoalStatus.STATUS_ABORTED: Outcome.FAILED,
    GoalStatus.STATUS_CANCELED: Outcome.CANCELLED,
}
_STOP_ANSWERS = {
    CancelGoal.Response.ERROR_NONE: StopAnswer.PROMISED,
    CancelGoal.Response.ERROR_REJECTED: StopAnswer.REFUSED,
    CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID: StopAnswer.UNKNOWN,
    CancelGoal.Response.ERROR_GOAL_TERMINATED: StopAnswer.OVER,
}


class ActionSkill:
    """A skill whose runs are goals of an action.

    Attributes:
        action: The action's name.
    """

    def __init__(
        self,
        node: FlorenceNode,
        action_type: Any,
        name: str,
        *,
        to_goal: Callable[[Inputs], Any],
        to_result: Callable[[Any, Outcome], Result],
        to_feedback: Callable[[Any], str] | None = None,
        deadlines: Deadlines | None = None,
    ) -> None:
        """Make a client of an action.

        Args:
            node: The node that talks to the server.
            action_type: The action.
            name: Its name.
            to_goal: The goal message from the inputs; raises FlorenceError, KeyError, TypeError or ValueError
                when they do not fit.
            to_result: The result from the result message and the way the goal ended.
            to_feedback: A text for people from a feedback message; keep it steady while nothing new happens.
            deadlines: How long each state of a run may last; the usual ones when not given.
        """
        self._node = node
        self._type = action_type
        self._to_goal = to_goal
        self._to_result = to_result
        self._to_feedback = to_feedback
        self._deadlines = deadlines or Deadlines()
        self._runs: list[ActionRun] = []
        self.action = name
        self._client = ActionClient(node, action_type, name)
        self._label = f"action {self._client.name} ({_type_name(action_type)})"
        node.on_close(self._shut_down)
        node.before_leaving(self._goals_are_over)

    @property
    def label(self) -> str:
        """The action's name and type, for people."""
        return self._label

    def server_is_there(self) -> bool:
        """Whether a server is in sight."""
        return bool(self._client.server_is_ready())

    def start(self, inputs: Inputs) -> SkillRun:
        """Send a goal as soon as the server is there."""
        try:
            goal = self._to_goal(inputs)
        except (FlorenceError, KeyError, TypeError, ValueError) as error:
            return FinishedRun(failure("bad_input", f"no goal for {self._label}: {error}"))
        channel = _Channel(self._node, self._client, goal, self._read_result, self._feedback_of)
        self._runs = [one for one in self._runs if one.poll() is None or one.goal_open or one.goal_left]
        older = [one for one in self._runs if one.goal_left]
        node = self._node
        run = ActionRun(
            node.timebase, channel, self._deadlines, self._label, node.steady, channel.goal_id, older
        )
        channel.run = run
        self._runs.append(run)
        return run

    def goal_ids(self) -> set[str]:
        """The ids of the goals of runs that go on."""
        return {run.goal_id for run in self._runs if run.poll() is None}

    def _feedback_of(self, goal: UUID) -> str:
        """What the newest feedback says about a goal; empty when nothing has come since the last question."""
        told = ""
        if self._to_feedback is not None:
            for message in self._client.feedback():
                if message.goal_id == goal:
                    told = self._to_feedback(message.feedback)
        return told

    def _read_result(self, response: Any) -> Result:
        outcome = _OUTCOMES.get(response.status)
        if outcome is None:
            return failure(
                "server_lost", f"{self._label} knows nothing of the goal any more; was it started anew?"
            )
        if outcome is Outcome.FAILED and getattr(response.result, "error_code", 0) == REFUSED:
            reason = f"{self._label} refused the goal: {response.result.error_msg}"
            return failure("rejected", reason, server_code=REFUSED)
        return self._to_result(response.result, outcome)

    def _shut_down(self) -> None:
        for run in self._runs:
            run.shut_down()

    def _goals_are_over(self) -> bool:
        return not any(run.goal_open for run in self._runs)


class _Channel:
    """The way to the server for one goal: rclpy's futures, turned into calls of the run."""

    def __init__(
        self,
        node: FlorenceNode,
        client: ActionClient,
        goal: Any,
        read_result: Callable[[Any], Result],
        read_feedback: Callable[[UUID], str],
    ) -> None:
        self._node = node
        self._client = client
        self._goal = goal
        self._read_result = read_result
        self._read_feedback = read_feedback
        self._id = UUID(uuid=list(uuid.uuid4().bytes))
        self._servers: set[bytes] = set()
        self.run: ActionRun | None = None

    @property
    def goal_id(self) -> str:
        """The id as tools of ROS show it."""
        return bytes(self._id.uuid).hex()

    def server_is_there(self) -> bool:
        return bool(self._client.server_is_ready())

    def goals_server_is_there(self) -> bool:
        if not self._client.server_is_ready():
            return False
        found = self._client.server_ids()
        self._servers = self._servers or found
        return not self._servers or not self._servers.isdisjoint(found)

    def servers(self) -> int:
        return self._client.servers()

    def send_goal(self) -> None:
        future = self._client.send_goal(self._id, self._goal)
        future.add_done_callback(self._node.guarded(self._on_answer))

    def send_cancel(self) -> None:
        self._client.cancel(self._id).add_done_callback(self._node.guarded(self._on_cancel_answer))

    def _on_answer(self, future: Any) -> None:
        answer = future.result()
        if answer is None or self.run is None:
            return
        if not answer.accepted:
            self.run.rejected()
            return
        self._client.ask_result(self._id).add_done_callback(self._node.guarded(self._on_result))
        self.run.accepted()

    def _on_result(self, future: Any) -> None:
        if self.run is not None and future.result() is not None:
            self.run.finished(self._read_result(future.result()))

    def _on_cancel_answer(self, future: Any) -> None:
        answer = future.result()
        if self.run is not None and answer is not None:
            self.run.stop_answered(self._stop_answer(answer))

    def _stop_answer(self, answer: CancelGoal.Response) -> StopAnswer:
        promised = [bytes(info.goal_id.uuid).hex() for info in answer.goals_canceling]
        if answer.return_code == CancelGoal.Response.ERROR_NONE and self.goal_id not in promised:
            return StopAnswer.REFUSED  # as servers of rclpy say it
        return _STOP_ANSWERS.get(answer.return_code, StopAnswer.REFUSED)

    def feedback(self) -> str:
        return self._read_feedback(self._id)


def _type_name(action_type: Any) -> str:
    package, kind = action_type.__module__.split(".")[:2]
    return f"{package}/{kind}/{action_type.__name__}"
