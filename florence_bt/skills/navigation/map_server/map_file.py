"""ROS map files: a YAML file with the scale beside an image. Files to :class:`OccupancyGrid`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.geometry import Pose2
from florence_bt.core.plain_yaml import YamlNode, YamlSequence, read_yaml
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.core.settings_file import SettingsReader, ValueReader
from florence_bt.skills.navigation.map_server.image import FORMATS, decode_image

MODES = ("trinary", "scale", "raw")
_FLAGS = {"0": False, "false": False, "1": True, "true": True}
_ORIGIN = ("origin: [-10.0, -10.0, 0.0]",)


@dataclass(frozen=True, slots=True)
class MapDescription:
    """What the YAML file of a map says.

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
    """Read the image of a map.

    Returns:
        The map on cells along the axes of the map frame, whatever the origin's yaw.

    Raises:
        ConfigError: The image is missing or wrong.
    """
    image = description.image
    try:
        grey, opacity = decode_image(image.read_bytes())
    except OSError as error:
        found = (each.name for form in FORMATS for each in sorted(image.parent.glob(f"*.{form}")))
        raise ConfigError(
            f"the map's image {str(image)!r} cannot be read ({error.strerror})",
            file=description.file,
            valid=[*found],
        ) from error
    except FrameError as error:
        valid = ["a .pgm (P5 or P2), .png or .bmp image"]
        raise ConfigError(str(error), file=image, valid=valid) from error
    cells = np.ascontiguousarray(np.flipud(_cells_from_pixels(grey, opacity, description)))
    return OccupancyGrid(description.resolution, description.origin, cells).upright()


def _cells_from_pixels(
    grey: NDArray[np.uint8], opacity: NDArray[np.uint8] | None, description: MapDescription
) -> NDArray[np.int8]:
    """The cells in the order of the image, whose first row is the top of the map."""
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
    """Read the YAML file of a map, without its image.

    Raises:
        ConfigError: As :func:`load_map`.
    """
    try:
        root = read_yaml(path)
    except ConfigError as error:
        valid = (
            [str(other) for other in sorted(path.parent.glob("*.yaml"))] if not path.exists() else error.valid
        )
        raise ConfigError(
            f"the map: {error.problem}", file=path, line=error.line, column=error.column, valid=valid
        ) from error
    return _MapReader(path).read(root)


class _MapReader(SettingsReader):
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
        if resolution <= 0.0:
            raise self.error("the resolution must be above zero", source, ["0.05"])
        return resolution

    def _flag(self, source: YamlNode, name: str) -> bool:
        text = self.text(source, name).lower()
        if text not in _FLAGS:
            raise self.error(f"{name} must be 0 or 1, not {text!r}", source, ["0", "1"])
        return _FLAGS[text]

    def _origin(self, source: YamlNode, name: str) -> Pose2:
        if not isinstance(source, YamlSequence) or len(source.items) != 3:
            raise self.error("the origin must be a list of x, y and yaw", source, _ORIGIN)
        return Pose2(*(self.number(item, f"a number of the {name}", _ORIGIN) for item in source.items))
