"""Report of what the drivers publish while a robot comes up: which devices are missing, and what to do."""

from __future__ import annotations

from collections.abc import Callable

from florence_bt.app.bringup.topology import DEVICE_NODES
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.ros.robot_state import RobotState


class DeviceReport:
    """Keeps the diagnostics of the drivers. A device that has worked is not missing when it falters.

    Args:
        robot: Hears them.
    """

    def __init__(self, robot: RobotState) -> None:
        self._robot = robot
        self._worked: set[str] = set()
        robot.listen_to_diagnostics(self._take)

    def _take(self, name: str, told: Diagnosis) -> None:
        if told.level is Severity.OK:
            self._worked.add(name)

    def missing(self) -> list[str]:
        """Name each device that has not worked yet, a line each with its driver's advice."""
        told = {name: heard.last for name, heard in self._robot.diagnoses() if heard.last is not None}
        silent = set(DEVICE_NODES) - {name.partition(":")[0] for name in told}
        return [
            *(
                f"{name}: {diagnosis.message}"
                for name, diagnosis in told.items()
                if diagnosis.level is Severity.ERROR and name not in self._worked
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
