"""The velocity filter as a component: ``cmd_vel`` in, ``filtered_cmd_vel`` out (document, section 3.6.1).

``manual_cmd_vel``, by which a person drives during the manual override, has a filter of its own.
A hard stop holds both, but lets the hand pass as long as the override is on: what hangs is not the person.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from florence_bt.core.geometry import Twist2
from florence_bt.core.ports import Delivery, Fields, Ports, Service, Topic
from florence_bt.core.topic_names import CMD_VEL, MANUAL_CMD_VEL, MANUAL_OVERRIDE
from florence_bt.skills.filters.velocity_filter.velocity_filter import (
    VelocityFilterParameters,
    VelocityTicker,
)

BY_PROGRAMS, BY_HAND = CMD_VEL, MANUAL_CMD_VEL
"""The topics of commands."""


@dataclass(frozen=True, slots=True)
class SetBool:
    """The request of ``std_srvs/SetBool``."""

    data: bool


class VelocityLimiting:
    """Limits the acceleration; the service ``~/hard_stop`` (true: stop, false: release) beats every program.

    Without the manual override it stops the commands by hand, too; ``~/stop_all`` always does. Each of them
    releases both.

    Attributes:
        tickers: One per topic of commands; each makes the steps of its filter on the component's clock.
    """

    def __init__(self, ports: Ports, limits: VelocityFilterParameters) -> None:
        self._ports = ports
        self.tickers = {topic: self._make_ticker(topic, limits) for topic in (BY_PROGRAMS, BY_HAND)}
        self._stopped = self._all_stopped = self._overridden = False
        ports.listen(Topic(MANUAL_OVERRIDE, bool, Delivery.LATCHED), self._take_override)
        for name, hand in (("hard_stop", False), ("stop_all", True)):
            service = Service(f"~/{name}", "std_srvs/srv/SetBool", SetBool)
            ports.serve(service, partial(self._stop, hand))

    def close(self) -> None:
        """Publish a last zero."""
        for ticker in self.tickers.values():
            ticker.close()

    def fail(self) -> None:
        """Stop at once; the next good command counts again."""
        for ticker in self.tickers.values():
            ticker.stop()

    def _make_ticker(self, topic: str, limits: VelocityFilterParameters) -> VelocityTicker:
        output = self._ports.output(Topic(f"filtered_{topic}", Twist2))
        ticker = VelocityTicker(self._ports.clock, output.send, limits)
        commands = Topic(topic, Twist2, Delivery.COMMAND)
        self._ports.listen(commands, partial(self._take_command, ticker))
        return ticker

    def _take_command(self, ticker: VelocityTicker, twist: Twist2) -> None:
        rejected = ticker.filter.rejected
        ticker.command(twist)
        if ticker.filter.rejected != rejected:
            told = f"velocity command refused: its numbers are not finite ({rejected + 1} so far)"
            self._ports.warn(told, BY_PROGRAMS)

    def _take_override(self, overridden: bool) -> None:
        self._overridden = overridden
        self._hold_or_release()

    def _stop(self, hand: bool, request: SetBool) -> Fields:
        self._stopped = request.data
        self._all_stopped = self._stopped and (hand or self._all_stopped)
        self._hold_or_release(again=True)
        held = [topic for topic, ticker in self.tickers.items() if ticker.filter.stopped]
        message = (
            f"standing still until released: {' and '.join(held)}"
            if held
            else "released; the next velocity command counts again"
        )
        return {"success": True, "message": message}

    def _hold_or_release(self, *, again: bool = False) -> None:
        """Bring both filters to what holds now.

        Args:
            again: Whether a filter that is held already publishes one more zero.
        """
        for topic, ticker in self.tickers.items():
            passes = topic == BY_HAND and self._overridden and not self._all_stopped
            if not self._stopped or passes:
                ticker.release()
            elif again or not ticker.filter.stopped:
                ticker.hard_stop()
