"""The node ``mapping``: :class:`MapMaking` on ROS.

It takes the place of ``map_server`` and ``localiser``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from florence_bt.core.topics import MAP
from florence_bt.ros.conversions import grid_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.navigation.mapping.growing_map import GrowingMapParameters, MapMaker
from florence_bt.skills.navigation.mapping.map_making import MapMaking, MapMakingParameters
from florence_bt.skills.navigation.mapping.parameters import SlamParameters


class MappingNode(FlorenceNode):
    """Makes the map while the robot drives, and tells where it is in it.

    Args:
        make: Makes what makes the map; by default :class:`Slam`.
        parameters: Overrides of the node's parameters.

    Raises:
        ConfigError: The extra ``mapping`` is not installed, or the drive to go on with cannot be read.
    """

    parameter_classes = (SlamParameters, GrowingMapParameters, MapMakingParameters)

    def __init__(
        self,
        make: Callable[[SlamParameters], MapMaker] | None = None,
        *,
        parameters: Mapping[str, Any] | None = None,
        namespace: str = "",
    ) -> None:
        super().__init__("mapping", parameters=parameters, namespace=namespace)
        slam = self.read_parameters(SlamParameters)
        own = self.read_parameters(MapMakingParameters)
        making = MapMaking(
            RosPorts(self, {MAP: lambda grid: grid_to_ros(grid, own.map_frame, self.stamp())}),
            (make or _slam)(slam),
            self.read_parameters(GrowingMapParameters),
            own,
        )
        self.on_close(making.close)


def _slam(parameters: SlamParameters) -> MapMaker:
    from florence_bt.skills.navigation.mapping.slam import Slam  # loads scipy

    return Slam(parameters)
