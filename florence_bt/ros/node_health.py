"""Health of a node that goes on although something goes wrong: refused messages and failed callbacks."""

from __future__ import annotations

import traceback
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.topic_names import FAILURES, LATENESS, REFUSALS
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros

if TYPE_CHECKING:
    from florence_bt.ros.node import FlorenceNode

REFUSAL_LOG_PERIOD_S = 1.0
"""Seconds between two log lines about refused messages of one topic."""
FAILURE_LOG_PERIOD_S = 10.0
"""Seconds between two tracebacks from one line of code."""
REPORT_PERIOD_S = 1.0
"""Seconds between two diagnostics while something goes wrong."""
REPORT_FOR_S = 10.0
"""Seconds without trouble after which the diagnostics say so, once, and rest."""


class NodeHealth:
    """Counts, logs and publishes what goes wrong in one node; costs nothing while all is well.

    All methods belong to the executor's thread.

    Attributes:
        refused: How many messages were refused, by topic, service or action.
        failed: How many callbacks failed, by the line of code that raised.
        late: How often the process was late.
    """

    def __init__(self, node: FlorenceNode) -> None:
        self.refused: Counter[str] = Counter()
        self.failed: Counter[str] = Counter()
        self.late: Counter[str] = Counter()
        self._node = node
        self._last: dict[str, str] = {}
        self._logged: dict[str, float] = {}
        self._publisher: Any = None
        self._reporting = False
        self._quiet_at = 0.0

    def count_refused(self, source: str, problem: str) -> None:
        """Count a message that was not used.

        Args:
            source: Topic, service or action.
            problem: What is wrong with it, and what would have worked.
        """
        self.refused[source] += 1
        self._last[source] = problem
        if self._may_log(source, REFUSAL_LOG_PERIOD_S):
            count = self.refused[source]
            self._node.get_logger().warning(f"{source}: message refused ({count} so far): {problem}")
        self._report_soon()

    def count_failed(self, error: Exception) -> None:
        """Count a callback that raised."""
        frames = traceback.extract_tb(error.__traceback__)
        source = f"{frames[-1].filename}:{frames[-1].lineno}" if frames else type(error).__name__
        self.failed[source] += 1
        self._last[source] = f"{type(error).__name__}: {error}"
        if self._may_log(source, FAILURE_LOG_PERIOD_S):
            text = "".join(traceback.format_exception(error))
            count = self.failed[source]
            self._node.get_logger().error(f"a callback failed ({count} so far); the node goes on:\n{text}")
        self._report_soon()

    def count_late(self, late_s: float) -> None:
        """Note that this process is late with what comes in.

        Args:
            late_s: By how much, in steady seconds.
        """
        self.late[LATENESS] += 1
        self._last[LATENESS] = f"{late_s:.1f} s behind"
        if self._may_log(LATENESS, FAILURE_LOG_PERIOD_S):
            self._node.get_logger().warning(
                f"this process is late by {late_s:.1f} s: of readings only the newest count; "
                "the machine is too busy"
            )
        self._report_soon()

    def _may_log(self, source: str, period_s: float) -> bool:
        now = self._node.steady.now()
        if now - self._logged.get(source, -period_s) < period_s:
            return False
        self._logged[source] = now
        return True

    def _report_soon(self) -> None:
        self._quiet_at = self._node.steady.now() + REPORT_FOR_S
        if not self._reporting:
            self._reporting = True
            self._report()

    def _report(self) -> None:
        """Publish now and once a second, until it has been quiet for a while."""
        node = self._node
        if self._publisher is None:
            self._publisher = diagnostics_publisher(node)
        now = node.steady.now()
        self._reporting = now < self._quiet_at
        found = {
            REFUSALS: self._diagnosis(self.refused, Severity.WARN, "messages are refused"),
            FAILURES: self._diagnosis(self.failed, Severity.ERROR, "callbacks fail"),
            **(
                {LATENESS: self._diagnosis(self.late, Severity.WARN, self._last[LATENESS])}
                if self.late
                else {}
            ),
        }
        self._publisher.publish(diagnostics_to_ros(found, node.get_name(), node.get_name(), node.stamp()))
        if self._reporting:
            node.steady.call_at(now + REPORT_PERIOD_S, self._report)

    def _diagnosis(self, counts: Mapping[str, int], level: Severity, problem: str) -> Diagnosis:
        values = {source: f"{count}; the last: {self._last[source]}" for source, count in counts.items()}
        if counts and self._reporting:
            return Diagnosis(level, problem, values)
        return Diagnosis(Severity.OK, "no trouble", values)
