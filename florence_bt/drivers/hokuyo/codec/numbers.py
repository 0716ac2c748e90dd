"""Check sums, and numbers of six bits a character. Source: REFERENCE 4.3, 4.4."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import FrameError


def check_sum(text: bytes) -> int:
    """The check character of a line, as a byte value. Source: REFERENCE 4.3."""
    return (sum(text) & 0x3F) + 0x30


def decode_values(characters: bytes, width: int) -> NDArray[np.int32]:
    """Decode numbers of 6 bits a character, most significant first.

    Args:
        characters: Length a multiple of ``width``.
        width: Characters a number: 2, 3 or 4.

    Returns:
        Shape (len(characters) / width,).

    Raises:
        FrameError: The length does not fit, or a character is none of the 64 allowed.

    Source: REFERENCE 4.4.
    """
    if len(characters) % width:
        raise FrameError(f"{len(characters)} characters do not make numbers of {width} characters")
    # Below '0' the subtraction wraps to 208 and more, so one comparison finds both kinds of bad character.
    digits = np.frombuffer(characters, np.uint8) - np.uint8(0x30)
    if digits.size and digits.max() > 0x3F:
        raise FrameError("a character outside '0'..'o' cannot be part of a number")
    columns = digits.reshape(-1, width).astype(np.int32)
    values = columns[:, 0]
    for place in range(1, width):
        values = (values << 6) | columns[:, place]
    return values
