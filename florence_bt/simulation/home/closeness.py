"""Politeness of the robot's place before a person: judged on the truth, for demos, trials and tests."""

from __future__ import annotations

import math
from dataclasses import dataclass

from florence_bt.core.geometry import Pose2

POLITE_DISTANCE_M, DISTANCE_TOLERANCE_M = 0.5, 0.1
"""As the mission promises: see ``polite``."""
FACING_TOLERANCE = math.radians(15.0)


@dataclass(frozen=True, slots=True)
class Closeness:
    """The pose of the robot towards a person.

    Attributes:
        distance: Between the centres in metres.
        facing: Angle between the robot's heading and the direction to the person, 0 = faces them, radians.
    """

    distance: float
    facing: float

    @property
    def polite(self) -> bool:
        """Tell whether that is what the mission promises: 0.5 m +- 0.1 m, facing within 15 degrees."""
        return self.polite_at(POLITE_DISTANCE_M)

    def polite_at(self, distance: float) -> bool:
        """Judge as :attr:`polite` does, for a robot known only to get within a distance, metres, >= 0.5."""
        nearest, farthest = POLITE_DISTANCE_M - DISTANCE_TOLERANCE_M, distance + DISTANCE_TOLERANCE_M
        return nearest <= self.distance <= farthest and self.facing <= FACING_TOLERANCE


def closeness(robot: Pose2, person: Pose2) -> Closeness:
    """Return how the robot stands to a person."""
    return Closeness(robot.distance_to(person), abs(robot.bearing_to(person.x, person.y)))


def closeness_text(value: Closeness) -> str:
    """Write for people the distance and how far the robot looks past the person."""
    return (
        f"{value.distance:.2f} m from the person, facing them within {math.degrees(value.facing):.0f} degrees"
    )
