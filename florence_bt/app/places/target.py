"""The hotspot file of a command: one that was named, or that of the running system."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from florence_bt.core.errors import ConfigError, DeviceTimeout, FlorenceError, raise_all
from florence_bt.core.geometry import Pose2
from florence_bt.skills.locator.hotspot_file import HotspotFile, read_hotspot, read_zone
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots, kind_of_new, load_hotspots, read_places

if TYPE_CHECKING:
    from florence_bt.app.runs.client import MissionClient
    from florence_bt.core.sensing import OccupancyGrid
    from florence_bt.core.zones import Zone

_MAP = "map"
_MAP_BUDGET_S = 10.0
"""Seconds in which the map, which is latched, has come. Chosen."""


class NoPose(FlorenceError):
    """The robot does not know where it is."""


class PlacesTarget:
    """A hotspot file, and the running system that uses it, if it is about that. A context manager.

    Args:
        hotspots: The file; None asks the running system for its own.

    Attributes:
        file: The file.
    """

    def __init__(self, hotspots: Path | None) -> None:
        self._given = hotspots
        self.file = hotspots or Path()
        self._client: MissionClient | None = None

    def __enter__(self) -> PlacesTarget:
        """Ask the running system for its file, unless one was given."""
        if self._given is None:
            self._client = _make_client()
            try:
                self.file = _file_of_system(self._client)
            except BaseException:
                self._client.close()
                raise
        return self

    def __exit__(self, *_: object) -> None:
        """Leave ROS."""
        if self._client is not None:
            self._client.close()

    def hotspots(self) -> Hotspots:
        """Read the file."""
        return load_hotspots(self.file)

    def change(
        self, edit: Callable[[HotspotFile], str], *, create: bool = False, stands: bool = False
    ) -> list[str]:
        """Change the file, and let the running system read it again.

        Args:
            edit: Makes the change and says what it was.
            create: Whether to make the file when there is none.
            stands: Whether the robot stands at the new place, whatever the map says.

        Returns:
            What was done, and what is wrong with the places now, for people.

        Raises:
            ConfigError: A place is new where the map of the running system has none for a robot.
        """
        changed = HotspotFile(self.file, create=create)
        before, zones_before = [spot.pose for spot in changed.hotspots], changed.hotspots.zones
        told = [f"{edit(changed)} in {self.file}"]
        new = [spot for spot in changed.hotspots if spot.pose not in before]
        zones = [zone for zone in changed.hotspots.zones if zone not in zones_before]
        told += self._against_the_map(new, zones, refuse=not stands)
        changed.save()
        from florence_bt.app.places.check import ERROR, place_findings

        findings = place_findings(read_places(self.file))
        told += [str(finding.as_error()) for finding in findings if finding.severity == ERROR]
        if self._client is not None:
            answer = self._client.reload_places()
            told.append(f"the running system uses it: {answer.message}" if answer.success else answer.message)
        return told

    def _against_the_map(self, spots: list[Hotspot], zones: list[Zone], *, refuse: bool) -> list[str]:
        """Hold new places against the map of the running system, if it has one; return what is to be told."""
        if not (spots or zones) or self._client is None or not self._client.node.count_publishers(_MAP):
            return []
        from florence_bt.app.mission_files.map_places import HALF_WIDTH_M

        told = []
        try:
            grid = self.published_map()
        except DeviceTimeout as error:
            return [f"not held against the map: {error}"]
        assert grid is not None, "there is a client"
        wrong = []
        for spot in spots:
            problem = grid.problem_with_standing(spot.pose.x, spot.pose.y)
            if problem is not None and refuse:
                where = f"({spot.pose.x:g} m, {spot.pose.y:g} m) is {problem}: {spot.label} stays as it was"
                valid = ["a place where the robot can stand", "florence hotspot here"]
                wrong.append(ConfigError(where, valid=valid))
        for zone in zones:
            if not grid.overlaps(zone.polygon):
                valid = ["corners in metres in the frame of the map"]
                wrong.append(ConfigError(f"no part of the zone {zone.label} is on the map", valid=valid))
        raise_all(wrong)
        for spot in spots:
            problem = grid.problem_with_standing(spot.pose.x, spot.pose.y, HALF_WIDTH_M)
            if problem is not None:
                told.append(f"{spot.label} is {problem}: drives there may fail")
        return told

    def robot_pose(self) -> Pose2:
        """Ask the running system where the robot is.

        Raises:
            NoPose: It does not know.
        """
        with self._system() as client:
            pose = client.robot_pose()
        if pose is None:
            raise NoPose("the robot does not know where it is; florence where says more")
        return pose

    def published_map(self) -> OccupancyGrid | None:
        """Return the map of the running system; None when the command is about a file."""
        if self._client is None:
            return None
        from florence_bt.app.maps.save import wait_for_map

        return wait_for_map(self._client, _MAP, _MAP_BUDGET_S)

    def _system(self) -> AbstractContextManager[MissionClient]:
        return _make_client() if self._client is None else nullcontext(self._client)


def _make_client() -> MissionClient:
    from florence_bt.app.runs.client import MissionClient

    return MissionClient("florence_hotspot")


def _file_of_system(client: MissionClient) -> Path:
    from rcl_interfaces.srv import GetParameters

    from florence_bt.app.runs.client import LOCATOR, SystemNotThere

    question: Any = GetParameters.Request(names=["hotspots_file"])
    try:
        answer = client.call(GetParameters, f"{LOCATOR}/get_parameters", question, repeat=True)
    except SystemNotThere as error:
        raise SystemNotThere(
            "no system runs whose hotspots these could be; --hotspots FILE names a file, "
            "florence up --sim brings a system up"
        ) from error
    file = Path(answer.values[0].string_value) if answer.values else Path()
    if not file.is_file():
        where = f"its file {str(file)!r} is not on this machine" if file != Path() else "it has no file"
        raise ConfigError(f"the hotspots of the running system: {where}", valid=["--hotspots FILE"])
    return file


def add_hotspot(file: HotspotFile, label: str, values: Mapping[str, str]) -> str:
    """Add a hotspot whose values are given as texts; say what was done, as all edits here."""
    wrong = []
    if file.hotspots.get(label) is not None:
        wrong.append(ConfigError(f"there is a hotspot {label!r} already", valid=["florence hotspot move"]))
    try:
        hotspot = read_hotspot(label, {"kind": kind_of_new(label)} | dict(values))
    except ConfigError as error:
        wrong.append(error)
    raise_all(wrong)
    file.put(hotspot, values)
    return f"the {hotspot.kind} {label} added"


def move_hotspot(file: HotspotFile, label: str, values: Mapping[str, str]) -> str:
    """Change some values of a hotspot, given as texts."""
    known = file.hotspots.get(label)
    if known is None:
        raise ConfigError(file.hotspots.unknown(label))
    file.put(read_hotspot(label, values, known), values)
    return f"{label} moved"


def put_here(file: HotspotFile, label: str, pose: Pose2, values: Mapping[str, str]) -> str:
    """Move a hotspot to a pose, or add one there."""
    here = {
        "x": f"{pose.x:.3f}",
        "y": f"{pose.y:.3f}",
        "yaw": f"{math.degrees(math.remainder(pose.yaw, math.tau)):.1f} deg",
    } | dict(values)
    known = file.hotspots.get(label)
    kind = {} if known else {"kind": kind_of_new(label)}
    hotspot = read_hotspot(label, kind | here, known)
    file.put(hotspot, here)
    place = f"({here['x']} m, {here['y']} m), {here['yaw']}"
    return f"the {hotspot.kind} {label} {'moved to' if known else 'added at'} {place}"


def rename_hotspot(file: HotspotFile, old: str, new: str) -> str:
    """Give a hotspot another label."""
    file.rename(old, new)
    return f"{old} is called {new}"


def remove_hotspot(file: HotspotFile, label: str) -> str:
    """Remove a hotspot."""
    file.remove(label)
    return f"{label} removed"


def add_zone(file: HotspotFile, label: str, values: Mapping[str, str]) -> str:
    """Add a zone, or replace the one with its label."""
    file.put_zone(read_zone(label, values))
    return f"the zone {label} added"


def remove_zone(file: HotspotFile, label: str) -> str:
    """Remove a zone."""
    file.remove_zone(label)
    return f"the zone {label} removed"
