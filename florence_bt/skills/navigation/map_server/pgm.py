"""Portable graymap files: the images that ROS maps are kept in. Bytes in, an array out, and back."""

from __future__ import annotations

import re
import warnings

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import FrameError

# A number after any white space and comments ("#" to the end of the line).
_NUMBER = re.compile(rb"(?:\s|#[^\n]*\n)*(\d{1,9})(?!\d)")
_COMMENT = re.compile(rb"#[^\n]*")


def decode_pgm(data: bytes) -> NDArray[np.uint8]:
    """Read a binary (P5) or plain (P2) graymap.

    Args:
        data: The whole file.

    Returns:
        Shape (rows, columns), row 0 at the top of the image, scaled to 0..255.

    Raises:
        FrameError: The bytes are not a graymap, or too few.

    Source:
        Netpbm, pgm(5).
    """
    magic = data[:2]
    (width, height, greatest), position = _header(data)
    if width == 0 or height == 0 or not 0 < greatest < 65536:
        raise FrameError(f"an image of {width} x {height} pixels with values to {greatest} cannot be read")
    pixels = _binary(data, position, width * height, greatest) if magic == b"P5" else _plain(data, position)
    if len(pixels) < width * height:
        raise FrameError(f"the image has {len(pixels)} pixels, its header says {width} x {height}")
    image = pixels[: width * height].reshape(height, width)
    if int(image.max()) > greatest:
        raise FrameError(
            f"a pixel has the value {int(image.max())}, the header's greatest value is {greatest}"
        )
    return (
        image.astype(np.uint8)
        if greatest == 255
        else (image.astype(np.int64) * 255 // greatest).astype(np.uint8)
    )


def size_of_pgm(data: bytes) -> tuple[int, int]:
    """Read the width and height that a graymap says it has, in pixels.

    Raises:
        FrameError: As :func:`decode_pgm`.
    """
    (width, height, _), _ = _header(data)
    return width, height


def _header(data: bytes) -> tuple[tuple[int, int, int], int]:
    """Read width, height and greatest value, and where the header ends."""
    if data[:2] not in (b"P5", b"P2"):
        raise FrameError("the image does not begin with P5 or P2")
    position, numbers = 2, []
    for name in ("width", "height", "greatest value"):
        match = _NUMBER.match(data, position)
        if match is None:
            raise FrameError(f"the image's {name} is missing")
        numbers.append(int(match[1]))
        position = match.end()
    width, height, greatest = numbers
    return (width, height, greatest), position


def _binary(data: bytes, position: int, count: int, greatest: int) -> NDArray[np.int64]:
    # Exactly one white space stands between the header and the pixels.
    width = 1 if greatest < 256 else 2
    raw = data[position + 1 : position + 1 + count * width]
    return np.frombuffer(raw[: len(raw) // width * width], np.uint8 if width == 1 else ">u2").astype(np.int64)


def _plain(data: bytes, position: int) -> NDArray[np.int64]:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # how NumPy says that a text is no number
        try:
            return np.fromstring(_COMMENT.sub(b"", data[position:]), np.int64, sep=" ")
        except (DeprecationWarning, ValueError) as error:
            raise FrameError("a pixel is not a number") from error


def encode_pgm(image: NDArray[np.uint8]) -> bytes:
    """Write a binary graymap.

    Args:
        image: Shape (rows, columns), row 0 at the top.
    """
    rows, columns = image.shape
    return f"P5\n{columns} {rows}\n255\n".encode("ascii") + np.ascontiguousarray(image).tobytes()
