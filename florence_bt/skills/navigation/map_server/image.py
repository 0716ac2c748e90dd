"""The images of ROS maps: graymaps, PNG and BMP. Bytes to grey values and opacity, and back."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import FrameError
from florence_bt.core.sensing import MAX_MAP_CELLS
from florence_bt.skills.navigation.map_server.pgm import decode_pgm, encode_pgm, size_of_pgm

FORMATS = ("pgm", "png", "bmp")
"""The endings of the images that are read and written."""
MAX_IMAGE_BYTES = 5 * MAX_MAP_CELLS
"""A plain graymap needs up to four bytes a pixel, a BMP image with opacity four."""
_GRAYMAPS, _PNG, _PNG_END, _BMP = (b"P5", b"P2"), b"\x89PNG\r\n\x1a\n", b"IEND", b"BM"


def decode_image(data: bytes) -> tuple[NDArray[np.uint8], NDArray[np.uint8] | None]:
    """Read an image, of whichever format its bytes are.

    Args:
        data: The whole file.

    Returns:
        The grey values (of colours their mean) and the opacity, None when the image has none. Shape (rows,
        columns), row 0 at the top, 0..255.

    Raises:
        FrameError: The bytes are not a whole image, or it has more pixels than a map may have cells.
    """
    width, height = size_of_image(data)
    if width * height > MAX_MAP_CELLS:
        raise FrameError(f"the image has {width} x {height} pixels, at most {MAX_MAP_CELLS} are read")
    if data[:2] in _GRAYMAPS:
        return decode_pgm(data), None
    import cv2  # here: most maps are graymaps, and it is slow to load

    # OpenCV fills what is missing of a cut file with black, which would be walls.
    cut = data.startswith(_PNG) and _PNG_END not in data[-12:]
    image = None if cut else cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise FrameError("the image ends too early" if cut else "the image is damaged")
    if image.dtype == np.uint16:
        image = image // 257
    if image.ndim == 2:
        return image.astype(np.uint8), None
    grey = np.rint(image[..., :3].mean(axis=2)).astype(np.uint8)
    return grey, image[..., 3].astype(np.uint8) if image.shape[2] == 4 else None


def size_of_image(data: bytes) -> tuple[int, int]:
    """Read the width and height that an image says it has, in pixels, without decoding it.

    Raises:
        FrameError: It is of no format that is read, or ends before it says so.

    Source:
        PNG (W3C), section 11.2.1; BMP: BITMAPCOREHEADER and BITMAPINFOHEADER, whose height is negative when
        the first row is the top one.
    """
    if data[:2] in _GRAYMAPS:
        return size_of_pgm(data)
    if data.startswith(_PNG):
        places = (16, 20), (20, 24)
    elif data.startswith(_BMP):
        core = int.from_bytes(data[14:18], "little") == 12
        places = ((18, 20), (20, 22)) if core else ((18, 22), (22, 26))
    else:
        raise FrameError("the image is neither a graymap (P5, P2) nor a PNG or BMP image")
    if len(data) < 26:
        raise FrameError("the image ends too early")
    order: Literal["big", "little"] = "big" if data.startswith(_PNG) else "little"
    width, height = (int.from_bytes(data[a:b], order, signed=b - a == 4) for a, b in places)
    return abs(width), abs(height)


def encode_image(grey: NDArray[np.uint8], opacity: NDArray[np.uint8] | None, form: str) -> bytes:
    """Write an image.

    Args:
        grey: Shape (rows, columns), row 0 at the top.
        opacity: The same shape, None for an image without; only PNG can hold it.
        form: One of :data:`FORMATS`.
    """
    if form == "pgm":
        return encode_pgm(grey)
    import cv2

    image = grey if opacity is None else np.dstack([grey, grey, grey, opacity])
    done, data = cv2.imencode(f".{form}", image)
    assert done, "OpenCV writes every image of bytes"
    return data.tobytes()
