"""The node ``velocity_filter``: ``cmd_vel`` in, ``filtered_cmd_vel`` out (document, section 3.6.1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from geometry_msgs.msg import Twist
from std_srvs.srv import SetBool

from florence_bt.core.geometry import Twist2
from florence_bt.ros.conversions import twist_from_ros, twist_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE
from florence_bt.skills.filter_velocity.ticker import VelocityTicker
from florence_bt.skills.filter_velocity.velocity_filter import VelocityFilterParameters


class VelocityFilterNode(FlorenceNode):
    """Limits the acceleration; the service ``~/hard_stop`` (true: stop, false: release) beats all.

    Attributes:
        ticker: Makes the steps on the node's clock.
    """

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("velocity_filter", parameters=parameters, namespace=namespace)
        self._publisher = self.create_publisher(Twist, "filtered_cmd_vel", RELIABLE)
        self.ticker = VelocityTicker(
            self.timebase, self._publish, self.read_parameters(VelocityFilterParameters)
        )
        self.create_subscription(Twist, "cmd_vel", self._on_command, RELIABLE)
        self.create_service(SetBool, "~/hard_stop", self._on_hard_stop)

    def close(self) -> None:
        """Publish a last zero."""
        self.ticker.close()
        super().close()

    def on_failure(self, reason: str) -> None:
        """Stop at once; the next good command counts again."""
        self.ticker.stop()

    def _on_command(self, message: Twist) -> None:
        rejected = self.ticker.filter.rejected
        self.ticker.command(twist_from_ros(message))
        if self.ticker.filter.rejected != rejected:
            self.get_logger().warning(
                f"velocity command refused: its numbers are not finite ({rejected + 1} so far)",
                throttle_duration_sec=5.0,
            )

    def _on_hard_stop(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if request.data:
            self.ticker.hard_stop()
            response.message = "standing still until released"
        else:
            self.ticker.release()
            response.message = "released; the next velocity command counts again"
        response.success = True
        return response

    def _publish(self, twist: Twist2) -> None:
        self._publisher.publish(twist_to_ros(twist))
