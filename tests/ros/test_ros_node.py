"""The base node: clock, parameters, callbacks from threads, the end of a process."""

from __future__ import annotations

import signal
import sys
import threading
from dataclasses import dataclass
from typing import Any

import pytest

pytest.importorskip("rclpy")
from nav_msgs.msg import OccupancyGrid
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock as ClockMsg
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, Trigger

from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import failure, success
from florence_bt.ros.conversions import stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED
from florence_bt.ros.service_skill import ServiceSkill

pytestmark = pytest.mark.ros

GENEROUS_S = 300.0
"""For the start of a process."""


@dataclass(frozen=True, slots=True)
class Settings:
    rate: float = 10.0
    frame: str = "map"
    limit: float | None = None
    window: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.rate <= 0.0:
            raise ConfigError(f"rate must be above zero, not {self.rate}")


def test_parameters(ros: Any) -> None:
    node = ros.add(FlorenceNode("a", parameters={"rate": 5, "window": (1.0, 2.0), "limit": None}))
    assert node.read_parameters(Settings) == Settings(5.0, "map", None, (1.0, 2.0))
    assert node.unknown_parameters() is None
    assert node.read_parameters(Settings) == Settings(5.0, "map", None, (1.0, 2.0)), (
        "reading again is harmless"
    )
    empty = ros.add(FlorenceNode("b", parameters={"window": ()}))
    assert empty.read_parameters(Settings) == Settings()


def test_the_node_of_a_command_has_no_services_and_no_log_elsewhere(ros: Any) -> None:
    node = ros.add(FlorenceNode("typed", of_a_command=True))
    assert node.get_service_names_and_types_by_node("typed", "/") == []
    topics = [name for name, _ in node.get_publisher_names_and_types_by_node("typed", "/")]
    assert topics == ["/parameter_events"]
    usual = ros.add(FlorenceNode("usual"))
    assert "/usual/set_parameters" in dict(usual.get_service_names_and_types_by_node("usual", "/"))


def test_no_process_loads_the_parser_of_message_definitions(start_process: Any) -> None:
    program = """
import sys
from florence_bt.ros.arguments import start_ros
from florence_bt.ros.node import FlorenceNode
start_ros()
FlorenceNode("any")
print(f"lark: {'lark' in sys.modules}; generator: {'rosidl_generator_py' in sys.modules}")
"""
    child = start_process(sys.executable, "-c", program)
    child.wait_for("lark: False; generator: True")
    child.process.wait(60)


def test_wrong_parameters(ros: Any) -> None:
    node = ros.add(FlorenceNode("a", parameters={"rate": "fast"}))
    with pytest.raises(ConfigError, match="node a: parameter 'rate' cannot be 'fast'"):
        node.read_parameters(Settings)
    node = ros.add(FlorenceNode("b", parameters={"rate": -1.0}))
    with pytest.raises(ConfigError, match="node b: rate must be above zero"):
        node.read_parameters(Settings)
    node = ros.add(FlorenceNode("c", parameters={"frme": "odom"}))
    node.read_parameters(Settings)
    assert "no parameter 'frme'" in str(node.unknown_parameters())
    assert node.unknown_parameters().valid == ("frame",)


def test_call_soon_from_a_thread_runs_on_the_executor(ros: Any) -> None:
    node = FlorenceNode("a")
    ran: list[tuple[str, threading.Thread]] = []
    node.call_soon(lambda: ran.append(("before there is an executor", threading.current_thread())))
    ros.add(node)
    thread = threading.Thread(
        target=lambda: node.call_soon(lambda: ran.append(("thread", threading.current_thread())))
    )
    thread.start()
    thread.join()
    ros.spin_until(lambda: len(ran) == 2)
    assert [name for name, _ in ran] == ["before there is an executor", "thread"]
    assert {where for _, where in ran} == {threading.main_thread()}


def test_an_exception_of_a_guarded_callback_reaches_the_loop(ros: Any) -> None:
    node = ros.add(FlorenceNode("a"))
    node.call_soon(lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        ros.spin_until(lambda: False)


def test_timers_of_the_wall_clock(ros: Any) -> None:
    clock = ros.add(FlorenceNode("a")).timebase
    order: list[str] = []
    begin = clock.now()
    clock.call_at(begin + 0.06, lambda: order.append("third"))
    clock.call_at(begin + 0.03, lambda: order.append("first"))
    clock.call_at(begin + 0.03, lambda: order.append("second"))
    clock.call_at(begin - 1.0, lambda: order.append("past"))
    cancelled = clock.call_at(begin + 0.04, lambda: order.append("cancelled"))
    cancelled.cancel()
    assert order == []
    ros.spin_until(lambda: len(order) == 4)
    assert order == ["past", "first", "second", "third"]
    assert clock.now() - begin >= 0.06
    cancelled.cancel()


def test_many_cancelled_timers_are_cleared_up(ros: Any) -> None:
    clock = ros.add(FlorenceNode("a")).timebase
    for _ in range(1000):
        clock.call_at(clock.now() + 100.0, lambda: None).cancel()
    assert len(clock._queue) < 100
    fired: list[int] = []
    clock.call_at(clock.now() + 0.01, lambda: fired.append(1))
    ros.spin_until(lambda: fired)


def test_timers_of_a_closed_clock_never_come(ros: Any) -> None:
    node = ros.add(FlorenceNode("closing"))
    came: list[str] = []
    for clock in (node.ros_timebase, node.steady):
        clock.call_at(clock.now() + 0.01, lambda: came.append("before"))
        clock.close()
        assert clock.waiting == 0
        clock.call_at(clock.now() + 0.01, lambda: came.append("after"))
    other = ros.add(FlorenceNode("other"))
    other.steady.call_at(other.steady.now() + 0.1, lambda: came.append("other"))
    ros.spin_until(lambda: bool(came))
    assert came == ["other"]


def test_periodic_timer(ros: Any) -> None:
    clock = ros.add(FlorenceNode("a")).timebase
    moments: list[float] = []
    begin = clock.now()
    timer = call_every(clock, 0.02, lambda: moments.append(clock.now()))
    ros.spin_until(lambda: len(moments) >= 10)
    timer.cancel()
    count = len(moments)
    ros.spin_for(0.05)
    assert len(moments) == count
    assert all(moment - begin >= 0.02 * number - 1e-3 for number, moment in enumerate(moments, 1))


class SimulatedTime:
    """A node on simulated time, and the hand that drives the clock."""

    def __init__(self, ros: Any) -> None:
        self.ros = ros
        self.source = ros.add(FlorenceNode("source"))
        self.node = ros.add(FlorenceNode("a", parameters={"use_sim_time": True}))
        self.publisher = self.source.create_publisher(ClockMsg, "/clock", 1)
        ros.spin_until(lambda: self.source.count_subscribers("/clock") == 1)

    def set(self, seconds: float) -> None:
        def arrived() -> bool:
            self.publisher.publish(ClockMsg(clock=stamp_to_ros(seconds)))
            self.ros.spin_for(0.01)
            return self.node.stamp() == seconds

        self.ros.spin_until(arrived)
        self.ros.spin_for(0.02)


def test_timers_follow_simulated_time(ros: Any) -> None:
    simulated = SimulatedTime(ros)
    clock = simulated.node.timebase
    fired: list[float] = []
    simulated.set(10.0)
    clock.call_at(11.0, lambda: fired.append(clock.now()))
    simulated.set(10.9)
    assert fired == []
    simulated.set(11.5)
    ros.spin_until(lambda: fired, what="the timer")
    assert fired == [11.5]


def test_waits_begun_before_the_first_simulated_time_keep_their_length(ros: Any) -> None:
    simulated = SimulatedTime(ros)
    clock = simulated.node.timebase
    fired: list[float] = []
    assert clock.now() == 0.0
    clock.call_at(clock.now() + 5.0, lambda: fired.append(clock.now()))
    ros.spin_for(0.05)
    simulated.set(1000.0)
    assert fired == []
    simulated.set(1004.0)
    assert fired == []
    simulated.set(1005.5)
    ros.spin_until(lambda: fired, what="the timer")
    assert fired == [1005.5]


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_waits_survive_a_simulation_that_starts_over(ros: Any, start: float) -> None:
    simulated = SimulatedTime(ros)
    clock = simulated.node.timebase
    fired: list[float] = []
    simulated.set(500.0)
    clock.call_at(502.0, lambda: fired.append(simulated.node.stamp()))
    simulated.set(start)
    simulated.set(start + 1.0)
    assert fired == []
    simulated.set(start + 2.25)
    ros.spin_until(lambda: fired, what="the timer")
    assert fired == [start + 2.25]
    assert clock.now() == pytest.approx(502.25)


def test_service_skill(ros: Any) -> None:
    server, client = ros.add(FlorenceNode("server")), ros.add(FlorenceNode("client"))

    def answer(request: Any, response: Any) -> Any:
        response.success, response.message = request.data, "because"
        return response

    server.create_service(SetBool, "light", answer)
    skill = ServiceSkill(
        client,
        SetBool,
        "light",
        to_request=lambda inputs: SetBool.Request(data=inputs["on"]),
        to_result=lambda m: success() if m.success else failure("dark", m.message),
        deadline_s=300.0,
    )
    assert ros.spin_until(skill.start({"on": True}).poll).succeeded
    assert ros.spin_until(skill.start({"on": False}).poll) == failure("dark", "because")
    assert skill.start({}).poll().code == "bad_input"
    dropped = skill.start({"on": True})
    dropped.cancel()
    assert dropped.poll().code == "cancelled"
    ros.spin_for(0.1)


def test_service_skill_without_a_server(ros: Any) -> None:
    client = ros.add(FlorenceNode("client"))
    skill = ServiceSkill(
        client,
        Trigger,
        "stop",
        to_request=lambda _: Trigger.Request(),
        to_result=lambda m: success(),
        deadline_s=0.2,
    )
    result = ros.spin_until(skill.start({}).poll)
    assert result.code == "server_lost"
    assert "service /stop" in result.reason


def test_shut_down_closes_every_part(ros: Any) -> None:
    closed: list[str] = []

    class Fragile(FlorenceNode):
        def close(self) -> None:
            closed.append("node")
            raise OSError("the port is gone")

    node = ros.add(Fragile("a"))
    node.on_close(lambda: closed.append("first"))
    node.on_close(lambda: closed.append("second"))
    with pytest.raises(ExceptionGroup, match="closing a"):
        node.shut_down()
    assert closed == ["node", "second", "first"]
    node.close = lambda: None  # type: ignore[method-assign]


CHILD = """
import sys
from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.process import run_nodes

class Talker(FlorenceNode):
    def __init__(self, name, parameters=None):
        super().__init__(name, parameters=parameters)
        self.call_soon(lambda: print(name, "spins", flush=True))

    def close(self):
        print("closing", self.get_name(), flush=True)
        if "fragile" in sys.argv:
            raise OSError("no port")

def broken():
    raise ConfigError("no such device", valid=["/dev/ttyUSB0"])

def failing():
    node = Talker("b")
    node.on_failure = lambda reason: print("made safe:", reason, flush=True)
    # The three of one moment: the last one is called although the others raise.
    for callback in (lambda: 1 / 0, lambda: 1 / 0, lambda: print("b goes on", flush=True)):
        node.timebase.call_at(0.0, callback)
    return node

second = {"broken": broken, "failing": failing, "typo": lambda: Talker("b", {"rat": 1.0})}
sys.exit(run_nodes([lambda: Talker("a"), second.get(sys.argv[1], lambda: Talker("b"))]))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_process_in_order(start_process: Any, number: signal.Signals) -> None:
    child = start_process("-c", CHILD, "fine")
    child.wait_for("b spins")
    child.wait_for("a spins")
    assert child.end(number) == 0
    assert child.output.splitlines()[-2:] == ["closing b", "closing a"]
    assert "Traceback" not in child.output


@pytest.mark.parametrize(
    ("how", "text", "closed"),
    [
        ("broken", "error: no such device (would have worked: /dev/ttyUSB0)", ["closing a"]),
        ("typo", "error: node b has no parameter 'rat'", ["closing b", "closing a"]),
    ],
)
def test_a_failure_closes_all_and_is_told(start_process: Any, how: str, text: str, closed: list[str]) -> None:
    child = start_process("-c", CHILD, how)
    assert child.process.wait(GENEROUS_S) == 1
    assert text in child.output
    assert [line for line in child.output.splitlines() if line.startswith("closing")] == closed


def test_a_callback_that_fails_ends_no_process(start_process: Any) -> None:
    child = start_process("-c", CHILD, "failing")
    child.wait_for("b goes on")
    child.wait_for("made safe: the node b failed: ZeroDivisionError")
    assert child.end() == 0
    assert child.output.count("Traceback") == 1, "the second one is from the same kind of place"


def test_a_failure_while_closing_does_not_stop_the_others(start_process: Any) -> None:
    child = start_process("-c", CHILD, "fine", "fragile")
    child.wait_for("b spins")
    assert child.end(signal.SIGINT) == 1
    assert "closing b" in child.output
    assert "closing a" in child.output
    assert "no port" in child.output


BEATS = """
import sys, threading, time
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.process import run_nodes

beats = []
node = None

def make():
    global node
    node = FlorenceNode("a")
    return node

def hang():
    before = len(beats)
    time.sleep(0.7)
    print("beats while it hung:", len(beats) - before, flush=True)

def look():
    while len(beats) < 4:
        time.sleep(0.01)
    node.call_soon(hang)

threading.Thread(target=look, daemon=True).start()
sys.exit(run_nodes([make], beat=lambda long_work=False: beats.append(None)))
"""


def test_a_process_beats_while_it_serves_callbacks_and_not_while_one_hangs(start_process: Any) -> None:
    child = start_process("-c", BEATS)
    child.wait_for("beats while it hung: 0")
    assert child.end() == 0


def test_who_gets_a_map_says_that_long_work_begins(ros: Any) -> None:
    said: list[str] = []
    node = ros.add(FlorenceNode("reader"))
    node.before_long_work = lambda: said.append("long work")
    node.create_subscription(OccupancyGrid, "map", lambda message: said.append("map"), LATCHED)
    node.create_subscription(Bool, "switch", lambda message: said.append("switch"), LATCHED)
    node.create_publisher(Bool, "switch", LATCHED).publish(Bool())
    ros.spin_until(lambda: said == ["switch"])
    one = OccupancyGrid(data=[0])
    one.info.width = one.info.height = 1
    one.info.resolution = 0.05
    one.info.origin.orientation.w = 1.0
    node.create_publisher(OccupancyGrid, "map", LATCHED).publish(one)
    ros.spin_until(lambda: said == ["switch", "long work", "map"])


def test_a_start_after_killed_processes(start_process: Any) -> None:
    for _ in range(2):
        killed = start_process("-c", CHILD, "fine")
        killed.wait_for("b spins")
        killed.end(signal.SIGKILL)
    child = start_process("-c", CHILD, "fine")
    child.wait_for("b spins")
    assert child.end() == 0


@pytest.mark.parametrize("simulated", [False, True])
def test_the_source_of_the_time_cannot_be_switched(ros: Any, simulated: bool) -> None:
    node = ros.add(FlorenceNode("node", parameters={"use_sim_time": simulated}))
    (refused,) = node.set_parameters([Parameter("use_sim_time", value=not simulated)])
    assert not refused.successful and "start it again" in refused.reason
    assert node.get_parameter("use_sim_time").value is simulated
    assert node.set_parameters([Parameter("use_sim_time", value=simulated)])[0].successful
