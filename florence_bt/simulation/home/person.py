"""A person of the simulated flat: who it is, what it looks like, how it walks."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.simulation.home.flat import Colour

Posture = Literal["standing", "sitting", "walking"]

BODY_RADIUS_M = 0.25
"""No part of a person reaches further from the middle."""


@dataclass(frozen=True, slots=True)
class PersonSpec:
    """A person to put into the flat.

    Attributes:
        name: Unique among the people.
        pose: Middle of the body in the map frame, and where the person looks.
        posture: What the person does.
        route: Points in the map frame that a walking person visits after the pose, there and back again.
        speed: Walking speed in m/s.
        shirt: Colour of the shirt.
        height: Height when standing, in metres.
    """

    name: str
    pose: Pose2
    posture: Posture = "standing"
    route: tuple[tuple[float, float], ...] = ()
    speed: float = 0.5
    shirt: Colour = (178, 34, 52)
    height: float = 1.72

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ConfigError: A value makes no sense.
        """
        if not self.pose.is_finite():
            raise ConfigError(f"the pose of {self.name!r} is not finite")
        if self.posture not in ("standing", "sitting", "walking"):
            valid = ("standing", "sitting", "walking")
            raise ConfigError(f"unknown posture {self.posture!r} of {self.name!r}", valid=valid)
        if (self.posture == "walking") != bool(self.route):
            raise ConfigError(f"{self.name!r} needs a route to walk, and only a walking person has one")
        if not 0.0 < self.speed <= 2.0:
            raise ConfigError(f"the speed of {self.name!r} must be in (0, 2] m/s, not {self.speed}")
        if not 1.6 <= self.height <= 1.8:
            raise ConfigError(f"the height of {self.name!r} must be in 1.6 to 1.8 m, not {self.height}")


@dataclass(frozen=True, slots=True)
class BodyPart:
    """An upright cylinder, a sphere (bottom to top is its diameter) or a box of a person.

    Attributes:
        shape: What it is.
        x: Centre in the person's frame (x forward), metres.
        y: Centre in the person's frame (y left), metres.
        bottom: Height of its lowest point above the floor, metres.
        top: Height of its highest point, metres.
        size: (radius,) or half of the box's sides, metres.
        colour: Its colour.
    """

    shape: Literal["cylinder", "sphere", "box"]
    x: float
    y: float
    bottom: float
    top: float
    size: tuple[float, ...]
    colour: Colour


_SKIN: Colour = (224, 172, 138)
_TROUSERS: Colour = (44, 58, 92)
_HAIR: Colour = (72, 52, 38)
_STOOL: Colour = (120, 90, 60)


def body_parts(spec: PersonSpec) -> tuple[BodyPart, ...]:
    """The body of a person. Below 0.6 m it stays within 0.18 m (sitting: 0.2 m) of the middle."""
    if spec.posture == "sitting":
        return tuple(_sitting(spec.shirt))
    return tuple(_upright(spec.shirt, spec.height))


def _upright(shirt: Colour, height: float) -> Iterator[BodyPart]:
    hip, shoulder = 0.48 * height, 0.82 * height
    for side in (1, -1):
        yield BodyPart("cylinder", 0.0, side * 0.095, 0.0, hip, (0.065,), _TROUSERS)
        yield BodyPart("box", 0.04, side * 0.09, 0.0, 0.07, (0.08, 0.04), _HAIR)
        yield BodyPart("cylinder", 0.0, side * 0.2, hip, shoulder, (0.045,), shirt)
        yield BodyPart("cylinder", 0.02, side * 0.2, hip - 0.12, hip, (0.04,), _SKIN)
    yield BodyPart("box", 0.0, 0.0, hip, shoulder, (0.11, 0.16), shirt)
    yield from _head(height)


def _sitting(shirt: Colour) -> Iterator[BodyPart]:
    seat, shoulder, height = 0.45, 0.98, 1.26
    yield BodyPart("cylinder", -0.03, 0.0, 0.0, seat, (0.15,), _STOOL)
    for side in (1, -1):
        yield BodyPart("cylinder", 0.12, side * 0.085, 0.0, seat, (0.05,), _TROUSERS)
        yield BodyPart("box", 0.05, side * 0.08, seat, seat + 0.12, (0.1, 0.045), _TROUSERS)
        yield BodyPart("cylinder", -0.02, side * 0.195, 0.62, shoulder, (0.045,), shirt)
    yield BodyPart("box", -0.03, 0.0, seat, shoulder, (0.1, 0.15), shirt)
    yield from _head(height)


def _head(height: float) -> Iterator[BodyPart]:
    yield BodyPart("cylinder", 0.0, 0.0, height - 0.32, height - 0.2, (0.055,), _SKIN)
    yield BodyPart("sphere", 0.0, 0.0, height - 0.22, height, (0.11,), _SKIN)
    yield BodyPart("cylinder", -0.02, 0.0, height - 0.1, height - 0.01, (0.1,), _HAIR)


class Walker:
    """Leads a person along a route, there and back, and stops in front of the robot.

    Args:
        spec: A person with a route.
    """

    def __init__(self, spec: PersonSpec) -> None:
        self._points = ((spec.pose.x, spec.pose.y), *spec.route)
        legs = [math.dist(a, b) for a, b in itertools.pairwise(self._points)]
        self._ends = list(itertools.accumulate(legs))
        if not self._ends[-1] > 0.0:
            raise ConfigError(f"the route of {spec.name!r} leads nowhere")
        self._speed = spec.speed
        self._walked = 0.0
        self.pose = self._pose_after(0.0)

    def advance(self, seconds: float, robot: Pose2) -> Pose2:
        """Walk on for a while, unless the robot is in the way.

        Args:
            seconds: For how long.
            robot: Where the robot is.

        Returns:
            The new pose.
        """
        step = self._pose_after(self._walked + self._speed * seconds)
        if not _would_run_into(self.pose, step, robot):
            self._walked += self._speed * seconds
            self.pose = step
        return self.pose

    def _pose_after(self, walked: float) -> Pose2:
        total = self._ends[-1]
        along = walked % (2 * total)
        backwards = along > total
        along = 2 * total - along if backwards else along
        leg = min(bisect.bisect_right(self._ends, along), len(self._ends) - 1)
        (ax, ay), (bx, by) = self._points[leg], self._points[leg + 1]
        start = self._ends[leg - 1] if leg else 0.0
        length = self._ends[leg] - start
        part = (along - start) / length if length > 0.0 else 0.0
        yaw = math.atan2(by - ay, bx - ax) + (math.pi if backwards else 0.0)
        return Pose2(ax + part * (bx - ax), ay + part * (by - ay), normalize_angle(yaw))


STOP_DISTANCE_M = 0.6
"""A walking person keeps this far from the robot's middle."""


def _would_run_into(here: Pose2, there: Pose2, robot: Pose2) -> bool:
    """Near the robot only steps that lead away from it are taken."""
    after = there.distance_to(robot)
    return after < STOP_DISTANCE_M and after <= here.distance_to(robot)
