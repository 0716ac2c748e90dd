"""A skill that an action server performs."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from typing import Any

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from unique_identifier_msgs.msg import UUID

from florence_bt.core.errors import FlorenceError
from florence_bt.core.outcome import Outcome, Result, failure
from florence_bt.core.skill import FinishedRun, Inputs, SkillRun
from florence_bt.ros._action_run import ActionRun, Deadlines
from florence_bt.ros._goal_stop import StopAnswer
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


class _Client(ActionClient):
    """An action client that outlives a second server of the same name.

    Both are sent the goal and both answer; rclpy raises when the second answer comes on the heels of the
    first one, which ends the process. The first answer counts here; the run tells the other server to stop.
    """

    async def execute(self, taken_data: dict[str, Any]) -> None:
        """Serve what has arrived."""
        if "goal" in taken_data:
            sequence_number, _ = taken_data["goal"]
            pending = self._pending_goal_requests.get(sequence_number)
            if pending is not None and pending.done():
                del taken_data["goal"]
        await super().execute(taken_data)


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
        self._runs: dict[bytes, ActionRun] = {}
        self.action = name
        self._client = _Client(node, action_type, name)
        self._label = f"action {node.resolve_service_name(name)} ({_type_name(action_type)})"
        node.on_close(self._shut_down)
        node.before_leaving(self._goals_are_over)
        node.on_destroy(self._client.destroy)

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
        channel = _Channel(self._node, self._client, goal, self._read_result, self._to_feedback)
        run = ActionRun(self._node.timebase, channel, self._deadlines, self._label, self._node.steady)
        channel.run = run
        self._runs = {
            goal_id: one for goal_id, one in self._runs.items() if one.poll() is None or one.goal_open
        }
        self._runs[channel.goal_id] = run
        return run

    def goal_ids(self) -> set[bytes]:
        """The ids of the goals of runs that go on."""
        return {goal_id for goal_id, run in self._runs.items() if run.poll() is None}

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
        for run in self._runs.values():
            run.shut_down()

    def _goals_are_over(self) -> bool:
        return not any(run.goal_open for run in self._runs.values())


class _Channel:
    """The way to the server for one goal: rclpy's futures, turned into calls of the run."""

    def __init__(
        self,
        node: FlorenceNode,
        client: ActionClient,
        goal: Any,
        read_result: Callable[[Any], Result],
        to_feedback: Callable[[Any], str] | None,
    ) -> None:
        self._node = node
        self._client = client
        self._goal = goal
        self._read_result = read_result
        self._to_feedback = to_feedback
        self._status_topic = f"{client._action_name}/_action/status"
        self._id = UUID(uuid=list(uuid.uuid4().bytes))
        self._servers: set[bytes] = set()
        self._handle: ClientGoalHandle | None = None
        self.run: ActionRun | None = None

    @property
    def goal_id(self) -> bytes:
        return bytes(self._id.uuid)

    def server_is_there(self) -> bool:
        return bool(self._client.server_is_ready())

    def goals_server_is_there(self) -> bool:
        if not self._client.server_is_ready():
            return False
        found = {
            bytes(one.endpoint_gid) for one in self._node.get_publishers_info_by_topic(self._status_topic)
        }
        self._servers = self._servers or found
        return not self._servers or not self._servers.isdisjoint(found)

    def servers(self) -> int:
        return self._node.count_publishers(self._status_topic)

    def send_goal(self) -> None:
        feedback = self._node.guarded(self._on_feedback) if self._to_feedback is not None else None
        future = self._client.send_goal_async(self._goal, feedback_callback=feedback, goal_uuid=self._id)
        future.add_done_callback(self._node.guarded(self._on_answer))

    def send_cancel(self) -> None:
        # rclpy has no handle before the acceptance; the server knows the goal by its id all the same.
        handle = self._handle or ClientGoalHandle(self._client, self._id, None)
        future = self._client._cancel_goal_async(handle)
        future.add_done_callback(self._node.guarded(self._on_cancel_answer))

    def _on_answer(self, future: Any) -> None:
        handle = future.result()
        if handle is None or self.run is None:
            return
        if not handle.accepted:
            self.run.rejected()
            return
        self._handle = handle
        handle.get_result_async().add_done_callback(self._node.guarded(self._on_result))
        self.run.accepted()

    def _on_result(self, future: Any) -> None:
        if self.run is not None and future.result() is not None:
            self.run.finished(self._read_result(future.result()))

    def _on_cancel_answer(self, future: Any) -> None:
        answer = future.result()
        if self.run is not None and answer is not None:
            self.run.stop_answered(self._stop_answer(answer))

    def _stop_answer(self, answer: CancelGoal.Response) -> StopAnswer:
        promised = [bytes(info.goal_id.uuid) for info in answer.goals_canceling]
        if answer.return_code == CancelGoal.Response.ERROR_NONE and self.goal_id not in promised:
            return StopAnswer.REFUSED  # as servers of rclpy say it
        return _STOP_ANSWERS.get(answer.return_code, StopAnswer.REFUSED)

    def _on_feedback(self, message: Any) -> None:
        if self.run is not None and self._to_feedback is not None:
            self.run.set_feedback(self._to_feedback(message.feedback))


def _type_name(action_type: Any) -> str:
    package, kind = action_type.__module__.split(".")[:2]
    return f"{package}/{kind}/{action_type.__name__}"
