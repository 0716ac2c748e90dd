"""What the drivers publish about their devices while a robot comes up: which are missing, and what to do."""

from __future__ import annotations

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from florence_bt.app.bringup.topology import DEVICE_NODES
from florence_bt.core.topic_names import DIAGNOSTICS
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE


class DeviceReport:
    """Keeps the diagnostics of the drivers. A device that has worked is not missing when it falters.

    Args:
        node: Subscribes to ``diagnostics``.
    """

    def __init__(self, node: FlorenceNode) -> None:
        self._status: dict[str, DiagnosticStatus] = {}
        self._worked: set[str] = set()
        node.create_subscription(DiagnosticArray, DIAGNOSTICS, self._on_diagnostics, RELIABLE)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self._status |= {status.name: status for status in message.status}
        self._worked |= {status.name for status in message.status if status.level == DiagnosticStatus.OK}

    def missing(self) -> list[str]:
        """Name each device that has not worked yet, a line each with its driver's advice."""
        silent = set(DEVICE_NODES) - {name.partition(":")[0] for name in self._status}
        return [
            *(
                f"{name}: {status.message}"
                for name, status in sorted(self._status.items())
                if status.level == DiagnosticStatus.ERROR and name not in self._worked
            ),
            *(f"{name}: its driver reports nothing; see the logs" for name in sorted(silent)),
        ]


def report_missing(report: DeviceReport, say: Callable[[str], None]) -> None:
    """Report which devices do not work, if any."""
    lines = report.missing()
    for line in lines:
        say(f"device missing: {line}")
    if lines:
        say("one that is plugged in later is used at once; florence doctor examines each")
