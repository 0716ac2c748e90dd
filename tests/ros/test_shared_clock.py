"""One subscription to /clock for the nodes of a loop."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rclpy")
from rosgraph_msgs.msg import Clock

from florence_bt.ros.conversions import stamp_to_ros
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
            self._publisher.publish(Clock(clock=stamp_to_ros(now)))
            return all(node.timebase.now() == pytest.approx(now) for node in nodes)

        self._ros.spin_until(known, what=f"the time {now}")

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
