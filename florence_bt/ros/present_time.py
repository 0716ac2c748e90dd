"""The clocks by which a listener tells the age of what it hears; it need not be a node of simulated time."""

from __future__ import annotations

import time

from rosgraph_msgs.msg import Clock as ClockMessage

from florence_bt.core.clock import Clock
from florence_bt.core.topic_names import CLOCK
from florence_bt.ros.action_client import LatestMessages
from florence_bt.ros.conversions import stamp_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.shared_clock import QOS

ANOTHER_CLOCK_S = 86_400.0
"""Stamps that are further from the date than this are of another clock, such as that of a simulation."""


class PresentTimeOfStamps:
    """The steady time, and the time of stamps: simulated while somebody tells it, else this machine's date.

    The simulated time is not served by the executor, which would run a callback for each of its messages: the
    newest one is taken when somebody asks.

    Args:
        node: Listens.
    """

    def __init__(self, node: FlorenceNode) -> None:
        self._node = node
        self._messages = LatestMessages(node, ClockMessage, CLOCK, QOS.depth, QOS)
        self._simulated: float | None = None

    def steady(self) -> float:
        """Return the time of this machine, which never leaps."""
        return self._node.steady.now()

    def of_stamp(self, stamp: float) -> float | None:
        """Return what the clock of a stamp says now; None when that is not known."""
        simulated = self.simulated()
        if simulated is not None:
            return simulated
        return None if is_of_another_clock(stamp) else time.time()

    def simulated(self) -> float | None:
        """Return the simulated time that was told last; None before the first message."""
        for message in self._messages.take():
            self._simulated = stamp_from_ros(message.clock)
        return self._simulated


def is_of_another_clock(stamp: float) -> bool:
    """Tell whether a stamp is not of this machine's date; a stamp of zero is of none."""
    return bool(stamp) and abs(time.time() - stamp) > ANOTHER_CLOCK_S


class SteadyTime:
    """The steady time alone, for what is told by its absence and not by stamps.

    Args:
        clock: Steady seconds.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def steady(self) -> float:
        """Return the time of this machine, which never leaps."""
        return self._clock.now()

    def of_stamp(self, stamp: float) -> None:
        """Return nothing: stamps are not read."""
