"""``florence map save``: the map that is published now, to files."""

from __future__ import annotations

from pathlib import Path

from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg

from florence_bt.app.runs.client import MissionClient
from florence_bt.core.errors import DeviceTimeout
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.text_files import refuse_existing
from florence_bt.ros.conversions import grid_from_ros
from florence_bt.ros.qos import LATCHED
from florence_bt.skills.navigation.map_server.map_writer import save_map


def save_published_map(
    path: Path, *, topic: str, mode: str, form: str, overwrite: bool, patience_s: float
) -> tuple[Path, OccupancyGrid]:
    """Wait for a map and write it.

    Args:
        path: The YAML file.
        topic: Where the map is published.
        mode: As :func:`save_map`.
        form: As :func:`save_map`.
        overwrite: Whether a file of this name may be replaced.
        patience_s: Seconds to wait for the map.

    Returns:
        The file that was written, and the map.

    Raises:
        ConfigError: As :func:`save_map`, or there is such a file.
        DeviceTimeout: No map came.
    """
    target = path if path.suffix else path.with_suffix(".yaml")
    refuse_existing(target, target.with_suffix(f".{form}"), overwrite=overwrite)
    with MissionClient("florence_map") as client:
        grid = wait_for_map(client, topic, patience_s)
    return save_map(grid, target, mode=mode, form=form), grid


def wait_for_map(client: MissionClient, topic: str, patience_s: float) -> OccupancyGrid:
    """Wait for a map that is published.

    Args:
        client: Serves the subscription.
        topic: Where the map is published.
        patience_s: Seconds to wait for it.

    Raises:
        DeviceTimeout: No map came.
    """
    maps: list[OccupancyGrid] = []
    client.node.create_subscription(
        OccupancyGridMsg, topic, lambda message: maps.append(grid_from_ros(message)), LATCHED
    )
    if not client.spin_until(lambda: bool(maps), patience_s):
        raise DeviceTimeout(
            f"no map came on the topic {topic!r} within {patience_s:g} s; is the system up? "
            "florence up brings it up, --topic names another topic"
        )
    return maps[-1]
