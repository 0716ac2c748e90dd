"""How well people are found in single depth pictures, of generated homes or recorded and labelled at home.

``python tools/detection.py --homes 60 --write docs/notes/people.md``
``python tools/detection.py --recorded kitchen sofa``
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from florence_bt.core.errors import FlorenceError
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.generate import generated_flat
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.skills.people.user_tracker.detector import Detection, detect_people
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.person_network import POSTURES
from tools.person_network.pictures import Picture, pictures_of_home, posture_of
from tools.recorded_pictures import Truth, recorded_pictures
from tools.tables import table, write_between_marks

FIRST_SEED = 3000
"""Neither the training of the network nor the trials use the homes from here on."""

SCENES, EMPTY_SHARE = 6, 0.5
"""How often people are placed in a home; for how many of the homes there are pictures without people."""

MATCH_M, LYING_MATCH_M = 0.5, 0.8
"""A detection this near to a person is that person."""

DISTANCES = ((0.6, 1.0), (1.0, 2.0), (2.0, 3.0), (3.0, 4.0))
HIDDEN = (("in full view", 0.8, 1.01), ("20 to 40 % hidden", 0.6, 0.8), ("40 to 60 % hidden", 0.4, 0.6))
"""Name, and from which share of the pixels to which one is seen."""

SMALLEST_PIXELS = 150
"""Whoever has fewer pixels when nothing is in front of them is at the very edge, and not asked for."""


@dataclass(frozen=True, slots=True)
class Seen:
    """One person in one picture.

    Attributes:
        kind: What the person does.
        distance: From the camera to the middle of the person, metres.
        shown: Share of their pixels that nothing hides.
        error: Metres between the detection and the middle of the person; None when not found.
        posture_right: Whether the posture was right.
    """

    kind: str
    distance: float
    shown: float
    error: float | None
    posture_right: bool


@dataclass(frozen=True, slots=True)
class Judged:
    """The findings in one picture: the people, and the detections that are nobody."""

    people: tuple[Seen, ...]
    wrong: int


def truth_of(picture: Picture) -> Truth:
    """Return who is where in a picture of a simulated home, in its robot frame."""
    robot = picture.robot.inverse()
    people = [(spec, robot.apply(spec.pose.x, spec.pose.y)) for spec in picture.people]
    shown = [
        int((picture.owner == index).sum()) / whole if whole >= SMALLEST_PIXELS else None
        for index, whole in enumerate(picture.whole)
    ]
    return Truth(picture.optical_in_base.translation, people, shown)


def judge(truth: Truth, found: Sequence[Detection]) -> Judged:
    """Compare what was found with who was there."""
    left = list(found)
    people = []
    for (spec, at), shown in zip(truth.people, truth.shown, strict=True):
        limit = LYING_MATCH_M if spec.posture == "lying" else MATCH_M
        near = [(math.dist(at, (each.x, each.y)), number) for number, each in enumerate(left)]
        error, number = min(near, default=(math.inf, -1))
        matched = left.pop(number) if error <= limit else None
        if shown is None:
            continue
        right = matched is not None and matched.posture == POSTURES[posture_of(spec)]
        distance = math.dist(truth.camera[:2], at)
        people.append(Seen(kind_of(spec), distance, shown, error if matched else None, right))
    return Judged(tuple(people), len(left))


def kind_of(spec: PersonSpec) -> str:
    """Return the row of the table that a person belongs to."""
    if spec.aid != "none":
        return f"with a {spec.aid}"
    if spec.posture == "lying":
        return "lying in bed" if spec.surface > 0.0 else "lying on the floor"
    if spec.posture in ("seated", "sitting"):
        return "sitting"
    if spec.posture == "leaning":
        return "bent over"
    return "child up to 1.3 m, standing" if spec.height < 1.3 else "standing"


def judge_home(seed: int, count: int, *, empty: bool) -> list[Judged]:
    """Judge the pictures of a home."""
    known = KnownObstacles(laser_map(generated_flat(seed)))
    pictures = pictures_of_home(seed, count, scenes=SCENES, width=320, bent=False, empty=empty)
    return [
        judge(truth_of(each), detect_people(each.depth, each.optical_in_base, known=known, robot=each.robot))
        for each in pictures
    ]


def judge_recording(folder: Path) -> tuple[list[Judged], list[Judged]]:
    """Judge the pictures of a recording with people, and those without.

    Raises:
        FlorenceError: The folder is not a recording, or its labels cannot be used.
    """
    full: list[Judged] = []
    empty: list[Judged] = []
    for depth, mount, truth in recorded_pictures(folder):
        (full if truth.people else empty).append(judge(truth, detect_people(depth, mount)))
    return full, empty


def recall(people: Iterable[Seen]) -> str:
    """Write how many of some people were found, as a cell of the table."""
    found = [each.error is not None for each in people]
    return f"{100 * sum(found) / len(found):.0f} % of {len(found)}" if found else ""


def rows(people: Sequence[Seen]) -> Iterator[tuple[str, ...]]:
    """Yield a row for each kind and hiding."""
    kinds = sorted({each.kind for each in people})
    for name, low, high in HIDDEN:
        mine = [each for each in people if low <= each.shown < high]
        for kind in [*kinds, "all"]:
            of = [each for each in mine if kind in ("all", each.kind)]
            cells = (recall(each for each in of if a <= each.distance < b) for a, b in DISTANCES)
            yield f"{kind}, {name}", *cells


def report(full: Sequence[Judged], empty: Sequence[Judged]) -> str:
    """Write all results as Markdown."""
    people = [each for judged in full for each in judged.people]
    errors = sorted(each.error for each in people if each.error is not None)
    right = [each.posture_right for each in people if each.error is not None]
    head = ("", *(f"{a:g} to {b:g} m" for a, b in DISTANCES))
    wrong = sum(judged.wrong for judged in full)
    text = (
        f"Of {len(full)} pictures with people {wrong} detections were nobody; of {len(empty)} pictures "
        f"without people {sum(judged.wrong for judged in empty)}."
    )
    if errors:
        text += (
            f" Position: {100 * statistics.median(errors):.0f} cm off (median), "
            f"{100 * errors[int(0.95 * len(errors))]:.0f} cm (95 %). "
            f"The posture was right for {100 * sum(right) / len(right):.0f} %."
        )
    return f"{table(head, rows(people))}\n\n{text}"


def of_recordings(folders: Sequence[Path]) -> str:
    """Write the report on recordings."""
    judged = [judge_recording(folder) for folder in folders]
    return report(
        [each for full, _ in judged for each in full], [each for _, empty in judged for each in empty]
    )


def of_homes(given: argparse.Namespace) -> str:
    """Write the report on generated homes."""
    seeds = range(given.first, given.first + given.homes)
    with ProcessPoolExecutor(given.jobs) as pool:
        full = pool.map(partial(judge_home, count=given.pictures, empty=False), seeds)
        empty = pool.map(
            partial(judge_home, count=given.pictures, empty=True), seeds[: round(EMPTY_SHARE * given.homes)]
        )
        return report([each for home in full for each in home], [each for home in empty for each in home])


def main() -> int:
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
    given = parser.parse_args()
    if given.recorded and given.write:
        parser.error("--write is for the table of the generated homes")
    try:
        text = of_recordings(given.recorded) if given.recorded else of_homes(given)
    except FlorenceError as error:
        print(error, file=sys.stderr)
        return 2
    print(text)
    if given.write:
        write_between_marks(given.write, "detection", text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
