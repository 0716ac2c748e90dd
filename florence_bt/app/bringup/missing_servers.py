"""Lines for the console of the servers that the mission server says are missing."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from florence_bt.app.runs.client import MISSION_SERVER
from florence_bt.core.diagnosis import Diagnosis
from florence_bt.core.topic_names import SERVERS_STATUS
from florence_bt.ros.robot_state import RobotState


class MissingServers:
    """Reports which servers are missing whenever that changes: by skill, name and type.

    Args:
        robot: Hears what the mission server says.
        report: Told the lines.
    """

    def __init__(self, robot: RobotState, report: Callable[[str], None]) -> None:
        self._report = report
        self._told: Mapping[str, str] = {}
        robot.listen_to_diagnostics(self._take)

    def _take(self, name: str, told: Diagnosis) -> None:
        if name != f"{MISSION_SERVER}: {SERVERS_STATUS}" or told.values == self._told:
            return
        self._told = told.values
        if not self._told:
            self._report(told.message)
            return
        self._report(f"nobody serves, and {told.message}:")
        for skill, server in self._told.items():
            self._report(f"  {skill}: {server}")
