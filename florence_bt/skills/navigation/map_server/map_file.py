"""ROS map files: a YAML file with the scale beside a picture. Files to :class:`OccupancyGrid`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError, FrameError, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlScalar, YamlSequence, read_yaml
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.skills.navigation.map_server.picture import FORMATS, decode_picture

MODES = ("trinary", "scale", "raw")
_KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode")
_REQUIRED = _KEYS[:3]


@dataclass(frozen=True, slots=True)
class MapDescription:
    """What the YAML file of a map says.

    Attributes:
        file: The YAML file.
        image: The picture.
        resolution: Metres per pixel.
        origin: Pose of the lower left corner of the picture in the map frame.
        negate: Whether white means occupied.
        occupied_thresh: Occupancy (0..1) from which a cell is occupied.
        free_thresh: Occupancy up to which a cell is free.
        mode: ``trinary``, ``scale`` (99 steps between free and occupied) or ``raw`` (the pixel is the value).

    Source:
        REFERENCE 7.8.
    """

    file: Path
    image: Path
    resolution: float
    origin: Pose2
    negate: bool = False
    occupied_thresh: float = 0.65
    free_thresh: float = 0.196
    mode: str = "trinary"


def load_map(path: str | Path) -> OccupancyGrid:
    """Read a map.

    Args:
        path: The YAML file; a relative image path in it starts from its folder.

    Raises:
        ConfigError: A file is missing or wrong; the message names the file, the line and what would work.

    Source:
        REFERENCE 7.8, document, section 3.3.1.
    """
    return read_cells(read_description(Path(path)))


def read_cells(description: MapDescription) -> OccupancyGrid:
    """Read the picture of a map.

    Returns:
        The map on cells along the axes of the map frame, whatever the origin's yaw.

    Raises:
        ConfigError: The picture is missing or wrong.
    """
    picture = description.image
    try:
        grey, opacity = decode_picture(picture.read_bytes())
    except OSError as error:
        found = (each.name for form in FORMATS for each in sorted(picture.parent.glob(f"*.{form}")))
        raise ConfigError(
            f"the map's picture {str(picture)!r} cannot be read ({error.strerror})",
            file=description.file,
            valid=[*found],
        ) from error
    except FrameError as error:
        valid = ["a .pgm (P5 or P2), .png or .bmp picture"]
        raise ConfigError(str(error), file=picture, valid=valid) from error
    cells = np.ascontiguousarray(np.flipud(_cells_from_pixels(grey, opacity, description)))
    return OccupancyGrid(description.resolution, description.origin, cells).upright()


def _cells_from_pixels(
    grey: NDArray[np.uint8], opacity: NDArray[np.uint8] | None, description: MapDescription
) -> NDArray[np.int8]:
    """The cells in the order of the picture, whose first row is the top of the map."""
    shade = grey / 255.0
    if opacity is not None and description.mode == "trinary":
        # As in ROS 1 and Nav2: opacity counts as a fourth colour.
        shade = 0.75 * shade + 0.25 * opacity / 255.0
    see_through = np.zeros(grey.shape, bool) if opacity is None else opacity < 255
    if description.mode == "raw":
        return np.where((grey <= 100) & ~see_through, grey, UNKNOWN).astype(np.int8)
    occupancy = shade if description.negate else 1.0 - shade
    free, occupied = description.free_thresh, description.occupied_thresh
    between: NDArray[np.float64] | int = UNKNOWN
    if description.mode == "scale":
        between = np.floor(1.0 + 98.0 * (occupancy - free) / (occupied - free))
    cells = np.where(occupancy >= occupied, OCCUPIED, np.where(occupancy <= free, FREE, between))
    if description.mode == "scale":
        cells[see_through] = UNKNOWN
    return cells.astype(np.int8)


def read_description(path: Path) -> MapDescription:
    """Read the YAML file of a map, without its picture.

    Raises:
        ConfigError: As :func:`load_map`.
    """
    entries = _entries(path)
    for name in _REQUIRED:
        if name not in entries:
            raise ConfigError(f"the key {name!r} is missing", file=path, line=1, valid=[f"{name}: ..."])
    resolution = _number(path, entries, "resolution", 0.0)
    if not resolution > 0.0:
        raise _wrong(path, entries["resolution"], "the resolution must be above zero", "0.05")
    occupied = _number(path, entries, "occupied_thresh", 0.65)
    free = _number(path, entries, "free_thresh", 0.196)
    if not 0.0 <= free < occupied <= 1.0:
        node = entries.get("free_thresh", entries.get("occupied_thresh", entries["image"]))
        text = f"the thresholds must be 0 <= free_thresh < occupied_thresh <= 1, not {free} and {occupied}"
        raise _wrong(path, node, text, "free_thresh: 0.196 with occupied_thresh: 0.65")
    image, mode = _text(path, entries, "image", ""), _text(path, entries, "mode", "trinary")
    if mode not in MODES:
        raise _wrong(path, entries["mode"], f"the mode {mode!r} is unknown", *closest_first(mode, MODES))
    return MapDescription(
        file=path,
        image=path.parent / image,
        resolution=resolution,
        origin=_origin(path, entries["origin"]),
        negate=_flag(path, entries, "negate"),
        occupied_thresh=occupied,
        free_thresh=free,
        mode=mode,
    )


def _entries(path: Path) -> dict[str, YamlNode]:
    """The values of the file by key, each with its place."""
    try:
        root = read_yaml(path)
    except ConfigError as error:
        valid = (
            [str(other) for other in sorted(path.parent.glob("*.yaml"))] if not path.exists() else error.valid
        )
        raise ConfigError(
            f"the map: {error.problem}", file=path, line=error.line, column=error.column, valid=valid
        ) from error
    if not isinstance(root, YamlMapping):
        raise ConfigError("a map file holds keys with values", file=path, line=1, valid=_KEYS)
    for key, _ in root.entries:
        if key.text not in _KEYS:
            raise _wrong(path, key, f"the key {key.text!r} is unknown", *closest_first(key.text, _KEYS))
    return {key.text: value for key, value in root.entries}


def _wrong(path: Path, source: YamlNode, problem: str, *valid: str) -> ConfigError:
    position = source.position
    return ConfigError(problem, file=path, line=position.line, column=position.column, valid=valid)


def _text(path: Path, entries: dict[str, YamlNode], name: str, default: str) -> str:
    source = entries.get(name)
    if source is None:
        return default
    if not isinstance(source, YamlScalar) or not source.text:
        raise _wrong(path, source, f"{name} must be text", f"{name}: {default or 'map.pgm'}")
    return source.text


def _float(path: Path, source: YamlNode, name: str, example: str) -> float:
    text = source.text if isinstance(source, YamlScalar) else ""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _wrong(path, source, f"{name} must be a number, not {text!r}", example)
    return value


def _number(path: Path, entries: dict[str, YamlNode], name: str, default: float) -> float:
    return _float(path, entries[name], name, f"{name}: {default or 0.05}") if name in entries else default


def _flag(path: Path, entries: dict[str, YamlNode], name: str) -> bool:
    text = _text(path, entries, name, "0").lower()
    if text not in ("0", "1", "false", "true"):
        raise _wrong(path, entries[name], f"{name} must be 0 or 1, not {text!r}", "0", "1")
    return text in ("1", "true")


def _origin(path: Path, source: YamlNode) -> Pose2:
    example = "origin: [-10.0, -10.0, 0.0]"
    if not isinstance(source, YamlSequence) or len(source.items) != 3:
        raise _wrong(path, source, "the origin must be a list of x, y and yaw", example)
    return Pose2(*(_float(path, item, "a number of the origin", example) for item in source.items))
