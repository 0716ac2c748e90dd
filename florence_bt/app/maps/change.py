"""``florence map clean``, ``crop``, ``rotate`` and ``edit``: changes a map, and what belongs to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.maps.versions import Versions
from florence_bt.app.places.draw import check_form, draw_change
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import YamlNode, parse_yaml
from florence_bt.core.polygons import Point
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.text_files import refuse_to_replace
from florence_bt.core.units import UNITS
from florence_bt.core.yaml_reader import YamlReader
from florence_bt.skills.locator.hotspot_file import HotspotFile
from florence_bt.skills.navigation.localisation.saved_pose import load_pose, pose_text
from florence_bt.skills.navigation.map_server.map_file import load_map, read_description
from florence_bt.skills.navigation.map_server.map_writer import encode_map, refuse_what_is_no_map
from florence_bt.skills.navigation.mapping.editing import STAYS, Edited
from florence_bt.skills.navigation.mapping.wall_direction import wall_direction


@dataclass(frozen=True, slots=True)
class ChangedFiles:
    """The files that a command reads and changes.

    Attributes:
        file: The YAML file of the map.
        out: The YAML file to write instead; None changes the map itself.
        hotspots: The hotspot file that belongs to the map, if any.
        pose: The saved pose of the robot that belongs to it, if any.
        picture: A picture to draw of what has changed, if any.
    """

    file: Path
    out: Path | None = None
    hotspots: Path | None = None
    pose: Path | None = None
    picture: Path | None = None


def change_map(files: ChangedFiles, edit: Callable[[OccupancyGrid], Edited], what: str) -> Iterator[str]:
    """Change a map and what belongs to it: all files or none.

    Args:
        files: Which.
        edit: What is done to the map.
        what: The same, for people.

    Yields:
        What was done, a line for each thing.

    Raises:
        ConfigError: A file is missing or wrong or cannot be written, or the edit is impossible.
    """
    if files.picture is not None:
        check_form(files.picture)
    description, warnings = read_description(files.file), list[str]()
    before = load_map(files.file, warnings.append)
    yield from (f"{files.file}: {sentence}" for sentence in warnings)
    if description.origin.yaw:
        yaw = math.degrees(description.origin.yaw)
        yield f"the map's origin had a yaw of {yaw:.2f} deg; its cells now lie along the axes"
    edited = edit(before)
    yield from edited.done
    target = files.out or files.file
    target = target if target.suffix else target.with_suffix(".yaml")
    contents = encode_map(
        edited.grid,
        target,
        mode=description.mode,
        # With steps between free and occupied only transparency is left for unknown.
        form="png" if description.mode == "scale" else description.image.suffix.lstrip(".").lower(),
        occupied_thresh=description.occupied_thresh,
        free_thresh=description.free_thresh,
    )
    places = None
    if files.hotspots is not None:
        places = HotspotFile(files.hotspots)
        if edited.move != STAYS:
            places.turn(edited.move)
            contents[_beside(files.hotspots, target, files.out)] = places.text().encode()
            spots, zones = len(places.hotspots), len(places.hotspots.zones)
            yield f"{spots} hotspots and {zones} zones turned with the map"
        yield from _outside(places, before, edited)
    if files.pose is not None:
        pose = load_pose(files.pose, before)
        if pose is None:
            yield f"{files.pose}: no pose in this map; it stays"
        else:
            contents[_beside(files.pose, target, files.out)] = pose_text(
                edited.move @ pose, edited.grid
            ).encode()
            yield "the saved pose belongs to the changed map now"
    shown = {}
    if files.picture is not None:
        drawn, title = places.hotspots if places else None, f"{target}: {what}"
        shown[files.picture] = draw_change(before, edited.grid, drawn, files.picture.suffix, title)
    try:
        refuse_what_is_no_map(*list(contents)[:2])
        for picture in shown:
            refuse_to_replace(picture)
        Versions(target).write(contents, what, beside=shown)
    except OSError as error:
        raise ConfigError(f"the map cannot be written: {error.strerror}", file=error.filename) from error
    yield f"{', '.join(str(file) for file in contents)} written; --undo takes it back"
    if files.picture is not None:
        yield f"{files.picture} written"


def _beside(file: Path, target: Path, out: Path | None) -> Path:
    """Return where a file that belongs to the map is written: beside a map of another name under its name."""
    at = file.resolve() if file.is_symlink() else file
    return at if out is None else target.with_name(f"{target.stem}.{file.name}")


def _outside(places: HotspotFile, before: OccupancyGrid, edited: Edited) -> Iterator[str]:
    """Tell which hotspots the map knows nothing of any more."""
    lost = []
    for spot in places.hotspots:
        old = edited.move.inverse() @ spot.pose
        known_before = before.problem_with_place(old.x, old.y) is None
        if known_before and edited.grid.problem_with_place(spot.pose.x, spot.pose.y):
            lost.append(spot.label)
    if lost:
        yield f"the map knows nothing any more of the place of {', '.join(lost)}"


def undo(file: Path, *, overwrite: bool) -> str:
    """Take back the last change of a map.

    Raises:
        ConfigError: As :meth:`Versions.undo`.
    """
    what, back, left = Versions(file).undo(overwrite=overwrite)
    files = ", ".join(map(str, back)) or "no file"
    return f"{what} undone: {files} as before; {left} more to undo"


def turn_of(text: str | None, grid: OccupancyGrid) -> float:
    """Return by how much to turn a map, radians: what was typed, or what puts its walls along the axes.

    Raises:
        ConfigError: What was typed is no angle.
    """
    if text is None:
        return -wall_direction(grid)
    return _Reader(Path("--by")).quantity(
        _typed(text), "the angle", UNITS[Kind.ANGLE], ("90 deg", "-1.5 deg")
    )


def edits(pairs: Iterable[str]) -> list[tuple[str, list[Point]]]:
    """Read what is to be drawn: ``wall=[[1, 2], [3, 2]]`` and so on, in its order.

    Raises:
        ConfigError: One of them is something else.
    """
    return [(name, points(text, name)) for name, _, text in (pair.partition("=") for pair in pairs)]


def points(text: str, name: str) -> list[Point]:
    """Read points as they are typed: ``[[1, 2], [3, 2]]``, metres.

    Raises:
        ConfigError: They are something else.
    """
    try:
        return _Reader(Path(name)).points(_typed(text))
    except ConfigError as error:
        problem = f"{name}: {text!r} is no list of points"
        raise ConfigError(problem, valid=[f"{name}='[[1, 2], [3, 2.5]]'"]) from error


def _typed(text: str) -> YamlNode:
    return parse_yaml(text.encode(), Path("what was typed"))


class _Reader(YamlReader):
    """Reads what was typed."""

    def points(self, source: YamlNode) -> list[Point]:
        return [self._point(item) for item in self.sequence(source, "the points")]

    def _point(self, item: YamlNode) -> Point:
        numbers = [self.number(each, "a coordinate") for each in self.sequence(item, "a point")]
        if len(numbers) != 2:
            raise self.error("a point has two numbers", item)
        return numbers[0], numbers[1]
