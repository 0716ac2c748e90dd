"""What the console says about servers that are missing."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from florence_bt.app.bringup.missing_servers import MissingServers
from florence_bt.ros.robot_state import RobotState


class Node:
    def create_subscription(self, kind: Any, topic: str, callback: Any, qos: Any, **options: Any) -> None:
        self.take = callback

    def steady(self) -> float:
        return 0.0

    def of_stamp(self, stamp: float) -> None:
        return None


def about(name: str, message: str, **missing: str) -> DiagnosticArray:
    values = [KeyValue(key=key, value=value) for key, value in missing.items()]
    return DiagnosticArray(status=[DiagnosticStatus(name=name, message=message, values=values)])


def test_it_is_told_whenever_it_changes() -> None:
    node, told = Node(), []
    MissingServers(RobotState(node, node), told.append)  # type: ignore[arg-type]
    lost = about("florence_bt: servers", "they fail", turn="action /spin (nav2_msgs/action/Spin)")
    node.take(about("turtlebot_node: Battery", "low", charge="3 %"))
    for _ in range(2):
        node.take(lost)
    assert told == ["nobody serves, and they fail:", "  turn: action /spin (nav2_msgs/action/Spin)"]
    node.take(about("florence_bt: servers", "all there"))
    assert told[2:] == ["all there"]
    node.take(lost)
    assert len(told) == 5
