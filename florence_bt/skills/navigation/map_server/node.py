"""The node ``map_server``: the latched topic ``map``, its services, and the saver of maps.

Source: document, section 3.3.1; REFERENCE 7.8, 7.9.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nav2_msgs.srv import LoadMap, SaveMap
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.srv import GetMap

from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.ros.answers import Deferred
from florence_bt.ros.conversions import grid_from_ros, grid_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED
from florence_bt.skills.navigation.map_server.map_file import load_map, read_cells, read_description
from florence_bt.skills.navigation.map_server.map_writer import FREE_THRESH, OCCUPIED_THRESH, save_map

MAP = "map"
_MAP_TYPE = "nav_msgs/msg/OccupancyGrid"


@dataclass(frozen=True, slots=True)
class MapServerParameters:
    """Which map to publish.

    Attributes:
        map_file: The YAML file of the map.
        frame_id: The frame of the map.
        save_map_timeout: How long the saver waits for a map on another topic, seconds.
    """

    map_file: str
    frame_id: str = "map"
    save_map_timeout: float = 2.0

    def __post_init__(self) -> None:
        """Refuse an empty name.

        Raises:
            ConfigError: There is none.
        """
        if not self.map_file:
            raise ConfigError("map_file is empty", valid=["map_file: maps/flat.yaml"])


def file_of_url(url: str) -> Path:
    """The file that a ``map_url`` names.

    Raises:
        ConfigError: It is no absolute path: the client does not know in which folder this process runs.
    """
    path = Path(url.removeprefix("file://"))
    if not path.is_absolute() or "\0" in url:
        raise ConfigError(
            f"{url!r} is not the absolute path of a map", valid=["file:///home/me/maps/flat.yaml"]
        )
    return path


class MapServerNode(FlorenceNode):
    """Serves one map at a time, and saves maps.

    Attributes:
        grid: The published map.
    """

    parameter_classes = (MapServerParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("map_server", parameters=parameters, namespace=namespace)
        self._p = self.read_parameters(MapServerParameters)
        self._publisher = self.create_publisher(OccupancyGridMsg, MAP, LATCHED)
        self._publish_map(load_map(self._p.map_file))
        for name in ("static_map", "~/map"):
            self.create_service(GetMap, name, self._get_map)
        self.create_service(LoadMap, "~/load_map", self._load_map)
        self.create_service(SaveMap, "map_saver/save_map", self._save_map)

    def _publish_map(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self._message = grid_to_ros(grid, self._p.frame_id, self.timebase.now())
        self._publisher.publish(self._message)

    def _get_map(self, _: GetMap.Request, response: GetMap.Response) -> GetMap.Response:
        response.map = self._message
        return response

    def _load_map(self, request: LoadMap.Request, response: LoadMap.Response) -> LoadMap.Response:
        response.result = LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST
        try:
            path = file_of_url(request.map_url)
            if path.is_file():
                response.result = LoadMap.Response.RESULT_INVALID_MAP_METADATA
            description = read_description(path)
            response.result = LoadMap.Response.RESULT_INVALID_MAP_DATA
            self._publish_map(read_cells(description))
        except FlorenceError as error:
            self.get_logger().warning(f"the map stays as it was: {error}")
            return response
        response.result, response.map = LoadMap.Response.RESULT_SUCCESS, self._message
        return response

    def _save_map(self, request: SaveMap.Request, response: SaveMap.Response) -> SaveMap.Response | Deferred:
        name = request.map_topic or MAP
        topic = name if name.startswith("/") else f"{self.get_namespace().rstrip('/')}/{name}"
        if topic == self._publisher.topic_name:
            return self._save(self.grid, request, response)
        if _MAP_TYPE not in dict(self.get_topic_names_and_types()).get(topic, ()):
            self.get_logger().warning(f"map not saved: nobody publishes maps on {request.map_topic!r}")
            return response
        later = Deferred()

        def stop_listening() -> None:
            self.destroy_subscription(subscription)

        def end(grid: OccupancyGrid | None) -> None:
            timer.cancel()
            self.call_soon(stop_listening)
            if grid is None:
                self.get_logger().warning(f"map not saved: none came on {topic}")
                later.answer(response)
            else:
                later.answer(self._save(grid, request, response))

        timer = self.steady.call_at(self.steady.now() + self._p.save_map_timeout, lambda: end(None))
        subscription = self.create_subscription(
            OccupancyGridMsg, topic, lambda message: end(grid_from_ros(message)), LATCHED
        )
        return later

    def _save(
        self, grid: OccupancyGrid, request: SaveMap.Request, response: SaveMap.Response
    ) -> SaveMap.Response:
        given = bool(request.free_thresh or request.occupied_thresh)
        try:
            written = save_map(
                grid,
                file_of_url(request.map_url),
                mode=request.map_mode or "trinary",
                form=request.image_format or "pgm",
                occupied_thresh=round(request.occupied_thresh, 6) if given else OCCUPIED_THRESH,
                free_thresh=round(request.free_thresh, 6) if given else FREE_THRESH,
            )
        except FlorenceError as error:
            self.get_logger().warning(f"map not saved: {error}")
            return response
        self.get_logger().info(f"map saved: {written}")
        response.result = True
        return response
