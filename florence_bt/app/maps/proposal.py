"""The rooms that a map seems to have, as a file of hotspots that wait for their names."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from florence_bt.app.mission_files.output import write_output
from florence_bt.core.geometry import Pose2
from florence_bt.core.polygons import area
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.locator.hotspot_file import HotspotFile
from florence_bt.skills.locator.hotspots import Hotspot
from florence_bt.skills.navigation.mapping.rooms import propose_rooms

_HEAD = "# Rooms that the map seems to have; florence hotspot name gives them their names.\n"
_PROPOSED = re.compile(r"room_\d+")


def proposed_hotspots(grid: OccupancyGrid) -> list[Hotspot]:
    """Return a hotspot for each room that a map seems to have: ``room_1`` is the largest.

    Places are to a centimetre, angles to a degree.
    """
    return [
        Hotspot(
            f"room_{number}",
            Pose2(
                round(room.pose.x, 2), round(room.pose.y, 2), math.radians(round(math.degrees(room.pose.yaw)))
            ),
            polygon=tuple((round(x, 2) + 0.0, round(y, 2) + 0.0) for x, y in room.polygon),
        )
        for number, room in enumerate(propose_rooms(grid), 1)
    ]


def write_proposal(grid: OccupancyGrid, file: Path) -> int:
    """Write the rooms that are proposed as a hotspot file; return how many.

    Raises:
        ConfigError: The file cannot be written.
    """
    hotspots = proposed_hotspots(grid)
    write_output(file, rooms_text(hotspots), make_folder=True)
    return len(hotspots)


def rooms_text(hotspots: Iterable[Hotspot]) -> str:
    """Return the text of a hotspot file with rooms."""
    lines = "".join(map(_line, hotspots))
    return _HEAD + (f"hotspots:\n{lines}" if lines else "hotspots: []\n")


def _line(spot: Hotspot) -> str:
    corners = ", ".join(f"[{x:g}, {y:g}]" for x, y in spot.polygon)
    place = f"x: {spot.pose.x:g}, y: {spot.pose.y:g}, yaw: {math.degrees(spot.pose.yaw):.0f} deg"
    return f"  - {{label: {spot.label}, {place}, kind: room, polygon: [{corners}]}}\n"


def name_rooms(names: Mapping[str, str]) -> Callable[[HotspotFile], str]:
    """Return the edit that gives hotspots their names.

    Args:
        names: Label of now -> the new one.
    """

    def edit(file: HotspotFile) -> str:
        for old, new in names.items():
            file.rename(old, new)
        return "; ".join(f"{old} is called {new}" for old, new in names.items())

    return edit


def ask_names(rooms: Iterable[Hotspot], taken: Iterable[str], ask: Callable[[str], str]) -> dict[str, str]:
    """Ask for the names of rooms that have none but their number.

    Args:
        rooms: The rooms.
        taken: Labels that are no names for them.
        ask: Asks a question, and gives the answer; empty keeps the number.

    Returns:
        Label of now -> the new one.
    """
    names: dict[str, str] = {}
    known = set(taken)
    for room in rooms:
        if not _PROPOSED.fullmatch(room.label):
            continue
        size = f"{area(room.polygon):.1f} m², " if room.polygon else ""
        question = f"{room.label} ({size}x {room.pose.x:.1f} m, y {room.pose.y:.1f} m)"
        name = ask(question).strip()
        while name in known - {room.label}:
            name = ask(f"there is a {name} already; {question}").strip()
        if name and name != room.label:
            names[room.label] = name
            known.add(name)
    return names
