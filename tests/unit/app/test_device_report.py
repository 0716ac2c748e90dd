"""Which devices of a robot do not work, as their drivers say."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from florence_bt.app.bringup.device_report import DEVICE_NODES, DeviceReport, report_missing
from florence_bt.ros.robot_state import RobotState


class Topic:
    """Stands for the node: keeps the callback of the one subscription."""

    def create_subscription(self, kind: Any, topic: str, callback: Any, qos: Any, **options: Any) -> None:
        assert topic == "diagnostics"
        self.say = callback


class StandingTime:
    """A clock that stands."""

    def steady(self) -> float:
        return 0.0

    def of_stamp(self, stamp: float) -> None:
        return None


def heard_by(topic: Topic) -> RobotState:
    return RobotState(topic, StandingTime())  # type: ignore[arg-type]


def said(*, broken: dict[str, str]) -> DiagnosticArray:
    return DiagnosticArray(
        status=[
            DiagnosticStatus(
                name=f"{node}: connection",
                level=DiagnosticStatus.ERROR if node in broken else DiagnosticStatus.OK,
                message=broken.get(node, "all is well"),
            )
            for node in DEVICE_NODES
        ]
    )


def test_a_driver_that_has_said_nothing_is_named():
    report = DeviceReport(heard_by(Topic()))
    assert len(report.missing()) == len(DEVICE_NODES)
    assert "hokuyo_node: its driver reports nothing; see the logs" in report.missing()


def test_what_is_missing_is_told_with_the_drivers_advice():
    topic, lines = Topic(), []
    report = DeviceReport(heard_by(topic))
    topic.say(said(broken={"turtlebot_node": "cannot open /dev/ttyUSB0: plug it in"}))
    report_missing(report, lines.append)
    assert lines[0] == "device missing: turtlebot_node: connection: cannot open /dev/ttyUSB0: plug it in"
    assert len(lines) == 2 and "florence doctor" in lines[1]


def test_nothing_is_told_when_all_is_well_in_the_end():
    topic, lines = Topic(), []
    report = DeviceReport(heard_by(topic))
    topic.say(said(broken={"kinect_node": "no depth images arrive"}))
    topic.say(said(broken={}))
    report_missing(report, lines.append)
    assert lines == [] == report.missing()


def test_a_device_that_worked_and_falters_is_not_missing():
    topic = Topic()
    report = DeviceReport(heard_by(topic))
    topic.say(said(broken={"kinect_node": "no depth images arrive"}))
    topic.say(
        said(broken={"turtlebot_node": "no good frame for 0.5 s", "kinect_node": "no depth images arrive"})
    )
    assert report.missing() == ["kinect_node: connection: no depth images arrive"]
