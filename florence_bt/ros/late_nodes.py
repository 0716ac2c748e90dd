"""Processes that say that they are late (:mod:`florence_bt.ros.rounds`), for people who wonder why."""

from __future__ import annotations

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.heard import Heard
from florence_bt.core.topic_names import DIAGNOSTICS, LATENESS
from florence_bt.ros.diagnostics import diagnosis_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.present_time import SteadyTime
from florence_bt.ros.qos import RELIABLE
from florence_bt.ros.robot_state import LATENESS_PERIOD_S, lateness_text


class LateNodes:
    """Hears on ``diagnostics`` who is late, and tells; it reads of the diagnostics only what is about that.

    Args:
        node: Subscribes.
        on_news: Is told a sentence when somebody becomes late, and when they are no more.
    """

    def __init__(self, node: FlorenceNode, on_news: Callable[[str], object] = lambda sentence: None) -> None:
        self._time = SteadyTime(node.steady)
        self._on_news = on_news
        self._late: dict[str, Heard[Diagnosis]] = {}
        node.create_subscription(DiagnosticArray, DIAGNOSTICS, self._take, RELIABLE, sift=_is_about_it)

    def sentences(self) -> list[str]:
        """Return who is late now, a sentence each; who has died says nothing more, and is forgotten."""
        self._late = {name: heard for name, heard in self._late.items() if heard.fresh is not None}
        return [
            lateness_text(name, heard.last) for name, heard in self._late.items() if heard.last is not None
        ]

    def _take(self, message: DiagnosticArray) -> None:
        self.sentences()
        for status in message.status:
            name, _, what = status.name.partition(": ")
            if what != LATENESS:
                continue
            told, before = diagnosis_from_ros(status), self._late.pop(name, None)
            if told.level is Severity.OK:
                if before is not None:
                    self._on_news(f"the process of {name} is not late any more")
                continue
            self._late[name] = before or Heard(self._time, LATENESS_PERIOD_S)
            self._late[name].take(told)
            if before is None:
                self._on_news(lateness_text(name, told))


def _is_about_it(serialised: bytes) -> bool:
    return f": {LATENESS}".encode() in serialised
