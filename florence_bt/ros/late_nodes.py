"""Which processes say that they are late (:mod:`florence_bt.ros.rounds`), for people who wonder why."""

from __future__ import annotations

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.node_health import LATE, REPORT_PERIOD_S
from florence_bt.ros.qos import RELIABLE

OLD_S = 5.0 * REPORT_PERIOD_S
"""Who is late says so once a second; one that has died says nothing more."""


class LateNodes:
    """Hears on ``diagnostics`` who is late.

    Args:
        node: Subscribes.
        on_news: Is told a sentence when somebody becomes late, and when they are no more.
    """

    def __init__(self, node: FlorenceNode, on_news: Callable[[str], object] = lambda sentence: None) -> None:
        self._node = node
        self._on_news = on_news
        self._late: dict[str, tuple[float, str]] = {}
        node.create_subscription(DiagnosticArray, "diagnostics", self._take, RELIABLE, sift=_is_about_it)

    def sentences(self) -> list[str]:
        """Return who is late now, a sentence each."""
        now = self._node.steady.now()
        self._late = {name: told for name, told in self._late.items() if now - told[0] < OLD_S}
        return [text for _, text in self._late.values()]

    def _take(self, message: DiagnosticArray) -> None:
        self.sentences()
        for status in message.status:
            name, _, what = status.name.partition(": ")
            if what != LATE:
                continue
            was_late = name in self._late
            if status.level == DiagnosticStatus.OK:
                self._late.pop(name, None)
                if was_late:
                    self._on_news(f"the process of {name} is not late any more")
                continue
            text = f"the process of {name} is {status.message}: the machine is too busy"
            self._late[name] = (self._node.steady.now(), text)
            if not was_late:
                self._on_news(text)


def _is_about_it(serialised: bytes) -> bool:
    return f": {LATE}".encode() in serialised
