"""Answers of the network for people to a picture of the rig, drawn from how well it does, without it.

A mode for large numbers of runs. Which pixels of the picture show a person is known in a simulation; whether
the network would notice them is drawn, by what they do, how far they are and how much of them nothing hides,
from the shares that ``tools/detection.py`` has measured (docs/notes/people.md, "How well"). So are the error
of their middle, and what is taken for a person where nobody is. All that follows in the detector, such as
what the map says of the place or a body that the picture cuts, and in the tracker is what the robot has.

Of two pictures from nearly the same place the second says nearly the same: what is drawn belongs to a view,
and changes when the camera or the person has moved on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import DepthImage
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor
from florence_bt.simulation.sensors.people_view import PeopleView
from florence_bt.skills.people.user_tracker.person_network import POSTURES, STRIDE, NetworkOutput, Pixels

FILE = Path(__file__).parent / "drawn_people.yaml"
SHOWN, DISTANCES = (0.0, 0.2, 0.4, 0.6, 0.8), (0.0, 1.0, 2.0, 3.0, 4.0)
"""From which share that is shown, and from which distance in metres, the cells of the table are."""
ENOUGH = 10.0
"""A cell with so many people counts as much as all kinds of people together. Chosen."""
SMALLEST_PIXELS = 150 / 16
"""Whoever has fewer pixels of the network's answers is at the very edge, and not in the table."""
SAME_VIEW_M, SAME_VIEW_RAD = 0.25, 0.2
"""Camera and person have moved on from there. Chosen."""
SAME = 0.9
"""Of the variance between pictures so much is between views, and the rest between two pictures of one.
Chosen: a robot that stands sees the same picture but for the noise of the depths."""
CONFIDENCE = (0.78, 0.84, 0.94, 0.97, 0.98)
DOUBTFUL = (0.68, 0.73, 0.78, 0.81, 0.88)
"""5, 25, 50, 75 and 95 % of the confidences in who was there and of those in who was not, of 160 and 11
detections in homes 5000 to 5013."""
WRONG_POSTURE = 0.01
"""docs/notes/people.md."""
MISTAKEN_M = 0.3
"""Half the breadth of what is taken for a person."""
_NEAREST_M, _FARTHEST_M = 0.6, 4.3
"""Distances of what is taken for a person. Chosen: about the range of the Kinect (REFERENCE 5.2)."""
_NORMAL = NormalDist()


@dataclass(frozen=True, slots=True)
class Shares:
    """Rates at which people are found.

    Attributes:
        found: Kind -> shape (shown, distances, 2): people, and how many of them were found.
        errors: Kind -> metres between the middle of who was found and the truth, at even steps to 100 %.
        mistaken: Of a picture without and of one with people: the chance that nobody is taken for somebody.
    """

    found: Mapping[str, NDArray[np.float64]]
    errors: Mapping[str, Sequence[float]]
    mistaken: tuple[float, float]

    def chance(self, kind: str, shown: float, distance: float) -> float:
        """Return how likely somebody is found in a picture."""
        row, column = (
            int(np.searchsorted(edges, value, side="right")) - 1
            for edges, value in ((SHOWN, shown), (DISTANCES, distance))
        )
        everybody = sum(self.found.values())[row, column]  # type: ignore[index]
        of_all = everybody[1] / everybody[0] if everybody[0] else 0.0
        people, found = self.found[kind][row, column]
        return float((found + ENOUGH * of_all) / (people + ENOUGH))


@cache
def shares() -> Shares:
    """Read what was measured (``tools/drawn_people.py`` writes it)."""
    read: Any = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    kinds = read["kinds"]
    return Shares(
        {kind: np.array(kinds[kind]["found"], float) for kind in kinds},
        {kind: kinds[kind]["errors"] for kind in kinds},
        (read["mistaken"]["nobody_there"], read["mistaken"]["somebody_there"]),
    )


def kind_of(spec: PersonSpec) -> str:
    """Return the kind of person, as the table of people.md has it."""
    if spec.aid != "none":
        return f"with a {spec.aid}"
    if spec.posture == "lying":
        return "lying in bed" if spec.surface > 0.0 else "lying on the floor"
    if spec.posture in ("seated", "sitting"):
        return "sitting"
    if spec.posture == "leaning":
        return "bent over"
    return "child up to 1.3 m, standing" if spec.height < 1.3 else "standing"


def posture_of(spec: PersonSpec) -> int:
    """Return the index in ``POSTURES`` of what a person does."""
    if spec.posture in ("seated", "sitting") or spec.aid == "wheelchair":
        return 1
    return 2 if spec.posture == "lying" else 0


@dataclass(slots=True)
class _Drawn:
    """The draw for a person, or for nobody, in a view.

    Attributes:
        camera: From where.
        at: Where the person was, map frame.
        noticed: How easily, standard normal.
        error: Metres from the middle, as a share of all errors, 0 to 1.
        towards: Direction of the error, radians.
        confidence: As a share of all, 0 to 1.
        posture: Whether it is taken for another one: 0 to 1, below :data:`WRONG_POSTURE`.
        place: What is taken for somebody, map frame; None before it was chosen, or when nothing is.
    """

    camera: Pose2
    at: tuple[float, float]
    noticed: float
    error: float
    towards: float
    confidence: float
    posture: float
    place: tuple[float, float] | None = None

    def holds(self, camera: Pose2, at: tuple[float, float]) -> bool:
        """Tell whether this is the same view."""
        turned = abs(math.remainder(camera.yaw - self.camera.yaw, 2.0 * math.pi))
        moved = max(camera.distance_to(self.camera), math.dist(at, self.at))
        return moved < SAME_VIEW_M and turned < SAME_VIEW_RAD


@dataclass(frozen=True, slots=True)
class _Answers:
    """The answers for a picture as they are filled in, on the network's grid of shape (60, 80)."""

    pixels: Pixels
    person: NDArray[np.float32] = field(default_factory=lambda: np.zeros((60, 80), np.float32))
    middle: NDArray[np.float32] = field(default_factory=lambda: np.zeros((60, 80, 2), np.float32))
    posture: NDArray[np.float32] = field(default_factory=lambda: np.zeros((60, 80, 3), np.float32))

    def vote(
        self, mine: NDArray[np.bool_], middle: tuple[float, float], confidence: float, does: int
    ) -> None:
        """Let some pixels say that they show somebody.

        Args:
            mine: Shape (60, 80), which.
            middle: Where the middle of that person is, robot frame, metres.
            confidence: Of each.
            does: Index of ``POSTURES``.
        """
        points = self.pixels.points[::STRIDE, ::STRIDE][mine][:, :2]
        rays = self.pixels.rays[::STRIDE, ::STRIDE][mine]
        away = np.array(middle, np.float32) - points
        self.person[mine] = confidence
        self.middle[mine, 0] = (away * rays).sum(axis=1)
        self.middle[mine, 1] = away[:, 1] * rays[:, 0] - away[:, 0] * rays[:, 1]
        self.posture[mine] = np.eye(len(POSTURES), dtype=np.float32)[does]


class DrawnPeople:
    """Answers in place of the network for the pictures of a simulated Kinect.

    Args:
        world: Where people are.
        sensor: Takes the pictures.
        seed: Start of what is drawn.
    """

    def __init__(self, world: SimulatedWorld, sensor: KinectSensor, seed: int) -> None:
        self._world, self._sensor = world, sensor
        self._chance = np.random.default_rng(seed)
        self._shares = shares()
        self._views: dict[str, _Drawn] = {}

    def answer(self, picture: DepthImage, pixels: Pixels) -> NetworkOutput:
        """Return what the network would say of the picture that was taken last."""
        view = self._sensor.view
        answers = _Answers(pixels)
        somebody = False
        for spec in self._world.people:
            shown = view.shows(spec.name)
            if shown.any():
                somebody = True
                self._show(answers, spec, shown, view)
        self._mistake(answers, view.robot, self._shares.mistaken[somebody])
        return NetworkOutput(answers.person, answers.middle, answers.posture)

    def _show(self, answers: _Answers, spec: PersonSpec, mine: NDArray[np.bool_], view: PeopleView) -> None:
        whole = view.whole(spec.name)
        if whole < SMALLEST_PIXELS:
            return
        at = self._world.person_pose(spec.name)
        drawn = self._drawn(spec.name, view.robot, (at.x, at.y))
        kind = kind_of(spec)
        distance = math.dist(view.camera, (at.x, at.y))
        chance = self._shares.chance(kind, min(1.0, mine.sum() / whole), distance)
        luck = math.sqrt(SAME) * drawn.noticed + math.sqrt(1.0 - SAME) * self._chance.standard_normal()
        if _NORMAL.cdf(luck) > chance:
            return
        errors = self._shares.errors[kind]
        error = float(np.interp(drawn.error, np.linspace(0.0, 1.0, len(errors)), errors))
        x, y = at.x + error * math.cos(drawn.towards), at.y + error * math.sin(drawn.towards)
        does = posture_of(spec)
        if drawn.posture < WRONG_POSTURE:
            does = (does + 1) % len(POSTURES)
        answers.vote(mine, view.robot.inverse().apply(x, y), _quantile(CONFIDENCE, drawn.confidence), does)

    def _mistake(self, answers: _Answers, robot: Pose2, chance: float) -> None:
        """Take something for a person."""
        old = self._views.get("")
        drawn = self._drawn("", robot, (0.0, 0.0))
        taken = drawn is not old and _NORMAL.cdf(drawn.noticed) < chance
        if not taken and drawn.place is None:
            return
        points = answers.pixels.points[::STRIDE, ::STRIDE]
        away = np.hypot(points[..., 0], points[..., 1])
        in_range = (away > _NEAREST_M) & (away < _FARTHEST_M)
        possible = in_range & (points[..., 2] > 0.3) & (answers.person == 0.0)
        if taken and possible.any():
            row, column = self._chance.choice(np.argwhere(possible))
            drawn.place = robot.apply(*points[row, column, :2].tolist())
        if drawn.place is not None:
            middle = robot.inverse().apply(*drawn.place)
            near = np.hypot(points[..., 0] - middle[0], points[..., 1] - middle[1]) < MISTAKEN_M
            answers.vote(near & possible, middle, _quantile(DOUBTFUL, drawn.confidence), 0)

    def _drawn(self, name: str, camera: Pose2, at: tuple[float, float]) -> _Drawn:
        """Return what was drawn for a person, empty for nobody, in this view."""
        drawn = self._views.get(name)
        if drawn is None or not drawn.holds(camera, at):
            error, towards, confidence, posture = self._chance.random(4).tolist()
            noticed = float(self._chance.standard_normal())
            drawn = _Drawn(camera, at, noticed, error, 2.0 * math.pi * towards, confidence, posture)
            self._views[name] = drawn
        return drawn


def _quantile(of: Sequence[float], share: float) -> float:
    return float(np.interp(share, (0.05, 0.25, 0.5, 0.75, 0.95), of))
