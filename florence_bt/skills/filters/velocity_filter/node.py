"""The node ``velocity_filter``: :class:`VelocityLimiting` on ROS."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.filters.velocity_filter.limiting import VelocityLimiting
from florence_bt.skills.filters.velocity_filter.velocity_filter import VelocityFilterParameters


class VelocityFilterNode(FlorenceNode):
    """Limits the acceleration; the service ``~/hard_stop`` (true: stop, false: release) beats every program.

    Attributes:
        limiting: What does it.
    """

    parameter_classes = (VelocityFilterParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("velocity_filter", parameters=parameters, namespace=namespace)
        self.limiting = VelocityLimiting(RosPorts(self), self.read_parameters(VelocityFilterParameters))

    def close(self) -> None:
        """Publish a last zero."""
        self.limiting.close()
        super().close()

    def on_failure(self, reason: str) -> None:
        """Stop at once."""
        self.limiting.fail()
