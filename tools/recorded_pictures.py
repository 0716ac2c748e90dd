"""Depth pictures that somebody recorded with ``florence kinect record`` and labelled.

The folder holds the recording and ``labels.yaml``: in which seconds of it who was where (the page
docs/manual/people.md has an example).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from florence_bt.app.bringup.simulated import CAMERA_FRAME, robot_frames
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.recording import recorded_depth
from florence_bt.simulation.home.flat import Entry, Finite
from florence_bt.simulation.home.model_reader import ModelReader
from florence_bt.simulation.home.person import PersonSpec

LABELS = "labels.yaml"

Doing = Literal[
    "standing",
    "bent over",
    "sitting",
    "lying on the floor",
    "lying in bed",
    "with a rollator",
    "with a wheelchair",
]

_AS_SIMULATED: dict[str, dict[str, Any]] = {
    "bent over": {"posture": "leaning"},
    "sitting": {"posture": "seated"},
    "lying on the floor": {"posture": "lying"},
    "lying in bed": {"posture": "lying", "surface": 0.5},
    "with a rollator": {"aid": "rollator"},
    "with a wheelchair": {"aid": "wheelchair"},
}


@dataclass(frozen=True, slots=True)
class Truth:
    """The people in a picture, and where they are.

    Attributes:
        camera: Where the camera is in the robot frame, metres.
        people: Everybody in view, with their place (x, y) in the robot frame.
        shown: Share of each one's pixels that nothing hides; None for who is not asked for.
    """

    camera: Sequence[float]
    people: Sequence[tuple[PersonSpec, tuple[float, float]]]
    shown: Sequence[float | None]


class PersonEntry(Entry):
    """A person in a scene: x metres ahead of the robot's middle, y to the left."""

    x: Finite
    y: Finite
    doing: Doing = "standing"
    shown: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0
    height: Annotated[float, Field(ge=0.95, le=1.95)] = 1.72


class SceneEntry(Entry):
    """Some seconds of the recording in which nobody moves."""

    begin: Annotated[float, Field(alias="from", ge=0.0, allow_inf_nan=False)]
    end: Annotated[float, Field(alias="to", allow_inf_nan=False)]
    people: tuple[PersonEntry, ...]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.end <= self.begin:
            raise ValueError(f"a scene from {self.begin:g} to {self.end:g} s is empty: 'to' must be later")
        return self


class LabelsEntry(Entry):
    """The file."""

    scenes: Annotated[tuple[SceneEntry, ...], Field(min_length=1)]


def recorded_pictures(folder: Path) -> Iterator[tuple[DepthImage, Transform3, Truth]]:
    """Yield the pictures of a recording that have labels.

    Yields:
        The picture, what takes its points to the robot frame, and who is where. Pictures in no scene are left
        out, so that people may come and go between scenes.

    Raises:
        FlorenceError: The folder is not a recording, or its labels cannot be used.
    """
    source = ModelReader(folder / LABELS)
    scenes = source.parse(LabelsEntry).scenes
    mount = robot_frames().lookup("base_footprint", CAMERA_FRAME)
    driver = KinectDriver(KinectParameters())
    used: set[int] = set()
    last = 0.0
    for moment, frame in recorded_depth(folder):
        last = moment
        picture = driver.depth(frame, moment)
        for number, scene in enumerate(scenes):
            if picture is not None and scene.begin <= moment < scene.end:
                used.add(number)
                yield picture, mount, _truth(scene, mount)
                break
    for number, scene in enumerate(scenes):
        if number not in used:
            raise source.error_at(
                ("scenes", number),
                f"no picture shows the scene from {scene.begin:g} to {scene.end:g} s",
                [f"times from 0 to {last:g} s, in no scene above"],
            )


def _truth(scene: SceneEntry, mount: Transform3) -> Truth:
    people = [
        (
            PersonSpec(
                f"person {number}",
                Pose2(each.x, each.y),
                height=each.height,
                **_AS_SIMULATED.get(each.doing, {}),
            ),
            (each.x, each.y),
        )
        for number, each in enumerate(scene.people, start=1)
    ]
    return Truth(mount.translation, people, [each.shown for each in scene.people])
