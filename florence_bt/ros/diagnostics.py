"""Diagnoses as ROS messages, on the topic ``diagnostics``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.topic_names import DIAGNOSTICS
from florence_bt.ros.conversions import stamp_to_ros
from florence_bt.ros.qos import LATCHED


def diagnostics_publisher(node: Node) -> Any:
    """Make a node's publisher on ``diagnostics``; who comes later gets the last message at once."""
    return node.create_publisher(DiagnosticArray, DIAGNOSTICS, LATCHED)


def diagnostics_to_ros(
    found: Mapping[str, Diagnosis], node_name: str, hardware_id: str, stamp: float
) -> DiagnosticArray:
    """Make one message for ``diagnostics``.

    Args:
        found: Diagnoses by what they are about.
        node_name: Goes before each name, as in "turtlebot_node: Battery".
        hardware_id: Which device.
        stamp: Seconds.
    """
    message = DiagnosticArray()
    message.header.stamp = stamp_to_ros(stamp)
    message.status = [
        DiagnosticStatus(
            level=bytes([diagnosis.level]),
            name=f"{node_name}: {name}",
            message=diagnosis.message,
            hardware_id=hardware_id,
            values=[KeyValue(key=key, value=value) for key, value in diagnosis.values.items()],
        )
        for name, diagnosis in found.items()
    ]
    return message


def diagnosis_from_ros(status: DiagnosticStatus) -> Diagnosis:
    """Read one line of ``diagnostics``; a level that the message does not know is an error."""
    level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
    known = Severity(level) if level in {*Severity} else Severity.ERROR
    return Diagnosis(known, status.message, {value.key: value.value for value in status.values})
