"""A person of the simulated flat: who it is, what they do, how they walk."""

from __future__ import annotations

import bisect
import itertools
import math
from dataclasses import dataclass
from typing import Literal, get_args

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.simulation.home.flat import Colour

Posture = Literal["standing", "leaning", "sitting", "seated", "lying", "walking"]
Aid = Literal["none", "rollator", "wheelchair"]
Load = Literal["none", "bag", "box"]

_CHOICES: dict[str, tuple[str, ...]] = {
    "posture": get_args(Posture),
    "aid": get_args(Aid),
    "load": get_args(Load),
}
_MOBILE = ("standing", "walking")

BODY_RADIUS_M = 0.25
"""No part of a person who stands, walks or sits on a stool reaches further from the middle."""

TROUSERS: Colour = (44, 58, 92)


@dataclass(frozen=True, slots=True)
class PersonSpec:
    """A person to put into the flat.

    Attributes:
        name: Unique among the people.
        pose: Middle of the body (seated: of the hips) in the map frame, and where the person looks; of
            somebody who lies, where the head is from there.
        posture: What the person does; ``sitting`` is on a stool of their own, ``seated`` on furniture.
        route: Points in the map frame that a walking person visits after the pose, there and back again.
        speed: Walking speed in m/s.
        shirt: Colour of the shirt.
        height: Height when standing, in metres.
        trousers: Colour of the trousers.
        surface: Height of what the person is seated or lies on, above the floor in metres.
        aid: A rollator to push, or a wheelchair to sit in.
        load: What the person carries.
    """

    name: str
    pose: Pose2
    posture: Posture = "standing"
    route: tuple[tuple[float, float], ...] = ()
    speed: float = 0.5
    shirt: Colour = (178, 34, 52)
    height: float = 1.72
    trousers: Colour = TROUSERS
    surface: float = 0.0
    aid: Aid = "none"
    load: Load = "none"

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ConfigError: A value makes no sense.
        """
        if not self.pose.is_finite():
            raise ConfigError(f"the pose of {self.name!r} is not finite")
        for field, valid in _CHOICES.items():
            if (value := getattr(self, field)) not in valid:
                raise ConfigError(f"unknown {field} {value!r} of {self.name!r}", valid=valid)
        if self.posture not in _MOBILE and (self.aid, self.load) != ("none", "none"):
            raise ConfigError(
                f"{self.name!r} needs to stand or walk to push or carry something", valid=_MOBILE
            )
        if (self.posture == "walking") != bool(self.route):
            raise ConfigError(f"{self.name!r} needs a route to walk, and only a walking person has one")
        if not 0.0 < self.speed <= 2.0:
            raise ConfigError(f"the speed of {self.name!r} must be in (0, 2] m/s, not {self.speed}")
        if not 0.95 <= self.height <= 1.95:
            raise ConfigError(f"the height of {self.name!r} must be in 0.95 to 1.95 m, not {self.height}")
        if not 0.0 <= self.surface <= 1.0:
            raise ConfigError(f"{self.name!r} cannot be on a surface at {self.surface} m", valid=["0 to 1 m"])


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
        self._distance = STOP_DISTANCE_M + max(0.0, forward_reach(spec) - BODY_RADIUS_M)
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
        if not self._would_run_into(step, robot):
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

    def _would_run_into(self, there: Pose2, robot: Pose2) -> bool:
        """Near the robot only steps that lead away from it are taken."""
        after = there.distance_to(robot)
        return after < self._distance and after <= self.pose.distance_to(robot)


STOP_DISTANCE_M = 0.6
"""A walking person keeps this far from the robot's middle; further with something before them."""

_FORWARD_M: dict[str, float] = {"rollator": 0.66, "wheelchair": 0.6, "box": 0.5}


def forward_reach(spec: PersonSpec) -> float:
    """How far a standing or walking person, with what they push or carry, reaches forward, metres."""
    return max(_FORWARD_M.get(spec.aid, 0.0), _FORWARD_M.get(spec.load, 0.0), BODY_RADIUS_M)
