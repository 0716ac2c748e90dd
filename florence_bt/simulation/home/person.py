"""A person of the simulated flat: who it is, what they do, how much room they need."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
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
"""Of somebody whose colours are not said. Chosen."""


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
        wait: How long a walking person stands at each end of the route before they set off, in seconds.
        once: Whether the route is walked once, and not there and back for ever.
        pauses: How long somebody who walks once stands at each point of the route before they walk on, in
            seconds; points beyond the last number are passed without a stop.
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
    wait: float = 0.0
    once: bool = False
    pauses: tuple[float, ...] = ()

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
        if not 0.0 <= self.wait < math.inf:
            raise ConfigError(f"{self.name!r} cannot wait {self.wait} s", valid=["0 s or more"])
        if not 0.0 <= self.surface <= 1.0:
            raise ConfigError(f"{self.name!r} cannot be on a surface at {self.surface} m", valid=["0 to 1 m"])


_FORWARD_M: dict[str, float] = {"rollator": 0.66, "wheelchair": 0.6, "box": 0.5}


def forward_reach(spec: PersonSpec) -> float:
    """Return how far a standing or walking person, with what they push or carry, reaches forward, metres."""
    return max(_FORWARD_M.get(spec.aid, 0.0), _FORWARD_M.get(spec.load, 0.0), BODY_RADIUS_M)


def half_width(aid: Aid) -> float:
    """Return half of the width that a walking person needs to pass, metres."""
    return 0.33 if aid == "wheelchair" else 0.27
