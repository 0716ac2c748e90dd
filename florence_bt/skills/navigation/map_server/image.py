"""The images of ROS maps: graymaps, PNG and BMP. Bytes to grey values and opacity, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import FrameError
from florence_bt.skills.navigation.map_server.pgm import decode_pgm, encode_pgm

FORMATS = ("pgm", "png", "bmp")
"""The endings of the images that are read and written."""
_PNG, _PNG_END = b"\x89PNG", b"IEND"


def decode_image(data: bytes) -> tuple[NDArray[np.uint8], NDArray[np.uint8] | None]:
    """Read an image, of whichever format its bytes are.

    Args:
        data: The whole file.

    Returns:
        The grey values (of colours their mean) and the opacity, None when the image has none. Shape (rows,
        columns), row 0 at the top, 0..255.

    Raises:
        FrameError: The bytes are not a whole image.
    """
    if data[:2] in (b"P5", b"P2"):
        return decode_pgm(data), None
    import cv2  # here: most maps are graymaps, and it is slow to load

    # OpenCV fills what is missing of a cut file with black, which would be walls.
    cut = data.startswith(_PNG) and _PNG_END not in data[-12:]
    image = None if cut or not data else cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        whole = "ends too early" if cut else "is neither a graymap (P5, P2) nor a PNG or BMP image"
        raise FrameError(f"the image {whole}")
    if image.dtype == np.uint16:
        image = image // 257
    if image.ndim == 2:
        return image.astype(np.uint8), None
    grey = np.rint(image[..., :3].mean(axis=2)).astype(np.uint8)
    return grey, image[..., 3].astype(np.uint8) if image.shape[2] == 4 else None


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
