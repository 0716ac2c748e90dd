"""A goal of navigation: an object with its own steps, feedback and end. No ROS, no clock of its own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Point2, Pose2, Twist2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.state import CycleState, Feedback


class NavigationGoal(ABC):
    """A thing to drive until it gives a result; each kind overrides what it needs.

    Attributes:
        by_odometry: Whether it goes on while nobody knows where the robot is in the map.
        keeps_map: Whether a newer map is taken after it only.
    """

    by_odometry: ClassVar[bool] = False
    keeps_map: ClassVar[bool] = False

    @abstractmethod
    def step(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step: the velocity, the feedback, and the result when the goal is over."""

    def stand_still(self, now: float) -> tuple[Feedback, Result | None] | None:
        """Take one step without sensors, in which the robot stands (seconds); None of a goal that drives."""
        return None

    @property
    def path(self) -> NDArray[np.float64] | None:
        """The path that is followed, shape (n, 2) in the map frame; None without one."""
        return None

    @property
    def person(self) -> Point2 | None:
        """Give the last place of the goal's person, odometry frame, metres; None while nobody knows."""
        return None

    @property
    def followed(self) -> tuple[int, Point2 | None] | tuple[None, None]:
        """Give who is followed, and their last place: nobody whom the robot keeps clear of."""
        return None, None

    def resume(self, now: float) -> None:
        """Go on after the robot did not know where it was: nothing of before counts as lost time."""
        return

    def saw_scan(
        self, stamp: float, points: NDArray[np.float64], robot: Pose2, map_from_odom: Pose2 | None
    ) -> None:
        """Take a scan of the laser.

        Args:
            stamp: Seconds.
            points: Where the beams end, in the order of the scan, shape (n, 2), odometry frame, metres.
            robot: The robot in the odometry frame at that time.
            map_from_odom: The place of the odometry frame in the map, None while it is not known.
        """
        return

    def saw_people(self, stamp: float, people: Sequence[Point2]) -> None:
        """Take where the camera saw people: time in seconds, places in the odometry frame in metres."""
        return
