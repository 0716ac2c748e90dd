"""One subscription to /clock for the nodes of a loop."""

from __future__ import annotations

import threading
from typing import Any

import pytest

pytest.importorskip("rclpy")
from rosgraph_msgs.msg import Clock

from florence_bt.ros import shared_clock
from florence_bt.ros.conversions import stamp_from_ros, stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE

pytestmark = pytest.mark.ros
SIMULATED = {"use_sim_time": True}


class Teller:
    """Publishes the simulated time."""

    def __init__(self, ros: Any) -> None:
        self.node = ros.add(FlorenceNode("teller"))
        self._publisher = self.node.create_publisher(Clock, "/clock", RELIABLE)
        self._ros = ros

    def tell(self, now: float, *nodes: FlorenceNode) -> None:
        """Publish until all these nodes know."""

        def known() -> bool:
            self.publish(now)
            return all(node.stamp() == pytest.approx(now) for node in nodes)

        self._ros.spin_until(known, what=f"the time {now}")

    def publish(self, now: float) -> None:
        """Publish once."""
        self._publisher.publish(Clock(clock=stamp_to_ros(now)))

    def rests(self) -> None:
        """Wait until the loop does not listen any more."""
        self._ros.spin_until(lambda: not self._ros.loop._clock.listens, what="the rest")

    def listeners(self) -> int:
        return int(self.node.count_subscribers("/clock"))


def test_all_nodes_follow_one_subscription(ros: Any) -> None:
    teller = Teller(ros)
    nodes = [ros.add(FlorenceNode(f"node_{index}", parameters=SIMULATED)) for index in range(3)]
    teller.tell(10.0, *nodes)
    assert teller.listeners() == 1
    assert teller.node.timebase.now() > 1e9  # the wall clock


def test_a_late_node_knows_the_time_at_once(ros: Any) -> None:
    teller = Teller(ros)
    teller.tell(10.0, ros.add(FlorenceNode("early", parameters=SIMULATED)))
    late = ros.add(FlorenceNode("late", parameters=SIMULATED))
    assert late.timebase.now() == pytest.approx(10.0)


def test_another_node_takes_over(ros: Any) -> None:
    teller = Teller(ros)
    first, second, third = (ros.add(FlorenceNode(name, parameters=SIMULATED)) for name in ("a", "b", "c"))
    teller.tell(10.0, first, second, third)
    ros.close_node(first)
    teller.tell(11.0, second, third)
    ros.close_node(third)
    teller.tell(12.0, second)
    assert teller.listeners() == 1


def test_a_removed_node_follows_the_time_by_itself(ros: Any) -> None:
    teller = Teller(ros)
    one, other = (ros.add(FlorenceNode(name, parameters=SIMULATED)) for name in ("one", "other"))
    teller.tell(10.0, one, other)
    ros.loop.remove(one)
    ros.spin_until(lambda: teller.listeners() == 2, what="two listeners")
    ros.loop.add(one)
    ros.spin_until(lambda: teller.listeners() == 1, what="one listener")
    teller.tell(11.0, one, other)


class Reader(threading.Thread):
    """Has just read something from a device."""

    def __init__(self, node: FlorenceNode) -> None:
        super().__init__()
        self._node = node
        self.arrived: float | None = None
        self.start()

    def run(self) -> None:
        self.arrived = self._node.ros_timebase.arrival_time()


def test_what_overtook_the_time_of_its_moment_waits_for_it(ros: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_clock, "DEVICE_WAIT_S", 600.0)
    teller = Teller(ros)
    node = ros.add(FlorenceNode("driver", parameters=SIMULATED))
    teller.tell(10.0, node)
    ros.spin_for(0.2)  # whatever is still on its way
    reader = Reader(node)
    ros.spin_for(0.05)
    assert reader.arrived is None

    def goes_on() -> bool:
        teller.publish(10.5)
        return reader.arrived is not None

    ros.spin_until(goes_on, what="the moment of arrival")
    assert reader.arrived == pytest.approx(10.5)


def test_a_standing_simulation_holds_no_reader_up(ros: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_clock, "DEVICE_WAIT_S", 0.01)
    teller = Teller(ros)
    node = ros.add(FlorenceNode("driver", parameters=SIMULATED))
    teller.tell(10.0, node)
    reader = Reader(node)
    reader.join()
    assert reader.arrived == pytest.approx(10.0)


def test_on_the_wall_clock_no_reader_waits(ros: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_clock, "DEVICE_WAIT_S", 600.0)
    reader = Reader(ros.add(FlorenceNode("driver")))
    reader.join(60.0)
    assert reader.arrived is not None


@pytest.fixture
def idle(ros: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A teller and a node on simulated time, 10 s, where nobody has asked for the time for long."""
    monkeypatch.setattr(shared_clock, "IDLE_S", 0.05)
    teller, node = Teller(ros), ros.add(FlorenceNode("a", parameters=SIMULATED))
    teller.tell(10.0, node)
    teller.rests()
    return teller, node


class Ticking:
    """Publishes the simulated time from a thread, as another process does."""

    def __init__(self, teller: Teller, now: float) -> None:
        self.now = now
        self._teller = teller
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._tick)

    def _tick(self) -> None:
        while not self._over.wait(0.005):
            self._teller.publish(self.now)

    def __enter__(self) -> Ticking:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        self._thread.join()


def test_an_idle_process_does_not_listen(ros: Any, idle: Any) -> None:
    teller, _ = idle
    ros.spin_until(lambda: teller.listeners() == 0, what="the end of the subscription")
    teller.publish(11.0)
    ros.spin_for(0.2)
    assert not ros.loop._clock.listens


@pytest.mark.parametrize("now", [5000.0, 10.25, 3.0])
def test_who_asks_is_told_the_time_of_the_moment(
    ros: Any, idle: Any, monkeypatch: pytest.MonkeyPatch, now: float
) -> None:
    monkeypatch.setattr(shared_clock, "FIRST_S", 30.0)
    teller, node = idle
    with Ticking(teller, now):
        assert node.stamp() == pytest.approx(now)
    teller.rests()
    with Ticking(teller, now + 1.0):
        assert stamp_from_ros(node.get_clock().now().to_msg()) == pytest.approx(now + 1.0)


def test_a_wait_that_begins_while_idle(ros: Any, idle: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_clock, "FIRST_S", 30.0)
    teller, node = idle
    fired: list[float] = []
    for begin in (100.0, 200.0, 50.0):
        with Ticking(teller, begin) as ticking:
            node.timebase.call_at(node.timebase.now() + 5.0, lambda: fired.append(node.stamp()))
            ticking.now = begin + 4.5
            ros.spin_for(0.2)
            assert not fired and ros.loop._clock.listens, "it must listen while somebody waits"
            ticking.now = begin + 5.5
            ros.spin_until(lambda: fired, what="the moment")
        assert fired.pop() == pytest.approx(begin + 5.5)
        teller.rests()


def test_a_timer_of_rclpy_runs_while_nobody_asks(
    ros: Any, idle: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shared_clock, "FIRST_S", 30.0)
    teller, node = idle
    fired: list[bool] = []
    with Ticking(teller, 20.0) as ticking:
        timer = node.create_timer(5.0, lambda: fired.append(True))
        ticking.now = 24.0
        ros.spin_for(0.5)  # many times IDLE_S
        assert not fired
        ticking.now = 25.5
        ros.spin_until(lambda: fired, what="the timer")
    timer.cancel()
    teller.rests()


@pytest.mark.parametrize("somebody_publishes", [True, False])
def test_a_wait_keeps_its_length_when_the_time_was_not_to_be_had(
    ros: Any, idle: Any, monkeypatch: pytest.MonkeyPatch, somebody_publishes: bool
) -> None:
    """The simulation stands, or has gone, and comes back an hour later."""
    monkeypatch.setattr(shared_clock, "FIRST_S", 0.05)
    teller, node = idle
    if not somebody_publishes:
        monkeypatch.setattr(node, "count_publishers", lambda topic: 0)
    assert node.timebase.now() == pytest.approx(10.0)
    fired: list[float] = []
    node.timebase.call_at(node.timebase.now() + 5.0, lambda: fired.append(node.stamp()))
    teller.tell(3610.0, node)
    teller.tell(3614.5, node)
    assert not fired
    teller.tell(3616.0, node)
    ros.spin_until(lambda: fired, what="the moment")


def test_an_idle_node_can_go_and_another_one_come(ros: Any, idle: Any) -> None:
    teller, node = idle
    second = ros.add(FlorenceNode("second", parameters=SIMULATED))
    assert second.timebase.now() == pytest.approx(10.0)
    teller.rests()
    ros.close_node(node)
    teller.tell(11.0, second)
    ros.close_node(second)
    ros.spin_until(lambda: teller.listeners() == 0, what="the end of the subscription")
    third = ros.add(FlorenceNode("third", parameters=SIMULATED))
    teller.tell(12.0, third)
