"""Colour histograms of people: how somebody is recognised who was away for a while."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import ColourImage

HUE_BINS, SATURATION_BINS = 16, 8
MINIMUM_VALUE = 0.15
"""Darker or paler pixels have no usable hue (V and S as parts of one); REFERENCE 12.9."""
MINIMUM_PIXELS = 30

Histogram = NDArray[np.float32]


def colour_histogram(
    image: ColourImage, rows: NDArray[np.int64], columns: NDArray[np.int64], shape: tuple[int, int]
) -> Histogram | None:
    """The hue and saturation of some pixels.

    Args:
        image: The colour picture.
        rows: Shape (n,), rows of the depth picture.
        columns: Shape (n,), columns of the depth picture.
        shape: Height and width of the depth picture.

    Returns:
        Shape (16, 8), sum one; None when too few pixels have a colour.

    Source:
        REFERENCE 12.9, colour model.
    """
    if len(rows) < MINIMUM_PIXELS:
        return None  # OpenCV refuses an empty picture
    height, width = image.pixels.shape[:2]
    pixels = image.pixels[rows * height // shape[0], columns * width // shape[1]]
    hsv = cv2.cvtColor(pixels.reshape(-1, 1, 3), cv2.COLOR_RGB2HSV)
    coloured = (hsv[..., 1] > MINIMUM_VALUE * 255) & (hsv[..., 2] > MINIMUM_VALUE * 255)
    if int(coloured.sum()) < MINIMUM_PIXELS:
        return None
    mask = coloured.astype(np.uint8)
    histogram = cv2.calcHist([hsv], [0, 1], mask, [HUE_BINS, SATURATION_BINS], [0, 180, 0, 256])
    return histogram / np.float32(histogram.sum())


def histogram_distance(first: Histogram, second: Histogram) -> float:
    """Bhattacharyya distance of two histograms: 0 the same, 1 nothing in common."""
    return float(cv2.compareHist(first, second, cv2.HISTCMP_BHATTACHARYYA))


def distance_if_known(first: Histogram | None, second: Histogram | None) -> float | None:
    """As :func:`histogram_distance`; None when one of the two is not known."""
    return None if first is None or second is None else histogram_distance(first, second)


def blend(old: Histogram, new: Histogram, share: float) -> Histogram:
    """A running average of histograms: ``share`` of the new one."""
    return ((1.0 - share) * old + share * new).astype(np.float32)
