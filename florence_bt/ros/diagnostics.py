"""Diagnoses as ROS messages."""

from __future__ import annotations

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from florence_bt.core.diagnosis import Diagnosis
from florence_bt.ros.conversions import stamp_to_ros


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
