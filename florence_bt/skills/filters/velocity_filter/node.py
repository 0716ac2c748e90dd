"""The node ``velocity_filter``: ``cmd_vel`` in, ``filtered_cmd_vel`` out (document, section 3.6.1).

``manual_cmd_vel``, by which a person drives during the manual override, has a filter of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from geometry_msgs.msg import Twist
from std_srvs.srv import SetBool

from florence_bt.ros.conversions import twist_from_ros, twist_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import COMMAND, RELIABLE
from florence_bt.skills.filters.velocity_filter.velocity_filter import (
    VelocityFilterParameters,
    VelocityTicker,
)


class VelocityFilterNode(FlorenceNode):
    """Limits the acceleration; the service ``~/hard_stop`` (true: stop, false: release) beats all.

    Attributes:
        tickers: One per topic of commands; each makes the steps of its filter on the node's clock.
    """

    parameter_classes = (VelocityFilterParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("velocity_filter", parameters=parameters, namespace=namespace)
        limits = self.read_parameters(VelocityFilterParameters)
        self.tickers = {topic: self._make_ticker(topic, limits) for topic in ("cmd_vel", "manual_cmd_vel")}
        self.create_service(SetBool, "~/hard_stop", self._on_hard_stop)

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

    def _on_hard_stop(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        for ticker in self.tickers.values():
            if request.data:
                ticker.hard_stop()
            else:
                ticker.release()
        response.success = True
        response.message = (
            "standing still until released"
            if request.data
            else "released; the next velocity command counts again"
        )
        return response
