"""Holds the robot still from the supervisor: by the velocity filter, else by the base's port."""

from __future__ import annotations

from std_srvs.srv import SetBool

from florence_bt.app.bringup.make_safe_port import HungDriverStop
from florence_bt.app.runs.client import MissionClient

HARD_STOP = "velocity_filter/hard_stop"
ANSWER_BUDGET_S = 0.2
"""Wall seconds to wait for the velocity filter, which answers within 20 ms; then the base's port is used."""


class RobotHold:
    """Stops the base at once, past every limit, and holds it.

    Attributes:
        held: Whether the velocity filter was asked to hold the robot and not yet to let it go.

    Args:
        client: Talks to the velocity filter.
        port: Stops the base when the filter does not answer.
    """

    def __init__(self, client: MissionClient, port: HungDriverStop) -> None:
        self._client = client
        self._port = port
        self._hard_stop = client.node.create_client(SetBool, HARD_STOP)
        self.held = False

    def hold(self, *, driver_answers: bool) -> str:
        """Stop the base; takes :data:`ANSWER_BUDGET_S` at most.

        Args:
            driver_answers: Whether the process of the base's driver is known to answer.

        Returns:
            Why the base may still be driving, for people; empty when it was told to stop.
        """
        # Also a process that does not answer is asked: it holds the robot when it comes back.
        answer = self._hard_stop.call_async(SetBool.Request(data=True))
        self.held = True
        there = driver_answers and self._hard_stop.service_is_ready()
        if there and self._client.spin_until(answer.done, ANSWER_BUDGET_S):
            return ""
        return self.stop_by_port()

    def stop_by_port(self) -> str:
        """Tell the base itself to stop; never waits. The result is that of :meth:`hold`."""
        return self._port.stop()

    def release(self) -> None:
        """Let the robot go: the next velocity command counts again."""
        self._hard_stop.call_async(SetBool.Request(data=False))
        self.held = False
