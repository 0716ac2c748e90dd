"""The node ``map_server``: the latched topic ``map``, its services, and the saver of maps.

Source: document, section 3.3.1; REFERENCE 7.8, 7.9.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from nav2_msgs.srv import LoadMap, SaveMap
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.srv import GetMap

from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.ros.answers import Deferred
from florence_bt.ros.conversions import grid_from_ros, grid_to_ros
from florence_bt.ros.node import FlorenceNode, failed
from florence_bt.ros.qos import LATCHED
from florence_bt.skills.navigation.map_server.map_file import load_map, read_cells, read_description
from florence_bt.skills.navigation.map_server.map_writer import FREE_THRESH, OCCUPIED_THRESH, save_map

MAP = "map"
_MAP_TYPE = "nav_msgs/msg/OccupancyGrid"
SHOWN_OF_PATH = 200
"""Characters of a path that a message repeats."""


@dataclass(frozen=True, slots=True)
class MapServerParameters:
    """The map to publish, and where to save maps.

    Attributes:
        map_file: The YAML file of the map.
        frame_id: The frame of the map.
        save_map_timeout: How long the saver waits for a map on another topic, seconds.
        save_folder: The folder below which the saver writes; empty: it saves nothing.
    """

    map_file: str
    frame_id: str = "map"
    save_map_timeout: float = 2.0
    save_folder: str = ""

    def __post_init__(self) -> None:
        """Refuse an empty name.

        Raises:
            ConfigError: There is none.
        """
        if not self.map_file:
            raise ConfigError("map_file is empty", valid=["map_file: maps/flat.yaml"])


def file_of_url(url: str) -> Path:
    """Return the file that a ``map_url`` names.

    Raises:
        ConfigError: It is no absolute path: the client does not know in which folder this process runs.
    """
    path = Path(url.removeprefix("file://"))
    if not path.is_absolute() or "\0" in url:
        raise ConfigError(
            f"{url[:SHOWN_OF_PATH]!r} is not the absolute path of a map",
            valid=["file:///home/me/maps/flat.yaml"],
        )
    return path


def file_to_save(url: str, folder: str) -> Path:
    """Return the file that a ``map_url`` of the saver names: below a folder, also through links.

    Args:
        url: An absolute path, or one that starts from the folder.
        folder: The folder of saved maps; empty when there is none.

    Raises:
        ConfigError: It lies elsewhere, or there is no folder.
    """
    if not folder:
        raise ConfigError(
            "no folder is configured for saved maps", valid=["map_server: {save_folder: /home/me/maps}"]
        )
    inside = Path(folder).resolve()
    path = inside / url.removeprefix("file://")
    try:
        where = path.parent.resolve()
    except (OSError, RuntimeError, ValueError) as error:
        raise ConfigError(f"{url[:SHOWN_OF_PATH]!r} is no path", valid=[str(inside / "flat.yaml")]) from error
    if not path.name or not where.is_relative_to(inside):
        raise ConfigError(
            f"{url[:SHOWN_OF_PATH]!r} is not below the folder of saved maps",
            valid=[str(inside / "flat.yaml")],
        )
    return where / path.name


class MapServerNode(FlorenceNode):
    """Serves one map at a time, and saves maps.

    Files are read and written on a thread of their own, one request at a time: a slow disk or a large map
    must not hold up the other nodes of the process, which drive the robot.

    Attributes:
        grid: The published map.
    """

    parameter_classes = (MapServerParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("map_server", parameters=parameters, namespace=namespace)
        self._p = self.read_parameters(MapServerParameters)
        self._publisher = self.create_publisher(OccupancyGridMsg, MAP, LATCHED)
        self._busy = False
        self._publish_map(load_map(self._p.map_file, self._warn))
        for name in ("static_map", "~/map"):
            self.create_service(GetMap, name, self._get_map)
        self.create_service(LoadMap, "~/load_map", self._load_map)
        self.create_service(SaveMap, "map_saver/save_map", self._save_map)

    def _publish_map(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self._message = grid_to_ros(grid, self._p.frame_id, self.stamp())
        self._publisher.publish(self._message)

    def _get_map(self, _: GetMap.Request, response: GetMap.Response) -> GetMap.Response:
        response.map = self._message
        return response

    def _load_map(self, request: LoadMap.Request, response: LoadMap.Response) -> LoadMap.Response | Deferred:
        response.result = LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST

        def read() -> OccupancyGrid:
            path = file_of_url(request.map_url)
            if os.path.isfile(path):  # False also for a name that is too long
                response.result = LoadMap.Response.RESULT_INVALID_MAP_METADATA
            description = read_description(path)
            response.result = LoadMap.Response.RESULT_INVALID_MAP_DATA
            return read_cells(description, lambda sentence: self.call_soon(partial(self._warn, sentence)))

        def publish(grid: OccupancyGrid) -> LoadMap.Response:
            self.before_long_work()
            self._publish_map(grid)
            response.result, response.map = LoadMap.Response.RESULT_SUCCESS, self._message
            return response

        return self._in_background(read, publish, response, "the map stays as it was")

    def _in_background(
        self, work: Callable[[], Any], answer: Callable[[Any], Any], refusal: Any, what_then: str
    ) -> Any:
        """Do something slow off the executor's thread, and answer when it is done.

        Args:
            work: What is slow.
            answer: Makes the answer of what it gave, on the executor's thread.
            refusal: The answer when it raised a FlorenceError, or when other work goes on.
            what_then: What a refusal means, for people.
        """
        if self._busy:
            self._warn(f"{what_then}: another map is being read or written")
            return refusal
        self._busy = True
        later = Deferred()

        def end(outcome: Any) -> None:
            self._busy = False
            try:
                if isinstance(outcome, FlorenceError):
                    self._warn(f"{what_then}: {outcome}")
                elif isinstance(outcome, Exception):
                    raise outcome
                later.answer(refusal if isinstance(outcome, Exception) else answer(outcome))
            except Exception as error:
                later.answer(failed(type(refusal), f"the node {self.get_name()} failed: {error!r}"))
                raise

        def run() -> None:
            try:
                outcome = work()
            except Exception as error:
                outcome = error
            self.call_soon(partial(end, outcome))

        threading.Thread(target=run, name="map files", daemon=True).start()
        return later

    def _warn(self, sentence: str) -> None:
        self.get_logger().warning(sentence)

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
                saved = self._save(grid, request, response)
                if isinstance(saved, Deferred):
                    saved.send_with(later.answer)
                else:
                    later.answer(saved)

        timer = self.steady.call_at(self.steady.now() + self._p.save_map_timeout, lambda: end(None))
        subscription = self.create_subscription(
            OccupancyGridMsg, topic, lambda message: end(grid_from_ros(message)), LATCHED
        )
        return later

    def _save(self, grid: OccupancyGrid, request: SaveMap.Request, response: SaveMap.Response) -> Any:
        given = bool(request.free_thresh or request.occupied_thresh)

        def write() -> Path:
            return save_map(
                grid,
                file_to_save(request.map_url, self._p.save_folder),
                mode=request.map_mode or "trinary",
                form=request.image_format or "pgm",
                occupied_thresh=round(request.occupied_thresh, 6) if given else OCCUPIED_THRESH,
                free_thresh=round(request.free_thresh, 6) if given else FREE_THRESH,
            )

        def answer(written: Path) -> SaveMap.Response:
            self.get_logger().info(f"map saved: {written}")
            response.result = True
            return response

        return self._in_background(write, answer, response, "map not saved")
