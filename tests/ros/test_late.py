"""A process that is late: the newest readings count, events do not get lost, and it says that it is late."""

from __future__ import annotations

import time
from typing import Any

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, Vector3
from std_msgs.msg import Float64

from florence_bt.core.topic_names import CMD_VEL, FILTERED_CMD_VEL, LATENESS, MANUAL_CMD_VEL
from florence_bt.ros.late_nodes import LateNodes
from florence_bt.ros.node import MAX_COMMAND_AGE_S, FlorenceNode
from florence_bt.ros.qos import RELIABLE, STATE
from florence_bt.skills.filters.velocity_filter.node import VelocityFilterNode

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


@pytest.mark.parametrize(
    ("topic", "out"), [(CMD_VEL, FILTERED_CMD_VEL), (MANUAL_CMD_VEL, "filtered_manual_cmd_vel")]
)
def test_a_command_that_waited_in_the_queue_is_not_driven(
    ros: Any, monkeypatch: pytest.MonkeyPatch, topic: str, out: str
) -> None:
    """The filter rested when its process was stopped: what was sent meanwhile is the newest there is."""
    driver, base, velocity_filter = (
        ros.add(node) for node in (FlorenceNode("driver"), FlorenceNode("base"), VelocityFilterNode())
    )
    driven: list[float] = []
    base.create_subscription(Twist, out, lambda twist: driven.append(twist.linear.x), RELIABLE)
    commands = driver.create_publisher(Twist, topic, RELIABLE)
    forward = Twist(linear=Vector3(x=0.3))

    def drives() -> bool:
        commands.publish(forward)
        return bool(driven) and driven[-1] > 0.0

    ros.spin_until(drives, what="that commands of now are driven")
    ros.spin_until(lambda: not velocity_filter.limiting.tickers[topic].running, what="that it rests")
    driven.clear()
    date, passed_s = time.time, MAX_COMMAND_AGE_S + 0.5
    monkeypatch.setattr(time, "time", lambda: date() + passed_s)
    commands.publish(forward)
    ros.spin_until(lambda: velocity_filter.health.refused[topic], what="the refusal")
    assert not any(driven)
    passed_s = 3_600.0  # another machine, whose clock is wrong
    ros.spin_until(drives, what="that the commands of a machine without the date are driven")


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
