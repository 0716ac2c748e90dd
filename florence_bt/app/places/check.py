"""``florence hotspot check``: everything that is wrong with a hotspot file, at once."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position, YamlScalar, YamlSequence
from florence_bt.core.polygons import area, common_area, contains, crossing_edges, distance_to
from florence_bt.core.zones import KEEP_OUT
from florence_bt.skills.locator.hotspots import Hotspot, Places, read_places
from florence_bt.trees.checks.report import FORMATS, Excerpts, summary
from florence_bt.trees.language.findings import ERROR, WARNING, Finding, finding_from_error, has_errors

ProblemAt = Callable[[float, float], str | None]
"""Says what is wrong with a place (x, y in metres, map frame), None when nothing is."""

_LEAST_AREA_M2 = 0.01
_COMMON_M2 = 0.1
"""Rooms that are drawn by hand may overlap so much: a strip of 3 cm along a wall of 3 m."""
_BESIDE_M = 0.05
"""A hotspot so near to the edge of its room is in it: a cell of the map."""


def check_places(file: Path, map_file: Path | None, form: str) -> tuple[str, bool]:
    """Check a hotspot file.

    Args:
        file: The file.
        map_file: The map that its places are held against; None: they are not.
        form: ``text``, ``json`` or ``github``.

    Returns:
        The report, and whether there are errors.

    Raises:
        ConfigError: There is no such form, or the map or the file cannot be read.
    """
    if form not in FORMATS:
        raise ConfigError(f"there is no format {form!r}", valid=FORMATS)
    problem_at, about_map = None, list[Finding]()
    if map_file is not None:
        from florence_bt.app.mission_files.map_places import problem_on_map

        problem_at = problem_on_map(
            map_file, lambda sentence: about_map.append(Finding(str(map_file), 1, 1, WARNING, sentence))
        )
    places = read_places(file)
    findings = [*about_map, *place_findings(places, problem_at)]
    report = FORMATS[form](findings, Excerpts({}))
    if form == "text":
        spots, zones = len(places.hotspots), len(places.hotspots.zones)
        head = f"hotspots: {spots}, zones: {zones}; {summary(findings)}"
        report = f"{report}\n{head}" if report else head
    return report, has_errors(findings)


def place_findings(places: Places, problem_at: ProblemAt | None = None) -> list[Finding]:
    """Return everything that is wrong with a hotspot file, in its order.

    Args:
        places: The file.
        problem_at: Says what the map has against a place.
    """
    findings = [finding_from_error(error) for error in places.problems]
    finder = _Finder(places)
    findings += [*finder.bare_angles(), *finder.shapes(), *finder.overlaps(), *finder.spots(problem_at)]
    return sorted(findings, key=lambda finding: (finding.line, finding.column))


class _Finder:
    """Finds what is wrong with places that could be read."""

    def __init__(self, places: Places) -> None:
        self._places = places
        self._rooms = [room for room in places.hotspots.rooms() if room.polygon]
        self._zones = [zone for zone in places.hotspots.zones if zone.polygon]

    def bare_angles(self) -> Iterator[Finding]:
        for label, item in self._places.entries.get("hotspots", {}).items():
            phi, spot = item.get("phi"), self._places.hotspots.get(label)
            if not isinstance(phi, YamlScalar) or spot is None or not spot.pose.yaw:
                continue
            try:
                bare = float(phi.text)
            except ValueError:
                continue
            in_degrees = f"{math.degrees(bare):.4g}"
            problem = f"phi: {phi.text} has no unit; it is read as radians, {in_degrees} degrees"
            valid = (f"{phi.text} rad", f"{phi.text} deg, if degrees are meant")
            yield self._finding(phi.position, problem, valid, WARNING)

    def shapes(self) -> Iterator[Finding]:
        named = [("hotspots", "room", room.label, room.polygon) for room in self._rooms]
        named += [("zones", "zone", zone.label, zone.polygon) for zone in self._zones]
        for section, what, label, polygon in named:
            crossing = crossing_edges(polygon)
            if crossing is not None:
                first, second = crossing
                yield self._finding(
                    self._corner(section, label, second - 1),
                    f"edge {second} of the {what} {label!r} crosses its edge {first}",
                    ("the corners in their order along the edge",),
                )
            elif area(polygon) < _LEAST_AREA_M2:
                problem = f"the {what} {label!r} has no area: its corners are on one line"
                yield self._finding(self._corner(section, label, 0), problem)

    def overlaps(self) -> Iterator[Finding]:
        for one, other in itertools.combinations(self._rooms, 2):
            common = common_area(one.polygon, other.polygon)
            if common > _COMMON_M2:
                problem = (
                    f"the rooms {one.label!r} and {other.label!r} overlap by {common:.1f} m²: "
                    f"what is in both counts as {one.label!r}"
                )
                yield self._finding(self._corner("hotspots", other.label, 0), problem)

    def spots(self, problem_at: ProblemAt | None) -> Iterator[Finding]:
        for spot in self._places.hotspots:
            position = self._places.entry("hotspots", spot.label).position
            for problem in self._problems_of(spot, problem_at):
                yield self._finding(position, problem, ("a place where the robot can stand",))

    def _problems_of(self, spot: Hotspot, problem_at: ProblemAt | None) -> Iterator[str]:
        x, y = spot.pose.x, spot.pose.y
        if spot in self._rooms and not spot.contains(x, y) and distance_to(spot.polygon, x, y) > _BESIDE_M:
            yield f"the room {spot.label!r} does not contain its own hotspot ({x:g}, {y:g})"
        for zone in self._zones:
            if zone.kind == KEEP_OUT and contains(zone.polygon, x, y):
                yield f"the hotspot {spot.label!r} is in the keep-out zone {zone.label!r}"
        problem = problem_at(x, y) if problem_at is not None else None
        if problem is not None:
            yield f"the hotspot {spot.label!r} is {problem}"

    def _corner(self, section: str, label: str, index: int) -> Position:
        polygon = self._places.entry(section, label).get("polygon")
        assert isinstance(polygon, YamlSequence), "it was read"
        return polygon.items[index].position

    def _finding(
        self, position: Position, problem: str, valid: tuple[str, ...] = (), severity: str = ERROR
    ) -> Finding:
        return Finding(str(self._places.file), position.line, position.column, severity, problem, valid)
