"""Writes map files, as the map saver of ROS does: for the tests of what reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import OccupancyGrid


def save_map(grid: OccupancyGrid, path: str | Path) -> None:
    """Write a map: the YAML file and, beside it, the picture of the same name.

    Cells from 65 on become occupied, cells to 19 free, the rest unknown, as the map saver of ROS does.

    Args:
        grid: The map.
        path: The YAML file; the picture gets the ending ``.pgm``.

    Source:
        REFERENCE 7.8.
    """
    path = Path(path)
    pixels = np.full(grid.cells.shape, 205, np.uint8)
    pixels[(grid.cells >= 0) & (grid.cells < 20)] = 254
    pixels[grid.cells >= 65] = 0
    picture = path.with_suffix(".pgm")
    description = (
        f"image: {picture.name}\nmode: trinary\nresolution: {grid.resolution!r}\n"
        f"origin: [{grid.origin.x!r}, {grid.origin.y!r}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    picture.write_bytes(encode_pgm(np.flipud(pixels), f"{grid.resolution:g} m per pixel"))
    path.write_text(description, encoding="utf-8")


def encode_pgm(image: NDArray[np.uint8], comment: str = "") -> bytes:
    """Write a binary graymap.

    Args:
        image: Shape (rows, columns), row 0 at the top.
        comment: One line for people.
    """
    rows, columns = image.shape
    note = f"# {comment}\n" if comment else ""
    return f"P5\n{note}{columns} {rows}\n255\n".encode() + image.astype(np.uint8).tobytes()
