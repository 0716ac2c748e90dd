"""The node ``velocity_filter``: ``cmd_vel`` in, ``filtered_cmd_vel`` out (document, section 3.6.1).

``manual_cmd_vel``, by which a person drives during the manual override, has a filter of its own.
A hard stop holds both, but lets the hand pass as long as the override is on: what hangs is not the person.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from geometry_msgs.msg import Twist
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from florence_bt.ros.conversions import twist_from_ros, twist_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import COMMAND, LATCHED, RELIABLE
from florence_bt.ros.topics import MANUAL_OVERRIDE
from florence_bt.skills.filters.velocity_filter.velocity_filter import (
    VelocityFilterParameters,
    VelocityTicker,
)

BY_PROGRAMS, BY_HAND = "cmd_vel", "manual_cmd_vel"
"""The topics of commands."""


class VelocityFilterNode(FlorenceNode):
    """Limits the acceleration; the service ``~/hard_stop`` (true: stop, false: release) beats every program.

    Without the manual override it stops the commands by hand, too; ``~/stop_all`` always does. Each of them
    releases both.

    Attributes:
        tickers: One per topic of commands; each makes the steps of its filter on the node's clock.
    """

    parameter_classes = (VelocityFilterParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("velocity_filter", parameters=parameters, namespace=namespace)
        limits = self.read_parameters(VelocityFilterParameters)
        self.tickers = {topic: self._make_ticker(topic, limits) for topic in (BY_PROGRAMS, BY_HAND)}
        self._stopped = self._all_stopped = self._overridden = False
        self.create_subscription(Bool, MANUAL_OVERRIDE, self._on_override, LATCHED)
        self.create_service(SetBool, "~/hard_stop", partial(self._on_stop, False))
        self.create_service(SetBool, "~/stop_all", partial(self._on_stop, True))

    def close(self) -> None:
        """Publish a last zero."""
        for ticker in self.tickers.values():
            ticker.close()
        super().close()

    def on_failure(self, reason: str) -> None:
        """Stop at once; the next good command counts again."""
        for ticker in self.tickers.values():
            ticker.stop()

    def _make_ticker(self, topic: str, limits: VelocityFilterParameters) -> VelocityTicker:
        publisher = self.create_publisher(Twist, f"filtered_{topic}", RELIABLE)
        ticker = VelocityTicker(self.timebase, lambda twist: publisher.publish(twist_to_ros(twist)), limits)
        self.create_subscription(Twist, topic, partial(self._on_command, ticker), COMMAND)
        return ticker

    def _on_command(self, ticker: VelocityTicker, message: Twist) -> None:
        rejected = ticker.filter.rejected
        ticker.command(twist_from_ros(message))
        if ticker.filter.rejected != rejected:
            self.get_logger().warning(
                f"velocity command refused: its numbers are not finite ({rejected + 1} so far)",
                throttle_duration_sec=5.0,
            )

    def _on_override(self, message: Bool) -> None:
        self._overridden = bool(message.data)
        self._hold_or_release()

    def _on_stop(self, hand: bool, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._stopped = bool(request.data)
        self._all_stopped = self._stopped and (hand or self._all_stopped)
        self._hold_or_release(again=True)
        held = [topic for topic, ticker in self.tickers.items() if ticker.filter.stopped]
        response.success = True
        response.message = (
            f"standing still until released: {' and '.join(held)}"
            if held
            else "released; the next velocity command counts again"
        )
        return response

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
