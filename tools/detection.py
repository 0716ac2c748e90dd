"""Measures how well people are found in single depth pictures, of generated homes or labelled at home.

``python tools/detection.py --homes 60 --write docs/notes/people.md``
``python tools/detection.py --recorded kitchen sofa``
"""

from __future__ import annotations

import argparse
import itertools
import math
import statistics
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.core.errors import FlorenceError
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.generate import generated_flat
from florence_bt.simulation.rig.drawn_people import kind_of
from florence_bt.skills.people.user_tracker.detector import Detection, detect_people
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.person_network import POSTURES
from tools.person_network.pictures import Picture, pictures_of_home, posture_of
from tools.processes import processes
from tools.recorded_pictures import Truth, recorded_pictures
from tools.tables import RowTable, command_of, table

FIRST_SEED = 3000
"""Neither the training of the network nor the trials use the homes from here on."""

SCENES, EMPTY_SHARE = 6, 0.5
"""Times that people are placed in a home; the part of the homes with pictures without people."""

MATCH_M, LYING_MATCH_M = 0.5, 0.8
"""A detection this near to a person is that person."""

DISTANCES = ((0.6, 1.0), (1.0, 2.0), (2.0, 3.0), (3.0, 4.0))
HIDDEN = (("in full view", 0.8, 1.01), ("20 to 40 % hidden", 0.6, 0.8), ("40 to 60 % hidden", 0.4, 0.6))
"""Name, and from which share of the pixels to which one is seen."""

SMALLEST_PIXELS = 150
"""Whoever has fewer pixels when nothing is in front of them is at the very edge, and not asked for."""


PICTURE, PERSON, NOBODY = "picture", "person", "nobody"
UNKNOWN = "unknown"
"""The posture of somebody whom the picture cuts above."""


@dataclass(frozen=True, slots=True)
class Line:
    """A picture, a person in it, or a detection that is nobody.

    Attributes:
        home: Its seed, or which recording it is.
        number: Of the picture.
        empty: Whether it is one of those without people.
        what: ``picture``, ``person`` or ``nobody``.
        kind: What the person does.
        distance: From the camera to the middle of the person, or to what was taken for one, metres.
        shown: Share of the person's pixels that nothing hides.
        error: Metres between the detection and the middle of the person; None when not found.
        posture: What was found.
        posture_right: Whether it is the person's.
    """

    home: int
    number: int
    empty: bool
    what: str
    kind: str = ""
    distance: float | None = None
    shown: float | None = None
    error: float | None = None
    posture: str = ""
    posture_right: bool = False


def truth_of(picture: Picture) -> Truth:
    """Return who is where in a picture of a simulated home, in its robot frame."""
    robot = picture.robot.inverse()
    people = [(spec, robot.apply(spec.pose.x, spec.pose.y)) for spec in picture.people]
    shown = [
        int((picture.owner == index).sum()) / whole if whole >= SMALLEST_PIXELS else None
        for index, whole in enumerate(picture.whole)
    ]
    return Truth(picture.optical_in_base.translation, people, shown)


def judge(
    truth: Truth, found: Sequence[Detection], home: int = 0, number: int = 0, *, empty: bool
) -> list[Line]:
    """Compare what was found in a picture with who was there."""
    line = partial(Line, home, number, empty)
    lines, left = [line(PICTURE)], list(found)
    for (spec, at), shown in zip(truth.people, truth.shown, strict=True):
        limit = LYING_MATCH_M if spec.posture == "lying" else MATCH_M
        near = [(math.dist(at, (each.x, each.y)), place) for place, each in enumerate(left)]
        error, place = min(near, default=(math.inf, -1))
        matched = left.pop(place) if error <= limit else None
        if shown is None:
            continue
        posture = matched.posture if matched else ""
        right = matched is not None and posture == POSTURES[posture_of(spec)]
        distance = math.dist(truth.camera[:2], at)
        lines.append(line(PERSON, kind_of(spec), distance, shown, error if matched else None, posture, right))
    for each in left:
        away = math.dist(truth.camera[:2], (each.x, each.y))
        lines.append(line(NOBODY, distance=away, posture=each.posture))
    return lines


def judge_home(seed: int, count: int, *, empty: bool) -> list[Line]:
    """Judge the pictures of a home."""
    known = KnownObstacles(laser_map(generated_flat(seed)))
    pictures = pictures_of_home(seed, count, scenes=SCENES, width=320, bent=False, empty=empty)
    return [
        line
        for number, each in enumerate(pictures)
        for line in judge(
            truth_of(each),
            detect_people(each.depth, each.optical_in_base, known=known, robot=each.robot),
            seed,
            number,
            empty=empty,
        )
    ]


def judge_recording(folder: Path, home: int = 0) -> list[Line]:
    """Judge the pictures of a recording.

    Raises:
        FlorenceError: The folder is not a recording, or its labels cannot be used.
    """
    return [
        line
        for number, (depth, mount, truth) in enumerate(recorded_pictures(folder))
        for line in judge(truth, detect_people(depth, mount), home, number, empty=not truth.people)
    ]


def recall(people: Iterable[Line]) -> str:
    """Write how many of some people were found, as a cell of the table."""
    found = [each.error is not None for each in people]
    return f"{100 * sum(found) / len(found):.0f} % of {len(found)}" if found else ""


def rows(people: Sequence[Line]) -> Iterator[tuple[str, ...]]:
    """Yield a row for each kind and hiding."""
    kinds = sorted({each.kind for each in people})
    for name, low, high in HIDDEN:
        mine = [each for each in people if low <= (each.shown or 0.0) < high]
        for kind in [*kinds, "all"]:
            of = [each for each in mine if kind in ("all", each.kind)]
            cells = (recall(each for each in of if a <= (each.distance or 0.0) < b) for a, b in DISTANCES)
            yield f"{kind}, {name}", *cells


def report(lines: Sequence[Line]) -> str:
    """Write all results as Markdown."""
    people = [each for each in lines if each.what == PERSON]
    errors = sorted(each.error for each in people if each.error is not None)
    found = [each for each in people if each.error is not None]
    head = ("", *(f"{a:g} to {b:g} m" for a, b in DISTANCES))

    def count(what: str, *, empty: bool) -> int:
        return sum((each.what, each.empty) == (what, empty) for each in lines)

    text = (
        f"Of {count(PICTURE, empty=False)} pictures with people {count(NOBODY, empty=False)} detections were "
        f"nobody; of {count(PICTURE, empty=True)} pictures without people {count(NOBODY, empty=True)}."
    )
    if errors:
        text += (
            f" Position: {100 * statistics.median(errors):.0f} cm off (median), "
            f"{100 * errors[int(0.95 * len(errors))]:.0f} cm (95 %). "
            f"{posture_text(found)}"
        )
    return f"{table(head, rows(people))}\n\n{text}"


def posture_text(found: Sequence[Line]) -> str:
    """Write how often the posture of those who were found was right, not told, and wrong."""
    right = sum(each.posture_right for each in found)
    unknown = sum(each.posture == UNKNOWN for each in found)
    shares = (100 * count / len(found) for count in (right, unknown, len(found) - right - unknown))
    return "The posture was right for {:.0f} %, not told for {:.0f} %, wrong for {:.0f} %.".format(*shares)


TABLE = RowTable("detection", Line, report)


def of_homes(given: argparse.Namespace) -> list[Line]:
    """Judge the pictures of generated homes."""
    seeds = range(given.first, given.first + given.homes)
    with processes(given.jobs) as pool:
        full = pool.map(partial(judge_home, count=given.pictures, empty=False), seeds)
        empty = pool.map(
            partial(judge_home, count=given.pictures, empty=True), seeds[: round(EMPTY_SHARE * given.homes)]
        )
        return [line for lines in itertools.chain(full, empty) for line in lines]


def main(arguments: Sequence[str] | None = None) -> int:
    """Look at pictures and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--homes", type=int, default=60, help="homes with people; half as many without")
    parser.add_argument("--pictures", type=int, default=60, help="pictures of each home")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed of a home")
    parser.add_argument("--jobs", type=int, default=2, help="homes at a time, each on a core")
    parser.add_argument(
        "--recorded",
        type=Path,
        nargs="+",
        metavar="FOLDER",
        help="recordings of `florence kinect record` with a labels.yaml, instead of homes",
    )
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the table between the marks of this page"
    )
    given = parser.parse_args(arguments)
    if given.recorded and given.write:
        parser.error("--write is for the table of the generated homes")
    try:
        if given.recorded:
            lines = [
                line
                for number, folder in enumerate(given.recorded)
                for line in judge_recording(folder, number)
            ]
        else:
            lines = of_homes(given)
    except FlorenceError as error:
        print(error, file=sys.stderr)
        return 2
    TABLE.publish(lines, given.write, command_of("tools/detection.py", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
