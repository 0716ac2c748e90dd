"""A look for a person: the nearest one that is seen for long enough, or nobody within the window.

A look with too few pictures to decide says so: that is not the same as nobody being there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.sensing import TrackedUser
from florence_bt.skills.people.user_tracker.parameters import LookParameters

_Sample = tuple[float, float, float, float]
"""Time, x, y, distance."""


class LookForUser:
    """Decides whom the robot has found.

    Args:
        parameters: When a person counts as seen.

    Source:
        REFERENCE 12.2, steps 6 and 7.
    """

    def __init__(self, parameters: LookParameters | None = None) -> None:
        self._use = parameters or LookParameters()
        self._samples: dict[int, list[_Sample]] = {}
        self._robot: Pose2 | None = None
        self._started = 0.0
        self._window = 0.0
        self._pictures = 0

    @property
    def deadline(self) -> float:
        """The moment at which the look ends in any case, seconds."""
        return self._started + self._window

    @property
    def pictures(self) -> int:
        """How many pictures were looked at so far."""
        return self._pictures

    @property
    def users_seen(self) -> int:
        """How many people were seen so far."""
        return len(self._samples)

    def start(self, now: float, window_s: float) -> None:
        """Begin a look of at most some seconds."""
        self._started, self._window = now, window_s
        self._samples = {}
        self._robot = None
        self._pictures = 0

    def feed(self, now: float, users: Sequence[TrackedUser], robot: Pose2 | None = None) -> None:
        """Take the confirmed people of a picture.

        Args:
            now: The time of the picture, seconds.
            users: The people, map frame; those out of range or not finite do not count.
            robot: Where the robot is, map frame; gives the person's yaw its meaning.
        """
        self._pictures += 1
        self._robot = robot or self._robot
        for user in users:
            if math.isfinite(user.x) and math.isfinite(user.y) and self._in_range(user.distance):
                self._samples.setdefault(user.user_id, []).append((now, user.x, user.y, user.distance))

    def result(self, now: float) -> Result | None:
        """The end of the look, or None while it goes on.

        Returns:
            Success with ``user`` (its yaw points to the robot, 0 when the robot's pose is not known),
            ``distance`` and ``user_id``; ``no_user_seen``; or ``no_picture`` when there were too few
            pictures to see anybody.
        """
        seen = {key: each for key, each in self._samples.items() if len(each) >= self._use.minimum_pictures}
        settled = any(each[-1][0] - each[0][0] >= self._use.settle_s for each in seen.values())
        if seen and (settled or now >= self.deadline):
            return self._found(seen)
        if now >= self.deadline:
            return self._nobody()
        return None

    def _nobody(self) -> Result:
        if self._pictures >= self._use.enough_pictures:
            return failure(
                "no_user_seen", f"no user seen within {self._window:g} s in {self._pictures} pictures"
            )
        return failure(
            "no_picture",
            f"{self._pictures} usable pictures within {self._window:g} s, "
            f"{self._use.enough_pictures} would have been enough to see somebody",
        )

    def _in_range(self, distance: float) -> bool:
        return self._use.nearest <= distance <= self._use.farthest

    def _found(self, seen: dict[int, list[_Sample]]) -> Result:
        middle = {key: np.median(np.array(each), axis=0) for key, each in seen.items()}
        user_id = min(middle, key=lambda key: float(middle[key][3]))
        _, x, y, distance = (float(value) for value in middle[user_id])
        yaw = math.atan2(self._robot.y - y, self._robot.x - x) if self._robot else 0.0
        return success(user=Pose2(x, y, yaw), distance=distance, user_id=user_id)
