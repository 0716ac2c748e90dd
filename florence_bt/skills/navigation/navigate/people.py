"""Rules for driving near people: not to where they are about to be, and slower the nearer they are."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2
from florence_bt.core.limits import CheckedParameters, NotNegative, Positive
from florence_bt.skills.navigation.navigate._rollout_kernels import meets_somebody
from florence_bt.skills.navigation.navigate.costmap import moved_points

SOMEBODY_IN_THE_WAY = "somebody is in the way, or about to be"
_TOLERANCE_M = 0.1
"""The robot may come so much nearer to somebody than its goal is: they are not seen better."""
_SLOWEST_MPS = 0.08
"""Near somebody the robot drives so slowly at least; nearer than it may come it stops."""
_BESIDE = 0.5
"""A person beside the way counts as if the robot came nearer at this share of its speed, at least."""
_SHARES = 1.0, 0.5
"""Parts of a speed to try, the best first."""


@dataclass(frozen=True, slots=True)
class PeopleParameters(CheckedParameters):
    """The parameters of driving near people whom the user tracker sees.

    Attributes:
        people_distance: The robot drives no nearer to somebody than this, between the middles, in metres: the
            safe distance of an approach, 0.5 m, less its tolerance. Where a goal is nearer to somebody, as
            near as the goal. 0 switches slowing down and stopping for people off.
        people_time_to_contact: It drives so slowly that it would come this near in so many seconds at the
            soonest. 0 switches slowing down off.
        people_prediction_time: It does not drive to where a person who walks on will be in so many seconds.
        people_velocity_time: How they walk is averaged over about this long, in seconds.
        people_keep_time: A person who was not seen for so many seconds is forgotten.

    Source:
        Document, table 13 (the safe distance); the rest is our choice.
    """

    people_distance: NotNegative = 0.4
    people_time_to_contact: NotNegative = 2.0
    people_prediction_time: Positive = 1.5
    people_velocity_time: Positive = 0.6
    people_keep_time: Positive = 1.0


@dataclass(frozen=True, slots=True)
class People:
    """The people at one moment, in the odometry frame.

    Attributes:
        rows: Shape (n, 5): x, y in metres, vx, vy in m/s, and how near the robot may come, in metres.
        parameters: How to drive near them.
    """

    rows: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 5)))
    parameters: PeopleParameters = field(default_factory=PeopleParameters)

    @property
    def places(self) -> list[tuple[float, float]]:
        """Give the place of each, metres."""
        return [(float(x), float(y)) for x, y in self.rows[:, :2]]

    def in_map(self, map_from_odom: Pose2) -> NDArray[np.float64]:
        """Return rows of the shape (n, 4): x, y, vx, vy in the map frame."""
        if not len(self.rows):
            return np.empty((0, 4))
        places = moved_points(self.rows[:, :2], map_from_odom)
        return np.hstack([places, moved_points(self.rows[:, 2:4], Pose2(0.0, 0.0, map_from_odom.yaw))])

    def around_goal(self, goal: Pose2) -> People:
        """Return the same people; the robot may come as near to each as its goal is."""
        if not len(self.rows):
            return self
        rows = self.rows.copy()
        at_goal = np.hypot(rows[:, 0] - goal.x, rows[:, 1] - goal.y) - _TOLERANCE_M
        rows[:, 4] = np.clip(at_goal, 0.0, rows[:, 4])
        return replace(self, rows=rows)

    def anybody_beside(self, pose: Pose2) -> bool:
        """Tell whether somebody is nearer than the robot may come to them: a turn would be too near, too."""
        if not len(self.rows):
            return False
        away = np.hypot(self.rows[:, 0] - pose.x, self.rows[:, 1] - pose.y)
        return bool((away < self.rows[:, 4]).any())

    def slowed(self, pose: Pose2, command: Twist2) -> Twist2:
        """Return the same arc, driven as fast as people allow.

        Args:
            pose: base_footprint.
            command: The wanted velocity; a turn in place is left as it is.

        Returns:
            Standstill when it would lead too near to somebody also when driven slowly.
        """
        params = self.parameters
        if not len(self.rows) or command.linear == 0.0 or params.people_distance == 0.0:
            return command
        command = command.slowed_to(self._speed_limit(pose, math.copysign(1.0, command.linear)))
        start = np.array([pose.x, pose.y, pose.yaw])
        for share in _SHARES:
            slower = Twist2(share * command.linear, share * command.angular)
            twist = np.array([slower.linear, slower.angular])
            if not meets_somebody(self.rows, start, twist, params.people_prediction_time):
                return slower
        return STANDSTILL

    def _speed_limit(self, pose: Pose2, direction: float) -> float:
        """Return how fast the robot may drive forward (1.0) or backwards (-1.0), m/s."""
        time = self.parameters.people_time_to_contact
        if time == 0.0:
            return math.inf
        x, y, vx, vy, nearest = self.rows.T
        dx, dy = x - pose.x, y - pose.y
        distance = np.maximum(np.hypot(dx, dy), 1e-6)
        ahead = direction * (math.cos(pose.yaw) * dx + math.sin(pose.yaw) * dy) / distance
        closing = np.maximum(0.0, -(dx * vx + dy * vy) / distance)
        limits = ((distance - nearest) / time - closing) / np.maximum(ahead, _BESIDE)
        return max(_SLOWEST_MPS, float(np.where(ahead > 0.0, limits, np.inf).min()))
