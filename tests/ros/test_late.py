"""A process that is late: the newest readings count, events do not get lost, and it says that it is late."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Float64

from florence_bt.core.topic_names import LATENESS
from florence_bt.ros.late_nodes import LateNodes
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE, STATE

pytestmark = pytest.mark.ros


def test_the_newest_readings_and_all_events_arrive(ros: Any) -> None:
    robot, reader = ros.add(FlorenceNode("robot")), ros.add(FlorenceNode("reader"))
    publisher = robot.create_publisher(Float64, "number", RELIABLE)
    readings: list[float] = []
    events: list[float] = []
    reader.create_subscription(Float64, "number", lambda message: readings.append(message.data), STATE)
    reader.create_subscription(
        Float64, "number", lambda message: events.append(message.data), STATE, newest_only=False
    )
    ros.spin_until(lambda: publisher.get_subscription_count() == 2)
    # Nothing is served meanwhile: they come in together.
    for number in range(10):
        publisher.publish(Float64(data=float(number)))
    ros.spin_until(lambda: events == list(range(10)))
    ros.spin_until(lambda: readings[-1:] == [9.0])
    assert readings == sorted(readings)


def test_who_is_late_says_so_until_it_is_not(ros: Any) -> None:
    busy, other = ros.add(FlorenceNode("busy")), ros.add(FlorenceNode("other"))
    told: list[str] = []
    late = LateNodes(other, told.append)
    heard: list[str] = []
    other.create_subscription(
        DiagnosticArray,
        "diagnostics",
        lambda message: heard.extend(each.name for each in message.status),
        RELIABLE,
    )
    assert busy.loop_rounds is not None and late.sentences() == []
    publisher = busy.create_publisher(DiagnosticArray, "diagnostics", RELIABLE)
    ros.spin_until(lambda: publisher.get_subscription_count() > 0)
    busy.health.count_late(3.2)
    ros.spin_until(lambda: late.sentences())
    (sentence,) = late.sentences()
    assert "busy" in sentence and "3.2 s" in sentence and told == [sentence]
    ros.spin_until(lambda: f"busy: {LATENESS}" in heard)
    busy.health._quiet_at = 0.0
    ros.spin_until(lambda: not late.sentences())
    assert len(told) == 2
