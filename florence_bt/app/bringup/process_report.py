"""Tells about the processes of a bring-up: on ``diagnostics``, and in a log of its own."""

from __future__ import annotations

import time
from pathlib import Path

from florence_bt.app.bringup.heartbeat import SILENT_S
from florence_bt.app.bringup.supervisor import RESTARTS_PERIOD_S, Supervisor, log_line
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.heard import age_text
from florence_bt.core.topic_names import PROCESS, SUPERVISOR
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode

PROCESS_REPORT_S = 1.0
"""Seconds between two diagnoses."""


class ProcessReport:
    """Publishes how the processes are, and writes what was said about them into ``florence_up.log``.

    Args:
        node: Publishes.
        supervisor: Knows the processes.
        log_folder: Where the logs are.
    """

    def __init__(self, node: FlorenceNode, supervisor: Supervisor, log_folder: Path) -> None:
        self._node = node
        self._supervisor = supervisor
        self._file = log_folder / f"{SUPERVISOR}.log"
        self._topic = diagnostics_publisher(node)
        self._due = 0.0

    def write(self, line: str, level: str) -> None:
        """Write a line into the log, if that can be done: what is said is on the console in any case."""
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            with self._file.open("a", encoding="utf-8") as log:
                log.write(log_line(line, level) + "\n")
        except OSError as error:
            self._node.get_logger().warning(
                f"{self._file} cannot be written: {error.strerror}", throttle_duration_sec=60.0
            )

    def publish(self) -> None:
        """Publish a diagnosis of each process, once a second; call it often."""
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + PROCESS_REPORT_S
        silences = self._supervisor.silences()
        found = {
            f"{PROCESS}{name}": self._diagnosis(name, pid, silences.get(name, 0.0))
            for name, pid in self._supervisor.pids().items()
        }
        self._topic.publish(diagnostics_to_ros(found, SUPERVISOR, "", self._node.stamp()))

    def _diagnosis(self, name: str, pid: int, silent_s: float) -> Diagnosis:
        restarts = self._supervisor.restarts(name)
        values = {"pid": str(pid), "restarts": str(restarts)}
        if name in self._supervisor.given_up():
            return Diagnosis(Severity.ERROR, "has died too often and is not started again", values)
        if name in self._supervisor.waiting():
            return Diagnosis(Severity.ERROR, "has died and is about to be started again", values)
        if silent_s >= SILENT_S:
            return Diagnosis(Severity.ERROR, f"has not answered for {age_text(silent_s)}", values)
        if restarts:
            times = "once" if restarts == 1 else f"{restarts} times"
            since = f"was started again {times} in the last {RESTARTS_PERIOD_S / 60:.0f} min"
            return Diagnosis(Severity.WARN, since, values)
        return Diagnosis(Severity.OK, "runs", values)
