"""A skill that an action server performs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any
from uuid import uuid4

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from unique_identifier_msgs.msg import UUID

from florence_bt.core.interfaces import name_of_interface
from florence_bt.core.outcome import Outcome, Result, failure
from florence_bt.core.server_comparison import ACTION, Lack, Wanted
from florence_bt.core.skill import Inputs, SkillRun
from florence_bt.ros._runs import ActionRun, Deadlines, RemoteSkill, StopAnswer
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


class ActionSkill(RemoteSkill):
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
        self._to_result = to_result
        self._to_feedback = to_feedback
        self._deadlines = deadlines or Deadlines()
        self._runs: list[ActionRun] = []
        self.action = name
        self._client = ActionClient(node, action_type, name)
        self._wanted = Wanted(ACTION, self._client.name, name_of_interface(action_type))
        super().__init__(f"action {self._client.name} ({self._wanted.interface})", "goal", to_goal)
        node.on_close(self._shut_down)
        node.before_leaving(self._goals_are_over)

    def server_is_there(self) -> bool:
        """Tell whether a server has been discovered."""
        return bool(self._client.server_is_ready())

    def lack(self) -> Lack:
        """Return why the server cannot be reached, as far as the graph tells it."""
        return self._node.server_graph.lack(self._wanted)

    def _begin(self, message: Any, inputs: Inputs) -> SkillRun:
        goal = _SentGoal(self._node, self._client, message, self._read_result, self._feedback_of, self.lack)
        self._runs = [one for one in self._runs if one.poll() is None or one.goal_open or one.goal_left]
        older = [one for one in self._runs if one.goal_left]
        node = self._node
        goal.run = ActionRun(node.timebase, goal, self._deadlines, self.label, node.steady, goal.id, older)
        self._runs.append(goal.run)
        return goal.run

    def goal_ids(self) -> set[str]:
        """Return the ids of the goals of runs that go on."""
        return {run.goal_id for run in self._runs if run.poll() is None}

    def _feedback_of(self, goal: UUID) -> str:
        """Return the newest feedback on a goal; empty when nothing has come since the last call."""
        news = ""
        if self._to_feedback is not None:
            for message in self._client.feedback():
                if message.goal_id == goal:
                    news = self._to_feedback(message.feedback)
        return news

    def _read_result(self, response: Any) -> Result:
        outcome = _OUTCOMES.get(response.status)
        if outcome is None:
            return failure("server_lost", f"{self.label} does not know the goal any more; was it restarted?")
        if outcome is Outcome.FAILED and getattr(response.result, "error_code", 0) == REFUSED:
            reason = f"{self.label} refused the goal: {response.result.error_msg}"
            return failure("rejected", reason)
        return self._to_result(response.result, outcome)

    def _shut_down(self) -> None:
        for run in self._runs:
            run.shut_down()

    def _goals_are_over(self) -> bool:
        return not any(run.goal_open for run in self._runs)


@dataclass(slots=True)
class _SentGoal:
    """The way to the server for one goal: rclpy's futures, turned into calls of the run."""

    node: FlorenceNode
    client: ActionClient
    message: Any
    read_result: Callable[[Any], Result]
    read_feedback: Callable[[UUID], str]
    lack: Callable[[], Lack]
    uuid: UUID = field(default_factory=lambda: UUID(uuid=list(uuid4().bytes)))
    seen_servers: set[bytes] = field(default_factory=set)
    run: ActionRun | None = None

    @property
    def id(self) -> str:
        """The id as tools of ROS show it."""
        return bytes(self.uuid.uuid).hex()

    def server_is_there(self) -> bool:
        return bool(self.client.server_is_ready())

    def goals_server_is_there(self) -> bool:
        if not self.client.server_is_ready():
            return False
        found = self.client.server_ids()
        self.seen_servers = self.seen_servers or found
        return not self.seen_servers or not self.seen_servers.isdisjoint(found)

    def servers(self) -> int:
        return self.client.servers()

    def send(self) -> None:
        self.seen_servers = self.client.server_ids()
        future = self.client.send_goal(self.uuid, self.message)
        future.add_done_callback(self.node.guarded(self._on_answer))

    def stop(self) -> None:
        self.client.cancel(self.uuid).add_done_callback(self.node.guarded(self._on_cancel_answer))

    def _on_answer(self, future: Any) -> None:
        answer = future.result()
        if answer is None or self.run is None:
            return
        if not answer.accepted:
            self.run.rejected()
            return
        self.client.ask_result(self.uuid).add_done_callback(self.node.guarded(self._on_result))
        self.run.accepted()

    def _on_result(self, future: Any) -> None:
        if self.run is not None and future.result() is not None:
            self.run.finished(self.read_result(future.result()))

    def _on_cancel_answer(self, future: Any) -> None:
        answer = future.result()
        if self.run is not None and answer is not None:
            self.run.stop_answered(self._stop_answer(answer))

    def _stop_answer(self, answer: CancelGoal.Response) -> StopAnswer:
        promised = [bytes(info.goal_id.uuid).hex() for info in answer.goals_canceling]
        if answer.return_code == CancelGoal.Response.ERROR_NONE and self.id not in promised:
            return StopAnswer.REFUSED  # as servers of rclpy say it
        return _STOP_ANSWERS.get(answer.return_code, StopAnswer.REFUSED)

    def feedback(self) -> str:
        return self.read_feedback(self.uuid)
