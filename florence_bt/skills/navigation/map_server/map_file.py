"""ROS map files: a YAML file with the scale beside an image. Files to :class:`OccupancyGrid`."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.geometry import MAX_DISTANCE_M, Pose2
from florence_bt.core.plain_yaml import YamlNode, YamlSequence, parse_yaml, read_yaml
from florence_bt.core.sensing import (
    FREE,
    MAX_MAP_CELLS,
    MAX_RESOLUTION_M,
    MIN_RESOLUTION_M,
    OCCUPIED,
    UNKNOWN,
    OccupancyGrid,
    upright_size,
)
from florence_bt.core.text_files import read_bytes
from florence_bt.core.yaml_reader import ValueReader, YamlReader
from florence_bt.skills.navigation.map_server.image import FORMATS, MAX_IMAGE_BYTES, decode_image

MODES = ("trinary", "scale", "raw")
_FLAGS = {"0": False, "false": False, "1": True, "true": True}
_ORIGIN = ("origin: [-10.0, -10.0, 0.0]",)
_RESOLUTIONS = (f"{MIN_RESOLUTION_M:g} to {MAX_RESOLUTION_M:g} (metres a cell), such as 0.05",)
UNKNOWN_GREY = 205
"""Grey of unknown cells from the savers of nav2_map_server and of ROS 1 in trinary mode."""
FEW_FREE = 0.01
"""Share of free cells below which a map can hardly be meant; chosen."""
Warn = Callable[[str], None]
"""Called with a sentence about what is probably wrong with a map that can be read."""


@dataclass(frozen=True, slots=True)
class MapDescription:
    """The contents of the YAML file of a map.

    Attributes:
        file: The YAML file.
        image: The image file.
        resolution: Metres per pixel.
        origin: Pose of the lower left corner of the image in the map frame.
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


def load_map(path: str | Path, warn: Warn = lambda sentence: None) -> OccupancyGrid:
    """Read a map.

    Args:
        path: The YAML file; a relative image path in it starts from its folder.
        warn: Told what is probably wrong.

    Raises:
        ConfigError: A file is missing or wrong; the message names the file, the line and what would work.

    Source:
        REFERENCE 7.8, document, section 3.3.1.
    """
    return read_cells(read_description(Path(path)), warn)


def read_cells(description: MapDescription, warn: Warn = lambda sentence: None) -> OccupancyGrid:
    """Read the image of a map.

    Returns:
        The map on cells along the axes of the map frame, whatever the origin's yaw.

    Raises:
        ConfigError: The image is missing or wrong.
    """
    image = description.image
    try:
        data = read_bytes(image, MAX_IMAGE_BYTES)
    except ConfigError as error:
        found = [each.name for form in FORMATS for each in _files_beside(image, form)]
        raise ConfigError(
            f"the map's image {str(image)!r}: {error.problem}",
            file=description.file,
            valid=error.valid or found,
        ) from error
    try:
        grey, opacity = decode_image(data)
    except FrameError as error:
        valid = ["a .pgm (P5 or P2), .png or .bmp image"]
        raise ConfigError(str(error), file=image, valid=valid) from error
    _check_size(description, *grey.shape)
    pixels = _Pixels(grey, opacity)
    cells = pixels.cells(description)
    for sentence in pixels.doubts(description, cells):
        warn(sentence)
    cells = np.ascontiguousarray(np.flipud(cells))
    return OccupancyGrid(description.resolution, description.origin, cells).upright()


def _check_size(description: MapDescription, rows: int, columns: int) -> None:
    """Refuse a map that is too long, or whose turned image needs too many cells."""
    longest = max(rows, columns) * description.resolution
    if longest > MAX_DISTANCE_M:
        raise ConfigError(
            f"{columns} x {rows} pixels of {description.resolution:g} m are {longest:g} m long",
            file=description.file,
            valid=[f"at most {MAX_DISTANCE_M:g} m"],
        )
    if math.prod(upright_size(columns, rows, description.origin.yaw)) > 2 * MAX_MAP_CELLS:
        raise ConfigError(
            f"the image of {columns} x {rows} pixels, turned by the origin's yaw, needs too many cells",
            file=description.file,
            valid=["an origin with the yaw 0", f"an image that needs at most {2 * MAX_MAP_CELLS} cells"],
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Pixels:
    """The image of a map, shape (rows, columns), row 0 at the top."""

    grey: NDArray[np.uint8]
    opacity: NDArray[np.uint8] | None

    def cells(self, description: MapDescription) -> NDArray[np.int8]:
        """Return the cells, in the order of the image."""
        return self._look_up(_cells_of_values(description, opacity=self.opacity is not None))

    def doubts(self, description: MapDescription, cells: NDArray[np.int8]) -> Iterator[str]:
        """Say what is probably wrong with the description, or with the image, a sentence each."""
        kept = _count(self._look_up(_kept_unknown(description, opacity=self.opacity is not None)))
        if kept:
            yield (
                f"{_percent(kept, cells)} of the cells have the grey that map savers write for unknown "
                f"({UNKNOWN_GREY}), but count as free with free_thresh {description.free_thresh:g}"
                f"{' and their opacity' if self.opacity is not None else ''}: "
                "they stay unknown; free_thresh: 0.196 and an image without opacity say the same"
            )
        free, occupied = _count(cells == FREE), _count(cells == OCCUPIED)
        if description.mode == "raw" or not (free < FEW_FREE * cells.size or free < occupied):
            return
        sentence = f"{_percent(free, cells)} of the cells are free and {_percent(occupied, cells)} occupied"
        for doubt, other, pixels in (
            (f"negate: {int(description.negate)}", replace(description, negate=not description.negate), self),
            ("the opacity of the image", description, _Pixels(self.grey, None)),
        ):
            instead = _count(pixels.cells(other) == FREE)
            if instead > max(free, FEW_FREE * cells.size):
                sentence += f"; is {doubt} meant? Without it {_percent(instead, cells)} would be free"
        yield sentence

    def _look_up(self, table: NDArray[Any]) -> NDArray[Any]:
        return table[self.grey] if self.opacity is None else table[self.grey, self.opacity]


def _count(cells: NDArray[Any]) -> int:
    return int(np.count_nonzero(cells))


def _percent(count: int, cells: NDArray[np.int8]) -> str:
    return f"{100.0 * count / cells.size:.3g} %"


def _values(opacity: bool) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return every grey value and opacity: of shape (256,), of an image with opacity (256, 256)."""
    grey = np.arange(256)
    return (grey[:, None], grey[None, :]) if opacity else (grey, np.full(256, 255))


def _read_values(description: MapDescription, *, opacity: bool) -> NDArray[np.int8]:
    """Read what a pixel becomes by its grey value (and its opacity), by the rules of ROS."""
    grey, opaque = _values(opacity)
    shade = grey / 255.0
    if opacity and description.mode == "trinary":
        # As in ROS 1 and Nav2: opacity counts as a fourth colour.
        shade = 0.75 * shade + 0.25 * opaque / 255.0
    see_through = opaque < 255
    if description.mode == "raw":
        return np.where((grey <= 100) & ~see_through, grey, UNKNOWN).astype(np.int8)
    occupancy = shade if description.negate else 1.0 - shade
    free, occupied = description.free_thresh, description.occupied_thresh
    between: NDArray[np.float64] | int = UNKNOWN
    if description.mode == "scale":
        between = np.floor(1.0 + 98.0 * (occupancy - free) / (occupied - free))
    cells = np.where(occupancy >= occupied, OCCUPIED, np.where(occupancy <= free, FREE, between))
    if description.mode == "scale":
        cells = np.where(see_through, UNKNOWN, cells)
    return cells.astype(np.int8)


def _kept_unknown(description: MapDescription, *, opacity: bool) -> NDArray[np.bool_]:
    """Tell which values would be free although a map saver means unknown by them.

    Nav2's saver writes ``free_thresh: 0.25`` beside the grey 205, whose occupancy is 0.196.
    """
    grey, _ = _values(opacity)
    unknown = grey == (255 - UNKNOWN_GREY if description.negate else UNKNOWN_GREY)
    return unknown & (_read_values(description, opacity=opacity) == FREE) & (description.mode == "trinary")


def _cells_of_values(description: MapDescription, *, opacity: bool) -> NDArray[np.int8]:
    """Return what a pixel becomes, by its grey value (and its opacity)."""
    kept = _kept_unknown(description, opacity=opacity)
    return np.where(kept, np.int8(UNKNOWN), _read_values(description, opacity=opacity))


def read_description(path: Path) -> MapDescription:
    """Read the YAML file of a map, without its image.

    Raises:
        ConfigError: As :func:`load_map`.
    """
    try:
        root = read_yaml(path)
    except ConfigError as error:
        there = os.path.exists(path)
        valid = error.valid if there else [str(other) for other in _files_beside(path, "yaml")]
        raise ConfigError(
            f"the map: {error.problem}", file=path, line=error.line, column=error.column, valid=valid
        ) from error
    return _MapReader(path).read(root)


def parse_description(text: bytes, path: Path) -> MapDescription:
    """Read the text of the YAML file of a map; ``path`` is named in errors, and the image starts from it.

    Raises:
        ConfigError: It is wrong.
    """
    return _MapReader(path).read(parse_yaml(text, path))


def _files_beside(file: Path, ending: str) -> list[Path]:
    """List the files with an ending in the folder of a file; none when there is no such folder."""
    return sorted(file.parent.glob(f"*.{ending}")) if os.path.isdir(file.parent) else []


class _MapReader(YamlReader):
    """Reads the description of one map."""

    def read(self, root: YamlNode) -> MapDescription:
        readers: dict[str, ValueReader] = {
            "image": lambda value, name: self.file.parent / self.text(value, name),
            "resolution": self._resolution,
            "origin": self._origin,
            "negate": self._flag,
            "occupied_thresh": partial(self.number, valid=("0.65",)),
            "free_thresh": partial(self.number, valid=("0.196",)),
            "mode": partial(self.choice, known=MODES),
        }
        entries = self.mapping(root, readers, needed=("image", "resolution", "origin"))
        description = MapDescription(self.file, **self.values(entries, readers))
        free, occupied = description.free_thresh, description.occupied_thresh
        if not 0.0 <= free < occupied <= 1.0:
            source = entries.get("free_thresh", entries.get("occupied_thresh", root))
            problem = (
                f"the thresholds must be 0 <= free_thresh < occupied_thresh <= 1, not {free} and {occupied}"
            )
            raise self.error(problem, source, ["free_thresh: 0.196 with occupied_thresh: 0.65"])
        return description

    def _resolution(self, source: YamlNode, name: str) -> float:
        resolution = self.number(source, name, ["0.05"])
        if not MIN_RESOLUTION_M <= resolution <= MAX_RESOLUTION_M:
            raise self.error(f"the resolution cannot be {resolution:g}", source, _RESOLUTIONS)
        return resolution

    def _flag(self, source: YamlNode, name: str) -> bool:
        text = self.text(source, name).lower()
        if text not in _FLAGS:
            raise self.error(f"{name} must be 0 or 1, not {text!r}", source, ["0", "1"])
        return _FLAGS[text]

    def _origin(self, source: YamlNode, name: str) -> Pose2:
        if not isinstance(source, YamlSequence) or len(source.items) != 3:
            raise self.error("the origin must be a list of x, y and yaw", source, _ORIGIN)
        origin = Pose2(*(self.number(item, f"a number of the {name}", _ORIGIN) for item in source.items))
        if not origin.is_within_limits():
            valid = (f"x and y within {MAX_DISTANCE_M:g} m and a yaw in radians", *_ORIGIN)
            raise self.error("the origin is out of reason", source, valid)
        return origin
