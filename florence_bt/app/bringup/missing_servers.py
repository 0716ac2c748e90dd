"""What the mission server says about servers that are missing, as lines for the console."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from diagnostic_msgs.msg import DiagnosticArray

from florence_bt.app.runs.client import MISSION_SERVER
from florence_bt.core.topic_names import DIAGNOSTICS, SERVERS_STATUS
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE


class MissingServers:
    """Reports which servers are missing whenever that changes: by skill, name and type.

    Args:
        node: Subscribes to ``diagnostics``.
        report: Told the lines.
    """

    def __init__(self, node: FlorenceNode, report: Callable[[str], None]) -> None:
        self._report = report
        self._told: Mapping[str, str] = {}
        node.create_subscription(DiagnosticArray, DIAGNOSTICS, self._on_diagnostics, RELIABLE)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name != f"{MISSION_SERVER}: {SERVERS_STATUS}":
                continue
            missing = {value.key: value.value for value in status.values}
            if missing == self._told:
                continue
            self._told = missing
            if missing:
                self._report(f"nobody serves, and {status.message}:")
                for skill, server in missing.items():
                    self._report(f"  {skill}: {server}")
            else:
                self._report(status.message)
