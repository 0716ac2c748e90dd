"""Watches a map while the running system makes it, and writes what came out."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from geometry_msgs.msg import PoseWithCovarianceStamped
from rich.console import Console

from florence_bt.app.maps.picture import draw_drive
from florence_bt.app.maps.proposal import proposed_hotspots, rooms_text
from florence_bt.app.maps.save import wait_for_map
from florence_bt.app.runs.client import MissionClient
from florence_bt.core.diagnosis import Diagnosis
from florence_bt.core.errors import DeviceTimeout
from florence_bt.core.geometry import Pose2
from florence_bt.core.heard import Freshness, Heard, age_text
from florence_bt.core.text_files import refuse_existing
from florence_bt.core.topic_names import AMCL_POSE, AREA_M2, LOOPS, MAP, PLACE_STATUS, WAY_M
from florence_bt.ros.conversions import pose_from_ros
from florence_bt.ros.qos import LATCHED
from florence_bt.skills.navigation.map_server.map_writer import save_map

MAPPING = "mapping"
"""The node that tells how far the map is."""
_WAIT_S = 10.0
_STEP_M = 0.1
"""From one pose of the way in the picture to the next."""
_LINE_EVERY_S = 5.0
"""Time between two lines when the output is no terminal."""


@dataclass(frozen=True, slots=True)
class MapFiles:
    """The files of a map that was made on a running system.

    Attributes:
        description: The YAML file of the map.
        picture: The map with the way of the robot.
        hotspots: The rooms that are proposed.
    """

    description: Path
    picture: Path
    hotspots: Path

    @staticmethod
    def beside(out: Path) -> MapFiles:
        """Return the files of a map from the name of one."""
        target = out if out.suffix else out.with_suffix(".yaml")
        return MapFiles(target, target.with_suffix(".drive.png"), target.with_suffix(".hotspots.yaml"))

    def check(self, *, overwrite: bool) -> None:
        """Refuse files that are there already, unless they may be replaced.

        Raises:
            ConfigError: There is one.
        """
        refuse_existing(self.description, self.picture, self.hotspots, overwrite=overwrite)


class MapWatch:
    """A listener to a running system that makes a map: shows how far it is.

    Args:
        client: Serves the subscriptions.
        console: Where the progress is shown: one line that changes in a terminal, else a line now and then.
    """

    def __init__(self, client: MissionClient, console: Console) -> None:
        self._client, self._console = client, console
        self._way: list[Pose2] = []
        self._told = -_LINE_EVERY_S
        client.robot.listen_to_diagnostics()
        client.node.create_subscription(PoseWithCovarianceStamped, AMCL_POSE, self._on_pose, LATCHED)

    def wait(self) -> None:
        """Wait until the system tells of a map that it makes.

        Raises:
            DeviceTimeout: It does not make one.
        """
        patience_s = self._client.patience(_WAIT_S)
        if not self._client.spin_until(lambda: self._progress() is not None, patience_s):
            raise DeviceTimeout(
                "no system that makes a map was found (would have worked: florence up --sim --mapping, or "
                "florence up --robot CONFIG --mapping)"
            )

    @property
    def text(self) -> str:
        """Say how far the map is, for people."""
        heard = self._progress()
        if heard is None or heard.last is None:
            return "waiting for the map"
        silent = f" ({age_text(heard.age)} ago)" if heard.freshness is Freshness.OLD else ""
        values = heard.last.values
        if not values or not self._way:
            return f"{heard.last.message}{silent}"
        here = self._way[-1]
        return (
            f"{values[AREA_M2]} m² of floor seen, {values[WAY_M]} m driven, "
            f"{values[LOOPS]} places recognised; the robot is at ({here.x:.1f} m, {here.y:.1f} m){silent}"
        )

    def show_until(self, done: Callable[[], bool], watch: Callable[[], None] = lambda: None) -> None:
        """Show the progress until a condition holds.

        Raises:
            KeyboardInterrupt: Ctrl-C was pressed.
        """
        status = self._console.status(self.text) if self._console.is_terminal else None

        def look() -> None:
            self._say_line() if status is None else status.update(self.text)
            watch()

        with status or nullcontext():
            self._client.spin_until(done, math.inf, watch=look)

    def write(self, files: MapFiles) -> None:
        """Write the map as it is now, its picture, and the rooms that are proposed; tell what came out.

        Raises:
            ConfigError: It cannot be written.
            DeviceTimeout: No map came.
        """
        grid = wait_for_map(self._client, MAP, _WAIT_S)
        rows, columns = grid.cells.shape
        rooms = proposed_hotspots(grid)
        picture = draw_drive(grid, self._way or [Pose2()], ())
        proposal = rooms_text(rooms).encode()
        save_map(grid, files.description, others={files.picture: picture, files.hotspots: proposal})
        size = f"{columns * grid.resolution:.1f} x {rows * grid.resolution:.1f} m"
        print(f"{files.description}: {size} in cells of {grid.resolution:g} m")
        print(f"{files.picture}: a picture of it and of the way")
        print(
            f"{files.hotspots}: {len(rooms)} rooms are proposed; florence hotspot name gives them their names"
        )

    def _say_line(self) -> None:
        if time.monotonic() - self._told >= _LINE_EVERY_S:
            self._told = time.monotonic()
            self._console.out(self.text)

    def _progress(self) -> Heard[Diagnosis] | None:
        return self._client.robot.diagnosis(MAPPING, PLACE_STATUS)

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        pose = pose_from_ros(message.pose.pose)
        if not self._way or self._way[-1].distance_to(pose) >= _STEP_M:
            self._way.append(pose)
