"""Diagnoses as ROS messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from florence_bt.ros.conversions import stamp_to_ros


class DiagnosisLike(Protocol):
    """What a driver thinks of its device; see ``florence_bt.drivers.diagnosis.Diagnosis``."""

    @property
    def level(self) -> int:
        """0 well, 1 warning, 2 error, 3 no news."""

    @property
    def message(self) -> str:
        """What it is, in words."""

    @property
    def values(self) -> Mapping[str, str]:
        """Details by name."""


def diagnostics_to_ros(
    found: Mapping[str, DiagnosisLike], node_name: str, hardware_id: str, stamp: float
) -> DiagnosticArray:
    """One message for ``diagnostics``.

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
