"""The end of what is shown: its source has fallen silent, or nobody is left who has told it."""

from __future__ import annotations

from collections.abc import Callable, Collection

from florence_bt.core.clock import Clock
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.server_processes import DiscoveredServers


class Silence:
    """Tells which things that come again and again have ceased to come.

    Args:
        clock: The time of this machine.
        limit_s: Seconds after which a thing has ceased.
    """

    def __init__(self, clock: Clock, limit_s: float) -> None:
        self._clock = clock
        self._limit_s = limit_s
        self._heard: dict[str, float] = {}

    def heard(self, name: str) -> None:
        """Take note that a thing has come."""
        self._heard[name] = self._clock.now()

    def take_ended(self) -> list[str]:
        """Return the things that have ceased to come, each once."""
        oldest = self._clock.now() - self._limit_s
        ended = [name for name, when in self._heard.items() if when <= oldest]
        for name in ended:
            del self._heard[name]
        return ended


class Tellers:
    """Notices that nobody is left who has told a thing that is told only when it changes.

    Args:
        there: Returns the ids of those who could tell it now.
        gone: Called when none of those is left who were there when it was told last.
    """

    def __init__(self, there: Callable[[], Collection[bytes]], gone: Callable[[], object]) -> None:
        self._there = there
        self._gone = gone
        self._told_by: set[bytes] | None = None
        self._news = False

    def heard(self) -> None:
        """Take note that the thing was told."""
        self._news = True

    def look(self) -> None:
        """Look who is left; to be called again and again."""
        there = set(self._there())
        if self._news:
            self._news, self._told_by = False, there
        if self._told_by is not None and not self._told_by & there:
            self._told_by = None
            self._gone()


def tellers_of(node: FlorenceNode, topic: str, gone: Callable[[], object]) -> Tellers:
    """Return who publishes a topic, with what to do when nobody is left who has told it."""
    name = node.resolve_topic_name(topic)
    return Tellers(DiscoveredServers(lambda: node.get_publishers_info_by_topic(name)).ids, gone)
