"""An action server with one goal at a time, for components that work on their own and report their end.

rclpy's usual server runs a goal in a coroutine; waiting in one keeps the events executor busy all the time.
This one runs nothing: a goal is accepted, the component works on timers and messages, and ``finish`` sends
the result.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import RCLError, ServerGoalHandle
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidHandle

from florence_bt.core.errors import FlorenceError
from florence_bt.core.outcome import Outcome
from florence_bt.ros.answers import PAUSES_S
from florence_bt.ros.node import FlorenceNode, with_reason
from florence_bt.ros.validation import problem_with

PREEMPTED = "preempted by a newer goal"
SHUT_DOWN = "the server shuts down"
REFUSED = 65535
"""The ``error_code`` of a goal that was refused; in results with a field ``code`` that is ``rejected``."""
KEEP_RESULTS_S = 10
"""Time for which a result can be asked for. Short: rclpy looks at every kept goal on each event."""


class _OnSteadyTime:
    """A node as rclpy's action server sees it: results expire by the steady time.

    A timer on the simulated time that is set anew with every goal keeps the events executor of rclpy 7.1 busy
    for seconds after some twenty goals; on the wall clock, a result stays as long as that is set back. The
    stamps in the messages on ``NAME/_action/status`` are of the steady time, too.
    """

    def __init__(self, node: FlorenceNode) -> None:
        self._node = node
        self._clock = Clock(clock_type=ClockType.STEADY_TIME)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._node, name)

    def get_clock(self) -> Clock:
        """Give the clock by which results expire."""
        return self._clock


class _Server(ActionServer):
    """An action server that leaves the execution to others until there is a result.

    A server cannot answer a client that it has not discovered yet. rclpy then
    forgets the goal, which its owner works on already: it could not be stopped. Here the owner
    gets it anyway, and the answer is sent again.

    Attributes:
        owned: The goal that its owner was given last.
        lists_poses: Whether a goal may have so many poses that rclpy takes seconds to decode it, 50 us each.
    """

    owned: ServerGoalHandle | None = None
    lists_poses = False

    def __init__(self, node: FlorenceNode, *arguments: Any, **options: Any) -> None:
        self._on_steady_time = _OnSteadyTime(node)  # rcl goes on with its clock
        super().__init__(self._on_steady_time, *arguments, **options)
        self._node = node

    def take_data(self) -> Any:
        if self.lists_poses and self._is_goal_request_ready:
            self._node.before_long_work()
        if self._is_goal_expired:
            self._is_goal_expired = False
            self._forget_expired()
        return super().take_data()

    def _forget_expired(self) -> None:
        """Forget expired goals at once, here and in rcl.

        rclpy forgets them after the goals that arrived together with their end. A new goal with the id of an
        expired one was forgotten in its place, and rcl went on with memory that was freed.
        """
        with self._lock:
            # rcl refuses room for no goal.
            expired = self._handle.expire_goals(max(1, len(self._goal_handles)))
        for goal in expired:
            goal_id = bytes(goal.goal_id.uuid)
            self._goal_handles.pop(goal_id).destroy()
            self.remove_future(self._result_futures.pop(goal_id))

    async def _execute_goal_request(self, request_header_and_message: tuple[Any, Any]) -> None:
        header, request = request_header_and_message
        goal_id = bytes(request.goal_id.uuid)
        known = goal_id in self._goal_handles
        await super()._execute_goal_request(request_header_and_message)
        handle = self._goal_handles.get(goal_id)
        if handle is None or known or handle is self.owned:
            return
        self._handle.publish_status()
        self._handle_accepted_callback(handle)
        self._answer_later(header, PAUSES_S)

    def _answer_later(self, header: Any, pauses: tuple[float, ...]) -> None:
        steady = self._node.steady
        if pauses:
            steady.call_at(steady.now() + pauses[0], lambda: self._answer_again(header, pauses[1:]))
        else:
            self._node.get_logger().warning("the client of a goal was never discovered")

    def _answer_again(self, header: Any, pauses: tuple[float, ...]) -> None:
        answer = self._action_type.Impl.SendGoalService.Response(accepted=True)
        try:
            self._handle.send_goal_response(header, answer)
        except RCLError:
            self._answer_later(header, pauses)
        except InvalidHandle:
            self._node.get_logger().warning("the client of a goal was not discovered before the server's end")

    async def execute(self, taken_data: Any) -> None:
        # It runs as a task, whose exception would end the process: see FlorenceNode.guarded.
        try:
            await super().execute(taken_data)
        except Exception as error:
            self._node.failures.append(error)

    async def _execute_goal(
        self, execute_callback: Callable[..., Any], goal_handle: ServerGoalHandle
    ) -> None:
        # A task too.
        try:
            await super()._execute_goal(execute_callback, goal_handle)
        except Exception as error:
            self._node.failures.append(error)

    def notify_execute(
        self, goal_handle: ServerGoalHandle, execute_callback: Callable[..., Any] | None
    ) -> None:
        if execute_callback is not None:
            super().notify_execute(goal_handle, execute_callback)


class _Goal:
    """One goal between the component's yes and its result."""

    def __init__(self) -> None:
        self.handle: ServerGoalHandle | None = None
        self.early_end: tuple[Any, Outcome] | None = None


class SingleGoalServer:
    """Serves an action, one goal at a time.

    A refused goal is accepted and ends at once as ABORTED, with the reason in its result: ROS 2 has no place
    for a reason in a rejection. The goal that is running goes on. Refused are goals that do not pass the
    check of their type (:mod:`florence_bt.ros.validation`) and those that the component does not want.

    A newer goal replaces the running one, which ends as ABORTED. All methods belong to the executor's thread.
    """

    def __init__(
        self,
        node: FlorenceNode,
        action_type: Any,
        name: str,
        *,
        on_goal: Callable[[Any], str | None],
        on_cancel: Callable[[], None],
        on_replaced: Callable[[], Any] | None = None,
        bad_goal_code: int = REFUSED,
    ) -> None:
        """Serve an action until the node is closed.

        Args:
            node: The node that serves it.
            action_type: The action.
            name: Its name.
            on_goal: Given the goal message: starts the work and returns None, or returns why the goal is
                refused. What it starts takes the place of an older goal, whose result the server sends. It
                may call :meth:`finish` at once; that ends the new goal.
            on_cancel: The goal shall end; the component then calls ``finish`` with Outcome.CANCELLED (or with
                what was reached in the meantime).
            on_replaced: Gives the result message of a running goal when a newer one takes its place; it ends
                as ABORTED. Without this the result has :data:`PREEMPTED` as its text.
            bad_goal_code: The ``error_code`` of the result of a goal that does not pass the check.
        """
        self._node = node
        self._name = name
        self._result_type = action_type.Result
        self._on_goal = on_goal
        self._on_cancel = on_cancel
        self._replaced = on_replaced or (lambda: with_reason(action_type.Result(), PREEMPTED))
        self._bad_goal_code = bad_goal_code
        self._goal: _Goal | None = None
        self._refusal: tuple[str, int] | None = None
        self._server = _Server(
            node,
            action_type,
            node.resolve_action_name(name),
            execute_callback=_never,
            goal_callback=self._decide,
            handle_accepted_callback=node.guarded(self._accepted),
            cancel_callback=self._cancel_asked,
            result_timeout=KEEP_RESULTS_S,
        )
        self._server.lists_poses = hasattr(action_type.Goal, "poses") or hasattr(action_type.Goal, "path")
        node.on_close(self._shut_down)

    @property
    def active(self) -> bool:
        """Tell whether a goal is being worked on."""
        return self._goal is not None

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback about the running goal, if there is one."""
        if self._goal is not None and self._goal.handle is not None:
            self._goal.handle.publish_feedback(feedback)

    def finish(self, result: Any, outcome: Outcome) -> None:
        """End the running goal; without one this does nothing.

        Args:
            result: The result message.
            outcome: SUCCEEDED, FAILED (the action ends as ABORTED) or CANCELLED (CANCELED, when a client
                asked for it; else ABORTED).
        """
        goal = self._goal
        if goal is None:
            return
        if goal.handle is None:
            goal.early_end = (result, outcome)
        else:
            self._goal = None
            self._end(goal.handle, result, outcome)

    def _decide(self, request: Any) -> GoalResponse:
        self._refusal = None
        problem = problem_with(request)
        if problem is not None:
            self._node.health.count_refused(self._name, problem)
            self._refusal = problem, self._bad_goal_code
            return GoalResponse.ACCEPT
        older, self._goal = self._goal, _Goal()
        try:
            refusal = self._on_goal(request)
        except FlorenceError as error:
            refusal = str(error)
        except Exception as error:
            # Not raised here: see FlorenceNode.guarded.
            self._node.failures.append(error)
            refusal = f"the server failed: {error}"
        if refusal is not None:
            self._refusal = refusal, REFUSED
            self._goal = older
            self._node.get_logger().warning(f"{self._name}: goal refused: {refusal}")
            return GoalResponse.ACCEPT
        if older is not None and older.handle is not None:
            self._end(older.handle, self._replaced(), Outcome.FAILED)
        return GoalResponse.ACCEPT

    def _accepted(self, handle: ServerGoalHandle) -> None:
        self._server.owned = handle
        handle.execute()
        if self._refusal is not None:
            self._end(handle, self._refused(*self._refusal), Outcome.FAILED)
            return
        goal = self._goal
        assert goal is not None, "rclpy decides and accepts in one event"
        goal.handle = handle
        if goal.early_end is not None:
            self.finish(*goal.early_end)
        elif handle.is_cancel_requested:
            self._node.call_soon(lambda: self._deliver_cancel(goal))

    def _cancel_asked(self, handle: ServerGoalHandle) -> CancelResponse:
        goal = self._goal
        if goal is None or goal.handle is not handle:
            return CancelResponse.REJECT
        # The goal becomes CANCELING after this answer; only then may it end as CANCELED.
        self._node.call_soon(lambda: self._deliver_cancel(goal))
        return CancelResponse.ACCEPT

    def _deliver_cancel(self, goal: _Goal) -> None:
        if goal is self._goal:
            self._on_cancel()

    def _end(self, handle: ServerGoalHandle, result: Any, outcome: Outcome) -> None:
        if outcome is Outcome.SUCCEEDED:
            handle.succeed()
        elif outcome is Outcome.CANCELLED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        self._server.notify_execute(handle, lambda _: result)

    def _refused(self, reason: str, error_code: int) -> Any:
        result = with_reason(self._result_type(), reason)
        for field, value in (("error_code", error_code), ("code", "rejected")):
            if hasattr(result, field):
                setattr(result, field, value)
        return result

    def _shut_down(self) -> None:
        self.finish(with_reason(self._result_type(), SHUT_DOWN), Outcome.FAILED)
        # The result leaves while the process drains its executor; rclpy frees the server with the node.


def _never(handle: ServerGoalHandle) -> Any:
    raise AssertionError("a goal without a result cannot be executed")
