"""People in colour pictures: a learned detector that looks at what the depth detector proposes.

Its network comes from a package registry and is not a part of Florence (``tools/colour_network``).

Source:
    Zhou, Wang, Krähenbühl, Objects as Points, 2019 (CenterNet).
"""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import FlorenceError
from florence_bt.core.sensing import ColourImage
from florence_bt.skills.people.user_tracker.evidence import Candidate, Region, Verdict
from florence_bt.skills.people.user_tracker.parameters import ColourParameters

INSTALL = "make colour"
SIZE = 256
"""Columns and rows that the network is given."""
HEAT, EXTENT = "tower_0/keypoints", "tower_0/wh"
"""Its outputs: how probable each of 80 kinds of things has its middle there; how far it reaches from there to
the left, up, right and down, in pixels of the input."""
HEAT_STRIDE = 4
"""It answers for every fourth column and row."""
PERSON = 0
"""The kind; those of COCO in its order."""

Box = tuple[float, float, float, float]
"""First column, first row, last column, last row, pixels."""


class ColourNetworkUnusable(FlorenceError):
    """The network is not installed, or its file is damaged."""


def network_file() -> Path:
    """Return where the network is installed, for all checkouts of a user."""
    folder = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
    return folder / "florence_bt" / "colour_network" / "centernet.onnx"


class ColourDetector:
    """Says whether a person is where somebody was proposed.

    Args:
        parameters: From when on it says something; the defaults when None.
        file: The network; where it is installed when None.

    Raises:
        ColourNetworkUnusable: With the command that installs it.
    """

    def __init__(self, parameters: ColourParameters | None = None, file: Path | None = None) -> None:
        self._params = parameters or ColourParameters()
        self._network = _read(file or network_file())

    def verdict(self, picture: ColourImage, candidate: Candidate) -> Verdict:
        """Tell what a picture says of a candidate; 30 to 60 ms on one core.

        That nobody is there it says only of what it has seen well: large enough, lit, and not lying. It was
        shown too few people who lie.
        """
        shown = _part(picture.pixels, _box(picture.pixels, candidate.region))
        if max(shown.shape[:2]) < self._params.colour_smallest:
            return Verdict.NONE
        score = self.score(picture.pixels, candidate.region)
        if score >= self._params.colour_person:
            return Verdict.PERSON
        lit = float(shown.max(axis=2).mean()) >= 255 * self._params.colour_darkest
        seen_well = lit and candidate.posture != "lying"
        return Verdict.NOBODY if seen_well and score < self._params.colour_nobody else Verdict.NONE

    def score(self, pixels: NDArray[np.uint8], region: Region) -> float:
        """Tell how sure it is, 0 to 1, that a person fills about this region.

        Args:
            pixels: Shape (rows, columns, 3), red green blue.
            region: Where to look.

        Raises:
            ValueError: The picture has another shape or type.
        """
        if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.dtype != np.uint8 or not pixels.size:
            raise ValueError(
                f"a picture of {pixels.dtype} with the shape {pixels.shape} "
                "(would have worked: uint8 with the shape (rows, columns, 3))"
            )
        wanted = _box(pixels, region)
        around = _around(wanted, self._params.colour_margin, pixels.shape[:2])
        heat, boxes = self._look(_part(pixels, around))
        return float((heat * (_overlap(boxes, _within(wanted, around)) >= self._params.colour_overlap)).max())

    def _look(self, part: NDArray[np.uint8]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return how probable a person is at each place, shape (64, 64), and boxes, shape (4, 64, 64)."""
        shrinks = min(part.shape[:2]) > SIZE
        given = cv2.resize(part, (SIZE, SIZE), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
        self._network.setInput(cv2.dnn.blobFromImage(given))
        (heat,), (extent,) = self._network.forward([HEAT, EXTENT])
        rows, columns = HEAT_STRIDE * np.indices(heat.shape[1:], np.float32)
        left, up, right, down = extent
        boxes = np.stack([columns - left, rows - up, columns + right, rows + down])
        return heat[PERSON], boxes.clip(0, SIZE)


def _read(file: Path) -> cv2.dnn.Net:
    if not file.is_file():
        raise ColourNetworkUnusable(
            f"the network of the colour detector is not installed ({file} does not exist): {INSTALL}, "
            "or colour_detector: false"
        )
    try:
        return cv2.dnn.readNetFromONNX(str(file))
    except cv2.error as error:
        raise ColourNetworkUnusable(
            f"the network of the colour detector is damaged ({file}): {INSTALL} ARGS=--again"
        ) from error


def _box(pixels: NDArray[np.uint8], region: Region) -> Box:
    rows, columns = pixels.shape[:2]
    return region.left * columns, region.top * rows, region.right * columns, region.bottom * rows


def _around(box: Box, margin: float, shape: tuple[int, ...]) -> Box:
    """Return a square around the box, with a margin, moved and cut to stay within the picture."""
    rows, columns = shape
    side = (1.0 + 2.0 * margin) * max(box[2] - box[0], box[3] - box[1])
    width, height = min(side, columns), min(side, rows)
    left = float(np.clip((box[0] + box[2] - width) / 2, 0, columns - width))
    top = float(np.clip((box[1] + box[3] - height) / 2, 0, rows - height))
    return left, top, left + width, top + height


def _part(pixels: NDArray[np.uint8], box: Box) -> NDArray[np.uint8]:
    left, top, right, bottom = (round(each) for each in box)
    return pixels[top : max(bottom, top + 1), left : max(right, left + 1)]


def _within(box: Box, around: Box) -> Box:
    """Return a box in pixels of the input."""
    across, down = SIZE / (around[2] - around[0]), SIZE / (around[3] - around[1])
    left, top = around[:2]
    return (box[0] - left) * across, (box[1] - top) * down, (box[2] - left) * across, (box[3] - top) * down


def _overlap(boxes: NDArray[np.float32], wanted: Box) -> NDArray[np.float32]:
    """Compute intersection over union with a box, of boxes of the shape (4, rows, columns)."""
    left, top, right, bottom = boxes
    width = (np.minimum(right, wanted[2]) - np.maximum(left, wanted[0])).clip(0)
    height = (np.minimum(bottom, wanted[3]) - np.maximum(top, wanted[1])).clip(0)
    both = width * height
    area = (right - left) * (bottom - top) + (wanted[2] - wanted[0]) * (wanted[3] - wanted[1])
    return (both / np.maximum(area - both, 1.0)).astype(np.float32)
