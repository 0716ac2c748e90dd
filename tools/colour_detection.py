"""Measures how well the colour detector tells people from other things in real photographs.

``make colour ARGS=--photographs``, then ``python tools/colour_detection.py --write docs/notes/people.md``.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.core.errors import FlorenceError
from florence_bt.core.sensing import CameraModel, ColourImage
from florence_bt.skills.people.user_tracker.colour_detector import Box, ColourDetector
from florence_bt.skills.people.user_tracker.evidence import Candidate, Region, Verdict
from tools.colour_network.photographs import EMPTY, WITH_PEOPLE, Photograph, read
from tools.tables import RowTable, command_of, table

PROPOSALS = 12
"""Regions of the shape of a person that are proposed in each empty photograph."""


@dataclass(frozen=True, slots=True)
class Looked:
    """The opinion on one proposal.

    Attributes:
        photograph: Its name, and the package that has it.
        people: Whether it shows people.
        verdict: Of the detector.
        seconds: How long it took, processor time.
    """

    photograph: str
    people: bool
    verdict: Verdict
    seconds: float


def colour_image(pixels: NDArray[np.uint8]) -> ColourImage:
    """Make a picture as the detector wants it."""
    rows, columns = pixels.shape[:2]
    return ColourImage(0.0, "", CameraModel(columns, rows, columns, columns, columns / 2, rows / 2), pixels)


def region_of(box: Box, pixels: NDArray[np.uint8]) -> Region:
    """Convert a box in pixels to a region."""
    rows, columns = pixels.shape[:2]
    return Region(box[0] / columns, box[1] / rows, box[2] / columns, box[3] / rows)


def proposals(pixels: NDArray[np.uint8], count: int, seed: int = 1) -> list[Region]:
    """Propose regions of the shape of somebody upright, anywhere in a picture."""
    rows, columns = pixels.shape[:2]
    draw = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        height = rows * draw.uniform(0.4, 1.0)
        width = min(columns, height * draw.uniform(0.3, 0.6))
        left, top = draw.uniform(0, columns - width), draw.uniform(0, rows - height)
        found.append(region_of((left, top, left + width, top + height), pixels))
    return found


def look(detector: ColourDetector, photograph: Photograph) -> list[Looked]:
    """Propose the people of a photograph, or regions anywhere in an empty one."""
    pixels = read(photograph)
    regions = [region_of(box, pixels) for box in photograph.people] or proposals(pixels, PROPOSALS)
    looked = []
    for region in regions:
        begin = time.process_time()
        verdict = detector.verdict(colour_image(pixels), Candidate(0, region, "standing"))
        looked.append(
            Looked(
                f"{photograph.name} ({photograph.package})",
                bool(photograph.people),
                verdict,
                time.process_time() - begin,
            )
        )
    return looked


SAID = ("proposed", *(f"said: {each.value}" for each in Verdict))


def said(looked: Sequence[Looked]) -> list[str]:
    """Count how often the detector was asked, and how often it said what."""
    return [str(len(looked)), *(str(sum(each.verdict is verdict for each in looked)) for verdict in Verdict)]


def report(looked: Sequence[Looked]) -> str:
    """Write the totals as Markdown."""
    rows = []
    for what, shows_people in (("people", True), ("nobody", False)):
        mine = [each for each in looked if each.people is shows_people]
        rows.append((what, str(len({each.photograph for each in mine})), *said(mine)))
    times = [each.seconds for each in looked]
    return "\n\n".join(
        (
            table(("what they show", "photographs", *SAID), rows),
            f"{1000 * statistics.median(times):.0f} ms of one core for each proposal "
            f"(median of {len(times)}).",
        )
    )


TABLE = RowTable("colour", Looked, report)


def main(arguments: Sequence[str] | None = None) -> int:
    """Look at the photographs and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the totals between the marks of this page"
    )
    given = parser.parse_args(arguments)
    cv2.setNumThreads(1)
    try:
        detector = ColourDetector()
        looked = [each for photograph in (*WITH_PEOPLE, *EMPTY) for each in look(detector, photograph)]
    except FlorenceError as error:
        print(error, file=sys.stderr)
        return 1
    TABLE.publish(looked, given.write, command_of("tools/colour_detection.py", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
