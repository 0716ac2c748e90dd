"""The loops over all pixels of an image, compiled.

Every value that comes from a device is checked before it is used as an index.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from florence_bt.drivers.kinect.codec import FARTHEST_MM, RAW_VALUES

_NOTHING = np.float32(np.nan)


@numba.njit(cache=True)
def metres_of_packed(
    packed: NDArray[np.uint8],
    width: int,
    step: int,
    table: NDArray[np.float32],
    metres: NDArray[np.float32],
) -> None:
    """Unpack 11-bit values and look their distances up.

    Args:
        packed: Big-endian stream of 11-bit values; at least as many as the rows of ``metres`` need.
        width: Values a row.
        step: Take every n-th value of every n-th row.
        table: Metres of each raw value, shape (2048,).
        metres: Is filled, shape (rows, columns).
    """
    rows, columns = metres.shape
    last = packed.size - 1
    for v in range(rows):
        for u in range(columns):
            first_bit = 11 * (v * step * width + u * step)
            byte = first_bit >> 3
            bits = np.uint32(packed[byte]) << np.uint32(16)
            bits |= np.uint32(packed[byte + 1]) << np.uint32(8)
            if byte + 2 <= last:
                bits |= np.uint32(packed[byte + 2])
            metres[v, u] = table[(bits >> np.uint32(13 - (first_bit & 7))) & np.uint32(0x7FF)]


@numba.njit(cache=True)
def metres_of_raw(
    raw: NDArray[np.uint16], step: int, table: NDArray[np.float32], metres: NDArray[np.float32]
) -> None:
    """Look distances up.

    Args:
        raw: Shape (height, width); what is above 2047 counts as nothing measured.
        step: Take every n-th value of every n-th row.
        table: Metres of each raw value, shape (2048,).
        metres: Is filled, shape (height // step, width // step).
    """
    rows, columns = metres.shape
    for v in range(rows):
        for u in range(columns):
            value = raw[v * step, u * step]
            metres[v, u] = table[value] if value < RAW_VALUES else _NOTHING


@numba.njit(cache=True)
def metres_of_millimetres(millimetres: NDArray[np.uint16], step: int, metres: NDArray[np.float32]) -> None:
    """Convert whole millimetres to metres; 0 and more than 10 m mean nothing measured.

    Args:
        millimetres: Shape (height, width).
        step: Take every n-th value of every n-th row.
        metres: Is filled, shape (height // step, width // step).
    """
    rows, columns = metres.shape
    for v in range(rows):
        for u in range(columns):
            value = millimetres[v * step, u * step]
            metres[v, u] = value * np.float32(0.001) if 0 < value <= FARTHEST_MM else _NOTHING


@numba.njit(cache=True)
def fill_points(
    depth: NDArray[np.float32],
    depth_lens: tuple[float, float, float],
    colours: NDArray[np.uint8],
    colour_lens: tuple[float, float, float],
    baseline: float,
    points: NDArray[np.float32],
    packed: NDArray[np.uint32],
) -> None:
    """Fill in the coloured points of a depth image.

    Each point gets the colour of the pixel in which the colour camera would see it.

    Args:
        depth: Shape (height, width), metres; NaN where nothing was measured.
        depth_lens: Focal length, column and row of the optical axis, pixels.
        colours: Shape (rows, columns, 3), red green blue; of another size if need be.
        colour_lens: As depth_lens.
        baseline: How far the colour camera is to the right of the depth camera, metres.
        points: Is filled with x, y, z, shape (height, width, 4); NaN where nothing was measured.
        packed: The same memory as points; the fourth value becomes 0x00RRGGBB, black where the colour
            camera does not look.
    """
    f, cx, cy = depth_lens
    colour_f, colour_cx, colour_cy = colour_lens
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            z = depth[v, u]
            x = (u - cx) / f * z
            y = (v - cy) / f * z
            points[v, u, 0] = x
            points[v, u, 1] = y
            points[v, u, 2] = z
            packed[v, u, 3] = 0
            if not z > 0.0:
                continue
            column = math.floor((x - baseline) / z * colour_f + colour_cx + 0.5)
            row = math.floor(y / z * colour_f + colour_cy + 0.5)
            if 0 <= column < colours.shape[1] and 0 <= row < colours.shape[0]:
                red, green, blue = colours[row, column]
                packed[v, u, 3] = (np.uint32(red) << 16) | (np.uint32(green) << 8) | np.uint32(blue)
