"""Colour histograms of people: how somebody is recognised who was away for a while."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import ColourImage

HUE_BINS, SATURATION_BINS = 16, 8
"""REFERENCE 12.9."""
MINIMUM_VALUE = 0.15
"""Darker or paler pixels have no usable hue (V and S as parts of one); REFERENCE 12.9."""
MINIMUM_PIXELS = 30
"""Pixels of a band that have a colour; fewer say nothing of it. Chosen."""
BANDS = ((0.1, 0.6), (0.6, 1.0), (1.0, 1.5))
"""Heights above the floor, metres: of somebody near by the camera sees the trousers only, of others the shirt
too. Only what both pictures show is compared."""

Histogram = NDArray[np.float32]
"""Shape (3, 16, 8): hue and saturation in each band, sum one; zero where too few pixels have a colour."""


def colour_histogram(
    image: ColourImage,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    shape: tuple[int, int],
    heights: NDArray[np.floating],
) -> Histogram | None:
    """Return the hue and saturation of some pixels, by height.

    Args:
        image: The colour picture.
        rows: Shape (n,), rows of the depth picture.
        columns: Shape (n,), columns of the depth picture.
        shape: Height and width of the depth picture.
        heights: Shape (n,), of what the pixels show, metres above the floor.

    Returns:
        None when too few pixels of every band have a colour.

    Source:
        REFERENCE 12.9, colour model; the bands are our own.
    """
    height, width = image.pixels.shape[:2]
    pixels = image.pixels[rows * height // shape[0], columns * width // shape[1]]
    bands = [_of_band(pixels[(low <= heights) & (heights < high)]) for low, high in BANDS]
    histogram = np.stack(bands)
    return histogram if histogram.any() else None


def _of_band(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the hue and saturation of pixels, shape (n, 3)."""
    unknown = np.zeros((HUE_BINS, SATURATION_BINS), np.float32)
    if len(pixels) < MINIMUM_PIXELS:
        return unknown  # OpenCV refuses an empty picture
    hsv = cv2.cvtColor(pixels.reshape(-1, 1, 3), cv2.COLOR_RGB2HSV)
    coloured = (hsv[..., 1] > MINIMUM_VALUE * 255) & (hsv[..., 2] > MINIMUM_VALUE * 255)
    if int(coloured.sum()) < MINIMUM_PIXELS:
        return unknown
    mask = coloured.astype(np.uint8)
    counts = cv2.calcHist([hsv], [0, 1], mask, [HUE_BINS, SATURATION_BINS], [0, 180, 0, 256])
    return (counts / counts.sum()).astype(np.float32)


def distance_if_known(first: Histogram | None, second: Histogram | None) -> float | None:
    """Return the mean Bhattacharyya distance of bands known in both: 0 equal, 1 disjoint; or None."""
    if first is None or second is None:
        return None
    common = np.flatnonzero(_known(first) & _known(second))
    if not len(common):
        return None
    return float(np.mean([cv2.compareHist(first[k], second[k], cv2.HISTCMP_BHATTACHARYYA) for k in common]))


def blend(old: Histogram, new: Histogram, share: float) -> Histogram:
    """Average histograms, with ``share`` of the new one; keep a band that only one of them knows."""
    both = (_known(old) & _known(new))[:, None, None]
    return np.where(both, (1.0 - share) * old + share * new, old + new).astype(np.float32)


def _known(histogram: Histogram) -> NDArray[np.bool_]:
    """Tell which bands say something, shape (3,)."""
    return np.any(histogram > 0.0, axis=(1, 2))
