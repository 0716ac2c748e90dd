"""The rooms that a map seems to have, as a file of hotspots that wait for their names."""

from __future__ import annotations

from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.text_files import replace_text
from florence_bt.skills.locator.hotspots import Hotspot
from florence_bt.skills.navigation.mapping.rooms import propose_rooms

_HEAD = "# Rooms that the map seems to have. florence hotspot name gives them their names.\n"


def proposed_hotspots(grid: OccupancyGrid) -> list[Hotspot]:
    """Return a hotspot for each room that a map seems to have: ``room 1`` is the largest."""
    rooms = propose_rooms(grid)
    return [
        Hotspot(f"room {number}", room.pose, polygon=room.polygon) for number, room in enumerate(rooms, 1)
    ]


def write_proposal(grid: OccupancyGrid, file: Path) -> int:
    """Write the rooms that are proposed; return how many.

    Raises:
        ConfigError: The file cannot be written.
    """
    hotspots = proposed_hotspots(grid)
    lines = [_line(each) for each in hotspots]
    text = _HEAD + ("hotspots:\n" + "".join(lines) if lines else "hotspots: []\n")
    try:
        replace_text(file, text)
    except OSError as error:
        raise ConfigError(f"it cannot be written: {error.strerror}", file=file) from error
    return len(hotspots)


def _line(hotspot: Hotspot) -> str:
    pose = hotspot.pose
    corners = ", ".join(f"[{x:.2f}, {y:.2f}]" for x, y in hotspot.polygon)
    place = f"x: {pose.x:.2f}, y: {pose.y:.2f}, phi: {pose.yaw:.3f}"
    return f"  - {{label: {hotspot.label}, {place}, kind: room, polygon: [{corners}]}}\n"
