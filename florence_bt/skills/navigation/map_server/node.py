"""The node ``map_server``: the latched topic ``map`` and the service ``static_map``.

Source: document, section 3.3.1; REFERENCE 7.8.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.srv import GetMap

from florence_bt.core.errors import ConfigError
from florence_bt.ros.conversions import grid_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED
from florence_bt.skills.navigation.map_server.map_file import load_map


@dataclass(frozen=True, slots=True)
class MapServerParameters:
    """Which map to give out.

    Attributes:
        map_file: The YAML file of the map.
        frame_id: The frame of the map.
    """

    map_file: str
    frame_id: str = "map"

    def __post_init__(self) -> None:
        """Refuse an empty name.

        Raises:
            ConfigError: There is none.
        """
        if not self.map_file:
            raise ConfigError("map_file is empty", valid=["map_file: maps/flat.yaml"])


class MapServerNode(FlorenceNode):
    """Loads one map and serves it."""

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("map_server", parameters=parameters, namespace=namespace)
        wanted = self.read_parameters(MapServerParameters)
        grid = load_map(wanted.map_file)
        self._message = grid_to_ros(grid, wanted.frame_id, self.timebase.now())
        self._publisher = self.create_publisher(OccupancyGridMsg, "map", LATCHED)
        self._publisher.publish(self._message)
        self.create_service(GetMap, "static_map", self._get_map)

    def _get_map(self, _: GetMap.Request, response: GetMap.Response) -> GetMap.Response:
        response.map = self._message
        return response
