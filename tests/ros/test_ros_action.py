"""Action skill against single-goal server over DDS."""

from __future__ import annotations

import signal
from typing import Any

import pytest

pytest.importorskip("rclpy")
from nav2_msgs.action import Spin
from rclpy.action.server import RCLError
from rosgraph_msgs.msg import Clock

from florence_bt.core.outcome import Outcome, Result, failure, success
from florence_bt.core.skill import Phase
from florence_bt.ros._runs import WATCH_PERIOD_S
from florence_bt.ros.action_server import PREEMPTED, SHUT_DOWN, SingleGoalServer
from florence_bt.ros.action_skill import ActionSkill, Deadlines
from florence_bt.ros.conversions import stamp_to_ros
from florence_bt.ros.node import FlorenceNode

pytestmark = pytest.mark.ros


class Spinner(FlorenceNode):
    """Serves ``spin``; the test decides when a goal ends. Negative turns are refused."""

    def __init__(self, name: str = "spinner", **options: Any) -> None:
        super().__init__(name, **options)
        self.goals: list[float] = []
        self.cancels = 0
        self.at_once = False
        self.obey = True
        self.server = SingleGoalServer(self, Spin, "spin", on_goal=self.on_goal, on_cancel=self.on_cancel)

    def on_goal(self, goal: Any) -> str | None:
        if goal.target_yaw < 0.0:
            return "only to the left"
        self.goals.append(goal.target_yaw)
        if self.at_once:
            self.server.finish(Spin.Result(), Outcome.SUCCEEDED)
        return None

    def on_cancel(self) -> None:
        self.cancels += 1
        if self.obey:
            self.server.finish(Spin.Result(error_msg="stopped"), Outcome.CANCELLED)


def spin_skill(node: FlorenceNode, **deadlines: float) -> ActionSkill:
    return ActionSkill(
        node,
        Spin,
        "spin",
        to_goal=lambda inputs: Spin.Goal(target_yaw=float(inputs["angle"])),
        to_result=read_result,
        to_feedback=lambda message: f"turned {message.angular_distance_traveled:.1f} rad",
        deadlines=Deadlines(**{"accept_s": 300.0, "result_s": 600.0, "cancel_s": 300.0, **deadlines}),
    )


def read_result(message: Any, outcome: Outcome) -> Result:
    if outcome is Outcome.SUCCEEDED:
        return success(code=message.error_code)
    if outcome is Outcome.CANCELLED:
        return Result(outcome, "cancelled", message.error_msg)
    return failure("spin_failed", message.error_msg)


@pytest.fixture
def client(ros: Any) -> FlorenceNode:
    return ros.add(FlorenceNode("client"))


def test_success_with_feedback(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    changes: list[str] = []
    run = spin_skill(client).start({"angle": 1.5})
    run.on_change(lambda: changes.append(run.feedback))
    ros.spin_until(lambda: spinner.server.active)
    assert spinner.goals == [1.5]
    assert run.poll() is None
    spinner.server.publish_feedback(Spin.Feedback(angular_distance_traveled=0.5))
    ros.spin_until(lambda: run.feedback == "turned 0.5 rad")
    spinner.server.finish(Spin.Result(error_code=0), Outcome.SUCCEEDED)
    assert not spinner.server.active
    result = ros.spin_until(run.poll)
    assert result == success(code=0)
    assert "turned 0.5 rad" in changes


def lose_answers_to_goals(monkeypatch: pytest.MonkeyPatch, spinner: Spinner, count: int) -> list[bool]:
    """Let the first answers of all action servers to goals find no client; gives what became of each."""
    handles = type(spinner.server._server._handle)
    send = handles.send_goal_response
    sent: list[bool] = []

    def send_goal_response(handle: Any, header: Any, response: Any) -> None:
        sent.append(len(sent) >= count)
        if not sent[-1]:
            raise RCLError("Failed to send goal response")
        send(handle, header, response)

    monkeypatch.setattr(handles, "send_goal_response", send_goal_response)
    return sent


@pytest.mark.parametrize("at_once", [False, True])
def test_a_client_that_is_discovered_late_keeps_its_goal(
    ros: Any, client: FlorenceNode, monkeypatch: pytest.MonkeyPatch, at_once: bool
) -> None:
    spinner = ros.add(Spinner())
    spinner.at_once = at_once
    sent = lose_answers_to_goals(monkeypatch, spinner, 2)
    run = spin_skill(client).start({"angle": 1.0})
    ros.spin_until(lambda: run.phase is Phase.ACTIVE or run.poll(), what="the acceptance")
    run.cancel()
    result = ros.spin_until(run.poll)
    assert (result.succeeded, result.outcome is Outcome.CANCELLED) == (at_once, not at_once)
    assert not spinner.server.active and spinner.goals == [1.0] and sent == [False, False, True]


def test_a_goal_whose_client_is_never_discovered_can_be_stopped(
    ros: Any, client: FlorenceNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("florence_bt.ros.action_server.PAUSES_S", (0.01, 0.01))
    spinner = ros.add(Spinner())
    sent = lose_answers_to_goals(monkeypatch, spinner, 1000)
    skill = spin_skill(client, accept_s=2.0)
    ros.spin_until(skill._client.server_is_ready)
    run = skill.start({"angle": 1.0})
    assert ros.spin_until(run.poll).code == "timed_out"
    ros.spin_until(lambda: spinner.cancels == 1 and not spinner.server.active, what="the end of the goal")
    assert sent == [False] * 3
    ros.spin_until(lambda: not run.goal_open, what="the news of it")
    ros.close_node(client)  # before the server, as in two processes


def test_end_within_the_goal_callback(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    spinner.at_once = True
    skill = spin_skill(client)
    for _ in range(20):
        assert ros.spin_until(skill.start({"angle": 1.0}).poll) == success(code=0)
    assert not spinner.server.active


def test_refusal(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    skill = spin_skill(client)
    running = skill.start({"angle": 1.0})
    ros.spin_until(lambda: spinner.server.active)
    refused = ros.spin_until(skill.start({"angle": -1.0}).poll)
    assert refused.code == "rejected"
    assert refused.reason == "action /spin (nav2_msgs/action/Spin) refused the goal: only to the left"
    assert spinner.server.active, "a refused goal must not touch the running one"
    spinner.server.finish(Spin.Result(), Outcome.SUCCEEDED)
    assert ros.spin_until(running.poll).succeeded


def test_a_second_server_of_the_same_name_is_told_to_stop(ros: Any, client: FlorenceNode) -> None:
    one, other = ros.add(Spinner("one")), ros.add(Spinner("other"))
    run = spin_skill(client).start({"angle": 1.0})
    ros.spin_until(lambda: one.server.active and other.server.active, what="both goals")
    ros.spin_until(lambda: run.phase is Phase.ACTIVE, what="the acceptance")
    one.server.finish(Spin.Result(), Outcome.SUCCEEDED)
    other.server.publish_feedback(Spin.Feedback())
    assert ros.spin_until(run.poll).succeeded
    ros.spin_until(lambda: not other.server.active, what="the end of the other goal")
    assert (one.cancels, other.cancels) == (0, 1)


def test_wrong_inputs_send_nothing(ros: Any, client: FlorenceNode) -> None:
    result = spin_skill(client).start({}).poll()
    assert result is not None
    assert result.code == "bad_input"


def test_cancel_before_the_server_is_known(ros: Any, client: FlorenceNode) -> None:
    run = spin_skill(client).start({"angle": 1.0})
    run.cancel()
    result = run.poll()
    assert result is not None
    assert result.outcome is Outcome.CANCELLED


def test_cancel_before_the_acceptance_is_remembered(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    skill = spin_skill(client)
    ros.spin_until(skill._client.server_is_ready)
    run = skill.start({"angle": 1.0})
    run.cancel()
    run.cancel()
    assert run.poll() is None, "the goal is on its way"
    result = ros.spin_until(run.poll)
    assert (result.outcome, result.reason) == (Outcome.CANCELLED, "stopped")
    assert spinner.cancels == 1
    assert not spinner.server.active


def test_cancel_while_it_runs(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    run = spin_skill(client).start({"angle": 1.0})
    ros.spin_until(lambda: run.phase.value == "active")
    run.cancel()
    assert ros.spin_until(run.poll).outcome is Outcome.CANCELLED
    assert spinner.cancels == 1


def test_a_server_that_does_not_stop(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    spinner.obey = False
    run = spin_skill(client, cancel_s=0.2).start({"angle": 1.0})
    ros.spin_until(lambda: run.phase.value == "active")
    run.cancel()
    result = ros.spin_until(run.poll)
    assert result.outcome is Outcome.CANCELLED
    assert "did not confirm the stop within 0.2 s" in result.reason
    ros.spin_until(lambda: spinner.cancels == 1, what="the cancel")


def test_what_was_reached_counts_in_spite_of_a_cancel(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    spinner.obey = False
    run = spin_skill(client).start({"angle": 1.0})
    ros.spin_until(lambda: run.phase.value == "active")
    run.cancel()
    ros.spin_until(lambda: spinner.cancels == 1)
    spinner.server.finish(Spin.Result(), Outcome.SUCCEEDED)
    assert ros.spin_until(run.poll).succeeded


def test_a_newer_goal_replaces_the_older_one(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    skill = spin_skill(client)
    older = skill.start({"angle": 1.0})
    ros.spin_until(lambda: spinner.server.active)
    newer = skill.start({"angle": 2.0})
    result = ros.spin_until(older.poll)
    assert (result.code, result.reason) == ("spin_failed", PREEMPTED)
    assert newer.poll() is None
    assert spinner.goals == [1.0, 2.0]
    spinner.server.finish(Spin.Result(), Outcome.SUCCEEDED)
    assert ros.spin_until(newer.poll).succeeded
    assert spinner.cancels == 0


def test_a_component_that_gives_up_is_aborted(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    run = spin_skill(client).start({"angle": 1.0})
    ros.spin_until(lambda: spinner.server.active)
    spinner.server.finish(Spin.Result(error_code=703, error_msg="a wall"), Outcome.FAILED)
    result = ros.spin_until(run.poll)
    assert (result.code, result.reason) == ("spin_failed", "a wall")


def test_cancelled_without_a_request_is_a_failure_for_the_client(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    run = spin_skill(client).start({"angle": 1.0})
    ros.spin_until(lambda: spinner.server.active)
    spinner.server.finish(Spin.Result(error_msg="emergency stop"), Outcome.CANCELLED)
    assert ros.spin_until(run.poll).reason == "emergency stop"


def test_no_server(ros: Any, client: FlorenceNode) -> None:
    run = spin_skill(client, accept_s=0.3).start({"angle": 1.0})
    result = ros.spin_until(run.poll)
    assert result.code == "server_lost"
    assert "no server of action /spin" in result.reason


def test_a_server_that_comes_late_is_found(ros: Any, client: FlorenceNode) -> None:
    run = spin_skill(client).start({"angle": 1.0})
    ros.spin_for(0.2)
    spinner = ros.add(Spinner())
    spinner.at_once = True
    assert ros.spin_until(run.poll).succeeded


def test_result_deadline_stops_the_server(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    run = spin_skill(client, result_s=0.2).start({"angle": 1.0})
    result = ros.spin_until(run.poll)
    assert result.code == "timed_out"
    ros.spin_until(lambda: spinner.cancels == 1)


def test_a_server_that_shuts_down_says_so(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    run = spin_skill(client).start({"angle": 1.0})
    ros.spin_until(lambda: run.phase.value == "active")
    ros.close_node(spinner)
    assert ros.spin_until(run.poll).reason == SHUT_DOWN


SPINNER_SCRIPT = """
import sys
from nav2_msgs.action import Spin
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.process import run_nodes

def make():
    node = FlorenceNode("spinner")
    def on_goal(goal):
        print("goal", flush=True)
        return None
    node.server = SingleGoalServer(node, Spin, "spin", on_goal=on_goal, on_cancel=lambda: None)
    return node

sys.exit(run_nodes([make]))
"""


def test_another_process_that_dies(ros: Any, client: FlorenceNode, start_process: Any) -> None:
    child = start_process("-c", SPINNER_SCRIPT)
    run = spin_skill(client, result_s=1.0).start({"angle": 1.0})
    ros.spin_until(lambda: run.phase.value == "active")
    child.end(signal.SIGKILL)
    # Discovery usually misses a killed process only after its lease of 20 s; the run's own deadline holds.
    assert ros.spin_until(run.poll).code in ("timed_out", "server_lost")


def test_a_bug_in_the_goal_callback_ends_the_server_not_the_client(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())

    def broken(goal: Any) -> str | None:
        raise ZeroDivisionError("bug")

    spinner.server._on_goal = broken
    run = spin_skill(client).start({"angle": 1.0})
    with pytest.raises(ZeroDivisionError):
        ros.spin_until(run.poll)
    assert ros.spin_until(run.poll).code == "rejected"


def test_a_flood_of_feedback_is_no_work_for_the_executor(ros: Any, client: FlorenceNode) -> None:
    """1,000 messages a second held a stop back for 39 s: each of them was an event of its own."""
    spinner = ros.add(Spinner())
    skill = spin_skill(client)
    run = skill.start({"angle": 1.0})
    ros.spin_until(lambda: run.phase is Phase.ACTIVE, what="the goal")
    flood = spinner.create_publisher(Spin.Impl.FeedbackMessage, "spin/_action/feedback", 10)
    ros.spin_until(lambda: flood.get_subscription_count() == 1, what="the subscription of the client")
    changes: list[str] = []
    run.on_change(lambda: changes.append(run.feedback))
    message = Spin.Impl.FeedbackMessage(goal_id=run._channel.uuid)
    begin = client.steady.now()
    for number in range(3000):
        message.feedback.angular_distance_traveled = float(number)
        flood.publish(message)
        ros.loop.spin_once(0.0)
    ros.spin_until(lambda: run.feedback == "turned 2999.0 rad", what="the newest feedback")
    looks = (client.steady.now() - begin) / WATCH_PERIOD_S
    assert len(changes) <= looks + 1
    spinner.server.finish(Spin.Result(), Outcome.SUCCEEDED)
    ros.spin_until(lambda: run.poll() is not None, what="the result")


def test_no_second_goal_beside_one_that_the_server_does_not_end(ros: Any, client: FlorenceNode) -> None:
    spinner = ros.add(Spinner())
    spinner.obey = False
    skill = spin_skill(client, accept_s=1.0, cancel_s=0.2)
    first = skill.start({"angle": 1.0})
    ros.spin_until(lambda: first.phase is Phase.ACTIVE, what="the goal")
    first.cancel()
    ros.spin_until(lambda: first.poll() is not None, what="the end of the patience")
    goal = first.goal_id
    assert f"its goal {goal} is still open" in first.poll().reason
    second = skill.start({"angle": 2.0})
    ros.spin_until(lambda: second.poll() is not None, what="the answer to the second one")
    assert f"goal {goal} of action /spin" in second.poll().reason and spinner.goals == [1.0]
    spinner.server.finish(Spin.Result(), Outcome.CANCELLED)
    third = skill.start({"angle": 3.0})
    ros.spin_until(lambda: spinner.goals == [1.0, 3.0], what="the goal after the end of the first one")
    third.cancel()
    spinner.server.finish(Spin.Result(), Outcome.CANCELLED)
    ros.spin_until(lambda: third.poll() is not None, what="the end")


def test_a_goal_that_rclpy_forgot_too_early_is_a_failure_of_the_node_and_not_of_the_process(
    ros: Any, client: FlorenceNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As when the process stands still for long between the end of a goal and its result."""
    spinner = ros.add(Spinner())
    reported: list[BaseException] = []
    server = spinner.server._server
    execute = type(server)._execute_goal

    async def execute_goal(self: Any, *arguments: Any) -> None:
        futures = dict(self._result_futures)
        self._result_futures.clear()
        await execute(self, *arguments)
        self._result_futures.update(futures)
        for future in futures.values():
            future.set_result(Spin.Impl.GetResultService.Response(status=6))
        reported.extend(spinner.failures)
        spinner.failures.clear()

    monkeypatch.setattr(type(server), "_execute_goal", execute_goal)
    run = spin_skill(client).start({"angle": 1.0})
    ros.spin_until(lambda: spinner.server.active, what="the goal")
    spinner.server.finish(Spin.Result(), Outcome.SUCCEEDED)
    ros.spin_until(run.poll, what="the result")
    assert isinstance(reported[0], KeyError)


def test_goals_with_the_ids_of_expired_goals(
    ros: Any, client: FlorenceNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clients on small controllers send the same id every time."""
    monkeypatch.setattr("florence_bt.ros.action_server.KEEP_RESULTS_S", 0)
    spinner = ros.add(Spinner())
    spinner.at_once = True
    sender = client.create_client(Spin.Impl.SendGoalService, "spin/_action/send_goal")
    ros.spin_until(sender.service_is_ready, what="the server")
    answers: list[bool] = []
    for number in range(350):
        request = Spin.Impl.SendGoalService.Request(goal=Spin.Goal(target_yaw=float(number)))
        request.goal_id.uuid = [number % 3] * 16
        sender.call_async(request).add_done_callback(lambda answer: answers.append(answer.result().accepted))
        if number % 7 == 6:  # some arrive together with the end of those before
            ros.spin_until(lambda sent=number + 1: len(answers) == sent, what="the answers")
    assert len(spinner.goals) == answers.count(True) > 3, "an id is free again when its goal has expired"
    assert not spinner.failures


def test_results_expire_although_the_simulation_stands(
    ros: Any, client: FlorenceNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("florence_bt.ros.action_server.KEEP_RESULTS_S", 1)
    spinner = ros.add(Spinner(parameters={"use_sim_time": True}))
    spinner.at_once = True
    clock = client.create_publisher(Clock, "/clock", 1)
    ros.spin_until(clock.get_subscription_count, what="the subscription to the clock")
    clock.publish(Clock(clock=stamp_to_ros(1000.0)))
    sender = client.create_client(Spin.Impl.SendGoalService, "spin/_action/send_goal")
    ros.spin_until(sender.service_is_ready, what="the server")
    request = Spin.Impl.SendGoalService.Request()  # always with the same id

    def accepted() -> bool:
        answer = sender.call_async(request)
        ros.spin_until(answer.done, what="the answer")
        return bool(answer.result().accepted)

    assert accepted()
    assert not accepted()
    ros.spin_until(accepted, what="the end of the first goal's result")
