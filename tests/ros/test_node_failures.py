"""A callback that fails, a message that is refused, a clock set back: the node goes on and says so."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from nav2_msgs.action import NavigateToPose, Spin
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.action import ActionClient
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64
from std_srvs.srv import SetBool

from florence_bt.ros import rclpy_internals, shared_clock
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.node import FlorenceNode, failed
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.skills.filters.velocity_filter.node import VelocityFilterNode
from florence_bt.skills.navigation.navigate.node import NavigationNode
from tools.safety_campaign.messages import ordinary

pytestmark = pytest.mark.ros
SIMULATED = {"use_sim_time": True}


@pytest.fixture
def going(ros: Any) -> Any:
    """ROS with the loop of a process: it goes on when a callback fails."""
    ros.loop.close()
    ros.loop = SpinLoop(keep_going=True)
    return ros


class Fragile(FlorenceNode):
    def __init__(self) -> None:
        super().__init__("fragile")
        self.made_safe: list[str] = []
        self.heard: list[float] = []
        self.create_subscription(Float64, "numbers", self._on_number, RELIABLE)
        self.create_service(SetBool, "serve", self._serve)

    def on_failure(self, reason: str) -> None:
        self.made_safe.append(reason)
        raise OSError("and this fails too")

    def _on_number(self, message: Float64) -> None:
        self.heard.append(1.0 / message.data)

    def _serve(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = True
        raise KeyError("kitchen")


@pytest.fixture
def fragile(going: Any) -> Fragile:
    return going.add(Fragile())


def test_a_callback_that_fails_ends_nothing_and_is_told_once(
    going: Any, fragile: Fragile, capfd: Any
) -> None:
    other = going.add(FlorenceNode("other"))
    told: list[DiagnosticArray] = []
    other.create_subscription(DiagnosticArray, "diagnostics", told.append, RELIABLE)
    numbers = other.create_publisher(Float64, "numbers", RELIABLE)
    going.spin_until(numbers.get_subscription_count)
    for number in (0.0, 0.0, 0.0, 2.0):
        numbers.publish(Float64(data=number))
    going.spin_until(lambda: fragile.heard == [0.5])
    assert len(fragile.made_safe) == 3
    assert fragile.made_safe[0].startswith("the node fragile failed: ZeroDivisionError")
    going.spin_until(lambda: told and told[-1].status[1].level == b"\x02", what="the diagnostics")
    assert told[-1].status[1].name == "fragile: callbacks"
    assert "ZeroDivisionError" in str(told[-1].status[1].values)
    assert capfd.readouterr().err.count("in _on_number") == 1, "a flood of failures floods no log"


def test_a_service_that_fails_answers_with_the_reason(going: Any, fragile: Fragile) -> None:
    node = going.add(FlorenceNode("client"))
    client = node.create_client(SetBool, "serve")
    going.spin_until(client.service_is_ready)
    answer = client.call_async(SetBool.Request(data=True))
    going.spin_until(answer.done)
    assert not answer.result().success
    assert answer.result().message == "the node fragile failed: KeyError('kitchen')"


def test_refused_messages_are_counted_and_told_until_it_is_quiet(
    going: Any, fragile: Fragile, monkeypatch: pytest.MonkeyPatch, capfd: Any
) -> None:
    monkeypatch.setattr("florence_bt.ros.node_health.REPORT_FOR_S", 0.2)
    monkeypatch.setattr("florence_bt.ros.node_health.REPORT_PERIOD_S", 0.05)
    monkeypatch.setattr("florence_bt.ros.node_health.REFUSAL_LOG_PERIOD_S", 3600.0)
    levels: list[bytes] = []
    other = going.add(FlorenceNode("other"))
    other.create_subscription(
        DiagnosticArray, "diagnostics", lambda message: levels.append(message.status[0].level), RELIABLE
    )
    (numbers,) = (one for one in fragile.subscriptions if one.topic_name == "/numbers")
    for _ in range(5):
        numbers.callback(Float64(data=float("inf")))
    assert fragile.heard == [] and fragile.health.refused == {"numbers": 5}
    going.spin_until(lambda: other.count_publishers("/diagnostics"))
    numbers.callback(Float64(data=float("inf")))
    going.spin_until(lambda: b"\x01" in levels and levels[-1] == b"\x00", what="the quiet")
    count = len(levels)
    going.spin_for(0.2)
    assert len(levels) == count, "it rests"
    assert capfd.readouterr().err.count("message refused") == 1


def give(subscription: Any, message: Any) -> None:
    """Hand a subscription a message, as its bytes where it takes those."""
    subscription.callback(serialize_message(message) if subscription.raw else message)


@pytest.fixture
def navigation(going: Any) -> NavigationNode:
    node = going.add(NavigationNode())
    for subscription in node.subscriptions:
        if subscription.topic_name in ("/map", "/odom"):
            give(subscription, ordinary(subscription.msg_type, node.timebase.now()))
    going.spin_until(lambda: node.navigation.navigator, what="the costmaps")
    return node


@pytest.mark.parametrize(("action", "name"), [(NavigateToPose, "navigate_to_pose"), (Spin, "spin")])
def test_navigation_that_fails_stops_the_robot_and_ends_the_goal(
    going: Any, navigation: NavigationNode, action: Any, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(navigation.navigation.navigator, "step", lambda *_: 1 / 0)
    node = going.add(FlorenceNode("client"))
    commands: list[Twist] = []
    node.create_subscription(Twist, "cmd_vel", commands.append, RELIABLE)
    client = ActionClient(node, action, name)
    node.on_destroy(client.destroy)
    going.spin_until(lambda: client.server_is_ready() and node.count_publishers("/cmd_vel"))
    sent = client.send_goal_async(ordinary(action.Goal, 0.0))
    going.spin_until(sent.done)
    end = sent.result().get_result_async()
    going.spin_until(end.done, what="the end of the goal")
    assert end.result().status == 6
    assert end.result().result.error_msg.startswith("the node navigate failed: ZeroDivisionError")
    going.spin_until(lambda: commands, what="the standstill")
    assert commands[-1] == Twist()


def test_a_bad_goal_gets_its_reason_and_the_running_one_goes_on(
    going: Any, navigation: NavigationNode
) -> None:
    node = going.add(FlorenceNode("client"))
    client = ActionClient(node, Spin, "spin")
    node.on_destroy(client.destroy)
    going.spin_until(client.server_is_ready)
    handles, ends = [], []
    for goal in (ordinary(Spin.Goal, 0.0), Spin.Goal(target_yaw=1e30)):
        sent = client.send_goal_async(goal)
        going.spin_until(sent.done)
        handles.append(sent.result())
        ends.append(handles[-1].get_result_async())
    going.spin_until(ends[1].done, what="the end of the bad goal")
    assert ends[1].result().status == 6
    assert ends[1].result().result.error_code == 700
    assert "target_yaw is 1e+30" in ends[1].result().result.error_msg
    assert not ends[0].done() and navigation.navigation.navigator.active
    handles[0].cancel_goal_async()
    going.spin_until(ends[0].done, what="the end of the goal that went on")
    assert ends[0].result().status == 5


def test_the_velocity_filter_that_fails_stops_until_the_next_command(going: Any) -> None:
    node = going.add(VelocityFilterNode())
    other = going.add(FlorenceNode("other"))
    told: list[float] = []
    other.create_subscription(Twist, "filtered_cmd_vel", lambda one: told.append(one.linear.x), RELIABLE)
    commands = other.create_publisher(Twist, "cmd_vel", RELIABLE)
    going.spin_until(
        lambda: commands.get_subscription_count() and other.count_publishers("/filtered_cmd_vel")
    )
    drive = Twist()
    drive.linear.x = 0.3

    def driving() -> bool:
        commands.publish(drive)
        return bool(told) and told[-1] > 0.0

    going.spin_until(driving)
    node.failures.append(RuntimeError("a test"))
    going.spin_until(lambda: told[-1] == 0.0, what="the stop")
    going.spin_until(driving, what="the next good command")


def test_a_wall_clock_that_is_set_back_holds_nothing_up(ros: Any) -> None:
    node = ros.add(FlorenceNode("a"))
    offset, resets, fired = [0], [], []
    node.ros_timebase._handle = SimpleNamespace(
        get_now=lambda: SimpleNamespace(nanoseconds=time.time_ns() + offset[0])
    )
    node.ros_timebase.on_reset(lambda: resets.append(1))
    begin = node.timebase.now()
    node.timebase.call_at(begin + 0.2, lambda: fired.append(1))
    offset[0] = -60_000_000_000
    ros.spin_until(lambda: fired, timeout_s=50.0, what="a wait that is not 60 s longer")
    assert node.timebase.now() - begin < 50.0
    assert node.stamp() < begin
    ros.spin_until(lambda: resets == [1, 1], what="the end of what was on its way")


def clock_of(ros: Any, node: FlorenceNode) -> Callable[[float], None]:
    """Sets the simulated time of a node, seconds."""
    teller = ros.add(FlorenceNode("teller"))
    clock = teller.create_publisher(Clock, "/clock", RELIABLE)
    ros.spin_until(clock.get_subscription_count)

    def tell(seconds: float) -> None:
        def known() -> bool:
            message = Clock()
            message.clock.sec = int(seconds)
            clock.publish(message)
            return node.stamp() == seconds

        ros.spin_until(known, what=f"the time {seconds}")
        ros.loop.drain()

    return tell


def test_a_clock_that_is_set_back_clears_what_was_stamped_before(ros: Any) -> None:
    node = ros.add(NavigationNode(parameters=SIMULATED))
    (odometry,) = (one for one in node.subscriptions if one.topic_name == "/odom")
    tell = clock_of(ros, node)
    tell(100.0)
    give(odometry, ordinary(Odometry, 100.0))
    assert node.navigation._queue.odometry.stamp == 100.0
    tell(40.0)
    assert node.navigation._queue.odometry is None
    give(odometry, ordinary(Odometry, 40.0))
    assert node.navigation._queue.odometry.stamp == 100.0, "the time goes on, whatever the stamps say"


def test_who_tells_another_time_is_not_believed_while_the_first_one_goes_on(
    ros: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = ros.add(FlorenceNode("a", parameters=SIMULATED))
    teller = ros.add(FlorenceNode("teller"))
    clock = teller.create_publisher(Clock, "/clock", RELIABLE)
    ros.spin_until(clock.get_subscription_count)
    steady = [0.0]
    monkeypatch.setattr(shared_clock, "time", SimpleNamespace(monotonic=lambda: steady[0]))

    def tell(sec: int, nanosec: int = 0) -> float:
        message = Clock()
        message.clock.sec, message.clock.nanosec = sec, nanosec
        refused, heard = node.health.refused["/clock"], ros.loop._clock._time
        clock.publish(message)
        ros.spin_until(
            lambda: node.health.refused["/clock"] > refused or ros.loop._clock._time is not heard,
            what=str(message),
        )
        steady[0] += 0.3
        return node.stamp()

    assert tell(100) == 100.0
    for strange in ((2**31 - 1, 0), (5, 0), (-(2**31), 0), (100, 2**32 - 1)):
        assert tell(*strange) == 100.0
        assert tell(100) == 100.0
    assert node.health.refused["/clock"] == 4
    assert [tell(time) for time in (5, 101, 5, 101)] == [100.0, 101.0, 101.0, 101.0]
    assert [tell(time) for time in (5, 5, 90, 5)] == [101.0, 101.0, 101.0, 101.0], "two others, not one"
    assert [tell(time) for time in (5, 5, 6)] == [101.0, 5.0, 6.0]


def test_a_map_that_is_refused_leaves_the_one_there_is(ros: Any) -> None:
    node = ros.add(NavigationNode())
    publisher = ros.add(FlorenceNode("maps")).create_publisher(OccupancyGrid, "map", LATCHED)
    publisher.publish(ordinary(OccupancyGrid, 0.0))
    ros.spin_until(lambda: node.navigation.navigator)
    navigator = node.navigation.navigator
    bad = ordinary(OccupancyGrid, 0.0)
    bad.info.resolution = 1e-30
    publisher.publish(bad)
    ros.spin_until(lambda: node.health.refused["map"])
    assert node.navigation.navigator is navigator


SERVICE_PACKAGES = (
    "diagnostic_msgs",
    "florence_interfaces",
    "nav2_msgs",
    "nav_msgs",
    "py_trees_ros_interfaces",
    "rcl_interfaces",
    "std_srvs",
)


def service_types() -> list[type]:
    """Every type of service in the packages that Florence serves."""
    modules = [importlib.import_module(f"{package}.srv") for package in SERVICE_PACKAGES]
    return [kind for module in modules for kind in vars(module).values() if hasattr(kind, "Response")]


@pytest.mark.parametrize("service", service_types(), ids=lambda kind: kind.__name__)
def test_the_answer_of_a_service_that_failed_never_says_success(service: type) -> None:
    answer = failed(service.Response, "it burns")
    constants = {name: getattr(service.Response, name) for name in dir(service.Response) if "SUCCESS" in name}
    for field, kind in service.Response.get_fields_and_field_types().items():
        if kind == "boolean":
            assert getattr(answer, field) is False, field
        assert not constants or kind != "uint8" or getattr(answer, field) not in constants.values(), field


def test_a_warning_that_was_told_lately_comes_again_when_the_clock_was_set_back(
    ros: Any, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    node, steady = ros.add(FlorenceNode("a")), [50.0]
    monkeypatch.setattr(rclpy_internals.time, "monotonic_ns", lambda: int(steady[0] * 1e9))

    def told() -> bool:
        node.get_logger().warning("something is wrong", throttle_duration_sec=60.0)
        return "something is wrong" in capfd.readouterr().err

    heard = []
    for steady[0] in (50.0, 51.0, 111.0):
        heard.append(told())
    assert heard == [True, False, True]
