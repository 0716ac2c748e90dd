"""Writes map files, which :mod:`map_file` and the map servers of ROS read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.file_sets import replace_files
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.core.text_files import refuse_to_replace
from florence_bt.skills.navigation.map_server.image import FORMATS, encode_image
from florence_bt.skills.navigation.map_server.map_file import (
    MODES,
    UNKNOWN_GREY,
    MapDescription,
    parse_description,
    read_description,
)

OCCUPIED_THRESH, FREE_THRESH = 0.65, 0.196
"""As ROS's map_saver writes them: REFERENCE 7.8."""
_WHITE, _BLACK = 254, 0
"""Free and occupied in the picture. Source: REFERENCE 7.8."""


def save_map(
    grid: OccupancyGrid,
    path: Path,
    *,
    mode: str = "trinary",
    form: str = "pgm",
    occupied_thresh: float = OCCUPIED_THRESH,
    free_thresh: float = FREE_THRESH,
    others: Mapping[Path, bytes] | None = None,
) -> Path:
    """Write a map, and what belongs to it: the YAML file, beside it the image of the same name; all or none.

    Only new files are written, or another map of this name is replaced.

    Args:
        grid: The map.
        path: The YAML file; ``.yaml`` is added when it has no ending.
        mode: ``trinary``: cells from ``occupied_thresh`` on become occupied, to ``free_thresh`` free, the
            rest unknown. ``scale`` keeps the steps between, ``raw`` every value.
        form: Of the image: ``pgm``, ``png`` or ``bmp``.
        occupied_thresh: Occupancy, 0..1.
        free_thresh: Occupancy, 0..1.
        others: What is written in the same step: file -> content.

    Returns:
        The YAML file.

    Raises:
        ConfigError: A choice is unknown, there is something else than a map, or the files cannot be written.

    Source:
        REFERENCE 7.8.
    """
    path = path if path.suffix else path.with_suffix(".yaml")
    files = encode_map(
        grid, path, mode=mode, form=form, occupied_thresh=occupied_thresh, free_thresh=free_thresh
    )
    try:
        refuse_what_is_no_map(*files)
        replace_map(path, {**(others or {}), **files})
    except OSError as error:
        raise ConfigError(f"the map cannot be written: {error.strerror}", file=error.filename) from error
    return path


def replace_map(
    path: Path, contents: Mapping[Path, bytes], *, remove: Iterable[Path] = (), no_links: Iterable[Path] = ()
) -> None:
    """Write the files of a map and of what belongs to it, all or none; folders are made when missing.

    Programs that know nothing of sets of files find an image and the description of that image at any moment:
    while the image changes, the description names another copy of the new one.

    Args:
        path: The YAML file of the map.
        contents: File -> what it is to hold; the map's may be among them, or not.
        remove: Files that go in the same step.
        no_links: As of :func:`replace_files`.

    Raises:
        OSError: One cannot be written, and nothing has changed.
    """
    others = {file: data for file, data in contents.items() if file != path}
    last, gone = [(path, contents[path])] if path in contents else [], list(remove)
    description = parse_description(contents[path], path) if last else None
    if description is not None and description.image in others and description.image.exists():
        image = description.image
        beside = image.with_name(f".{image.stem}.new{image.suffix}")
        pixels = others.pop(image)
        meanwhile = _described(replace(description, image=beside)).encode()
        last = [(beside, pixels), (path, meanwhile), (image, pixels), *last]
        gone.append(beside)
    replace_files([*others.items(), *last], remove=gone, make_folders=True, no_links=no_links)


def encode_map(
    grid: OccupancyGrid,
    path: Path,
    *,
    mode: str,
    form: str,
    occupied_thresh: float = OCCUPIED_THRESH,
    free_thresh: float = FREE_THRESH,
) -> dict[Path, bytes]:
    """Return the files of a map, the image first; arguments and errors as of :func:`save_map`."""
    _check(path, mode, form, occupied_thresh, free_thresh)
    grid = grid.upright()
    unknown = grid.cells == UNKNOWN
    if mode == "scale" and form != "png" and unknown.any():
        raise ConfigError(
            "unknown cells of a map in the mode 'scale' are transparent", valid=["png", "the mode trinary"]
        )
    grey = np.flipud(_pixels(grid.cells, mode, occupied_thresh, free_thresh))
    see_through = mode == "scale" and form == "png"
    opacity = np.where(np.flipud(unknown), 0, 255).astype(np.uint8) if see_through else None
    image = path.with_suffix(f".{form}")
    origin = Pose2(grid.origin.x, grid.origin.y)
    description = MapDescription(
        path, image, grid.resolution, origin, False, occupied_thresh, free_thresh, mode
    )
    return {image: encode_image(grey, opacity, form), path: _described(description).encode()}


def _described(map_: MapDescription) -> str:
    """Write the YAML file of a map, whose image lies beside it."""
    origin = map_.origin
    return (
        f"image: {map_.image.name}\nmode: {map_.mode}\nresolution: {map_.resolution!r}\n"
        f"origin: [{origin.x!r}, {origin.y!r}, {origin.yaw!r}]\nnegate: {int(map_.negate)}\n"
        f"occupied_thresh: {map_.occupied_thresh!r}\nfree_thresh: {map_.free_thresh!r}\n"
    )


def check_target(path: Path) -> None:
    """Refuse a file, before the work, to which :func:`save_map` would not write a map.

    Raises:
        ConfigError: As there.
    """
    _check(path, "trinary", "pgm", OCCUPIED_THRESH, FREE_THRESH)
    try:
        refuse_what_is_no_map(path.with_suffix(".pgm"), path)
    except OSError as error:
        raise ConfigError(f"the map cannot be written: {error.strerror}", file=path) from error


def refuse_what_is_no_map(image: Path, path: Path) -> None:
    """Refuse to replace a file that is not the image, or the description, of the map of this name.

    Raises:
        ConfigError: One is something else.
        OSError: It cannot be looked at.
    """
    for file in (path, image):
        refuse_to_replace(file)
    is_map = False
    if path.exists():
        try:
            is_map = read_description(path).image.parent.resolve() == path.parent.resolve()
        except ConfigError as error:
            raise ConfigError("there is a file that is no map", file=path, valid=["a new name"]) from error
    if image.exists() and not is_map:
        raise ConfigError(
            "there is a file that belongs to no map of this name", file=image, valid=["a new name"]
        )


def _check(path: Path, mode: str, form: str, occupied_thresh: float, free_thresh: float) -> None:
    """Refuse what :func:`save_map` cannot write."""
    if mode not in MODES:
        raise ConfigError(f"the mode {mode!r} is unknown", valid=closest_first(mode, MODES))
    if form not in FORMATS:
        raise ConfigError(f"an image cannot be a {form!r}", valid=closest_first(form, FORMATS))
    if path.suffix not in (".yaml", ".yml"):
        raise ConfigError(f"{str(path)!r} is not a name for a map", valid=[str(path.with_suffix(".yaml"))])
    if not 0.0 <= free_thresh < occupied_thresh <= 1.0:
        raise ConfigError(
            f"the thresholds are {free_thresh:g} (free) and {occupied_thresh:g} (occupied)",
            valid=[f"{FREE_THRESH} and {OCCUPIED_THRESH}"],
        )


def trinary_pixels(cells: NDArray[np.int8]) -> NDArray[np.uint8]:
    """Return the grey values of a map with free, occupied and unknown cells, in the order of the cells."""
    return _pixels(cells, "trinary", OCCUPIED_THRESH, FREE_THRESH)


def _pixels(cells: NDArray[np.int8], mode: str, occupied: float, free: float) -> NDArray[np.uint8]:
    if mode == "raw":
        return np.where(cells == UNKNOWN, 255, cells).astype(np.uint8)
    if mode == "scale":
        # The middle of what is read as this value.
        occupancy = free + (cells - 0.5) / 98.0 * (occupied - free)
        grey = np.rint(255.0 * (1.0 - occupancy))
        grey = np.where(cells == FREE, 255, np.where(cells == OCCUPIED, 0, grey))
        return np.clip(grey, 0, 255).astype(np.uint8)
    grey = np.full(cells.shape, UNKNOWN_GREY, np.uint8)
    grey[(cells >= 0) & (cells <= 100.0 * free)] = _WHITE
    grey[cells >= 100.0 * occupied] = _BLACK
    return grey
