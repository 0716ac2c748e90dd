"""The robot is made to stand still, and held: who is asked, what is sent, and when it counts as safe."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy")
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from florence_bt.app.bringup.hold import HARD_STOP, STOP_ALL, RobotHold
from florence_bt.app.bringup.make_safe import MAKE_SAFE_LIMIT_S, SERVERS_SEARCH_S, ZERO_PERIOD_S, BaseSafety
from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import Outcome


class Node:
    """A node whose time is driven by hand."""

    def __init__(self) -> None:
        self.steady = ManualClock(100.0)
        self.sent: list[tuple[float, str, Twist]] = []
        self.subscriptions: dict[str, Callable[[Any], None]] = {}
        self.asked: list[tuple[str, bool]] = []
        self.there = {HARD_STOP: True, STOP_ALL: True}

    def create_publisher(self, kind: type, topic: str, qos: Any) -> Any:
        return SimpleNamespace(publish=lambda message: self.sent.append((self.steady.now(), topic, message)))

    def create_subscription(
        self, kind: type, topic: str, callback: Callable[[Any], None], qos: Any, **options: Any
    ) -> str:
        self.subscriptions[topic] = callback
        return topic

    def destroy_subscription(self, topic: str) -> None:
        del self.subscriptions[topic]

    def call_soon(self, callback: Callable[[], None]) -> None:
        self.steady.call_at(self.steady.now(), callback)

    def create_client(self, kind: type, name: str) -> Any:
        return SimpleNamespace(
            call_async=lambda request: self.asked.append((name, request.data)) or SimpleNamespace(done=bool),
            service_is_ready=lambda: self.there[name],
        )

    def drive(self, linear: float = 0.0, angular: float = 0.0) -> None:
        """Say how the base moves, if somebody still listens."""
        message = Odometry()
        message.twist.twist.linear.x, message.twist.twist.angular.z = linear, angular
        if "odom" in self.subscriptions:
            self.subscriptions["odom"](message)


class Goals:
    """Servers of two actions; each is there from a moment on, and answers when it is told to."""

    def __init__(self, node: Node, **since: float) -> None:
        self.actions = tuple(since)
        self.cancelled: list[str] = []
        self.answer: dict[str, Callable[[], None]] = {}
        self._node, self._since = node, since

    def server_is_there(self, action: str) -> bool:
        return self._node.steady.now() >= self._since[action]

    def cancel_all(self, action: str, on_answer: Callable[[], None]) -> None:
        self.cancelled.append(action)
        self.answer[action] = on_answer


def stand(node: Node, readings: int = 3, **speed: float) -> None:
    for _ in range(readings):
        node.drive(**speed)


@pytest.fixture
def node() -> Node:
    return Node()


def test_the_base_is_safe_when_all_servers_answered_and_it_stands(node: Node) -> None:
    goals = Goals(node, navigate=0.0, spin=0.0)
    run = BaseSafety(node, goals).make_safe()  # type: ignore[arg-type]
    assert goals.cancelled == ["navigate", "spin"]
    stand(node)
    goals.answer["navigate"]()
    goals.answer["navigate"]()
    assert run.poll() is None, "one has not answered"
    goals.answer["spin"]()
    result = run.poll()
    assert result is not None and result.succeeded
    node.steady.advance(0.0)
    assert node.subscriptions == {}, "it listens no more"


def test_zero_is_commanded_ten_times_a_second_until_the_end(node: Node) -> None:
    run = BaseSafety(node, Goals(node, navigate=0.0)).make_safe()  # type: ignore[arg-type]
    node.steady.advance(1.0)
    assert [topic for _, topic, _ in node.sent] == ["cmd_vel"] * 11
    assert all(twist == Twist() for _, _, twist in node.sent)
    assert node.sent[-1][0] - node.sent[0][0] == pytest.approx(10 * ZERO_PERIOD_S)
    run.cancel()
    result = run.poll()
    assert result is not None and result.code == "cancelled"
    node.steady.advance(5.0)
    assert len(node.sent) == 11


@pytest.mark.parametrize(
    ("linear", "angular", "stands"),
    [(0.009, 0.0, True), (0.01, 0.0, False), (-0.02, 0.0, False), (0.0, -0.009, True), (0.0, 0.01, False)],
)
def test_it_stands_below_a_centimetre_a_second(
    node: Node, linear: float, angular: float, stands: bool
) -> None:
    run = BaseSafety(node, Goals(node)).make_safe()  # type: ignore[arg-type]
    stand(node, linear=linear, angular=angular)
    assert (run.poll() is not None) is stands


def test_three_readings_in_a_row_must_say_that_it_stands(node: Node) -> None:
    run = BaseSafety(node, Goals(node)).make_safe()  # type: ignore[arg-type]
    stand(node, 2)
    node.drive(linear=0.1)
    stand(node, 2)
    assert run.poll() is None
    node.drive()
    assert run.poll() is not None


def test_servers_are_looked_for_some_seconds_and_one_that_comes_later_has_no_goals(node: Node) -> None:
    goals = Goals(node, navigate=101.0, spin=100.0 + SERVERS_SEARCH_S + 0.5)
    run = BaseSafety(node, goals).make_safe()  # type: ignore[arg-type]
    stand(node)
    node.steady.advance(1.2)
    assert goals.cancelled == ["navigate"]
    goals.answer["navigate"]()
    assert run.poll() is None, "the other one may still come"
    node.steady.advance(SERVERS_SEARCH_S - 1.2 + 2 * ZERO_PERIOD_S)
    result = run.poll()
    assert result is not None and result.succeeded
    node.steady.advance(5.0)
    assert goals.cancelled == ["navigate"]


@pytest.mark.parametrize(
    ("answers", "speed", "reason"),
    [
        (True, 0.2, "the base is still moving"),
        (True, None, "no odometry"),
        (False, 0.0, "no answer from navigate"),
        (False, None, "no answer from navigate; no odometry"),
    ],
)
def test_what_is_not_known_in_time_is_told(
    node: Node, answers: bool, speed: float | None, reason: str
) -> None:
    goals = Goals(node, navigate=0.0)
    run = BaseSafety(node, goals).make_safe()  # type: ignore[arg-type]
    if answers:
        goals.answer["navigate"]()
    if speed is not None:
        stand(node, linear=speed)
    node.steady.advance(MAKE_SAFE_LIMIT_S - 2 * ZERO_PERIOD_S)
    assert run.poll() is None
    node.steady.advance(3 * ZERO_PERIOD_S)
    result = run.poll()
    assert result is not None and (result.outcome, result.code) == (Outcome.FAILED, "timed_out")
    assert result.reason == f"not known to be safe after 15 s: {reason}"
    stand(node)
    again = run.poll()
    assert again is None or again.code == "timed_out"


# ---- held by the supervisor ----------------------------------------------------------------------------


class Port:
    """Stands for the base's port."""

    def __init__(self) -> None:
        self.stops = 0

    def stop(self) -> str:
        self.stops += 1
        return "by the port"


class Held:
    """A robot that can be held, and whether its filter answers."""

    def __init__(self, answers: bool = True) -> None:
        self.node, self.port = Node(), Port()
        self.budgets: list[float] = []

        def spin_until(condition: Callable[[], bool], budget_s: float) -> bool:
            self.budgets.append(budget_s)
            return answers

        client = SimpleNamespace(node=self.node, spin_until=spin_until)
        self.hold = RobotHold(client, self.port)  # type: ignore[arg-type]


def test_a_filter_that_answers_holds_the_robot_alone() -> None:
    held = Held()
    assert not held.hold.held
    assert held.hold.hold(driver_answers=True) == ""
    assert (held.node.asked, held.port.stops, held.hold.held) == ([(HARD_STOP, True)], 0, True)
    held.hold.release()
    assert (held.node.asked[1:], held.hold.held) == ([(HARD_STOP, False)], False)


def test_the_hand_is_stopped_too_where_all_ends() -> None:
    held = Held()
    held.hold.hold(driver_answers=True, hand=True)
    assert held.node.asked == [(STOP_ALL, True)]
    held.hold.release()
    assert held.node.asked[1:] == [(HARD_STOP, False)]


@pytest.mark.parametrize(
    ("driver_answers", "is_there", "answers", "waited"),
    [(False, True, True, []), (True, False, True, []), (True, True, False, [0.2])],
)
def test_the_base_is_stopped_by_its_port_when_the_filter_may_not_hold_it(
    driver_answers: bool, is_there: bool, answers: bool, waited: list[float]
) -> None:
    held = Held(answers)
    held.node.there[HARD_STOP] = is_there
    assert held.hold.hold(driver_answers=driver_answers) == "by the port"
    assert (held.port.stops, held.budgets, held.hold.held) == (1, waited, True)
    assert held.node.asked == [(HARD_STOP, True)], "it holds the robot when it comes back"
