"""Plane geometry in pure Python: angles, poses and velocities.

Axes as in REP-103: x forward, y left, yaw counter-clockwise positive; metres and radians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Point2 = tuple[float, float]
"""A point in the plane: x and y in metres."""

MAX_DISTANCE_M = 10_000.0
"""Coordinates, lengths and ranges beyond this are mistakes: farther than any home."""
MAX_ANGLE_RAD = 1_000 * math.tau
"""Headings and turns beyond this are mistakes: a thousand full turns."""


def normalize_angle(angle: float) -> float:
    """Wrap an angle in radians to (-pi, pi]."""
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


def angle_difference(to: float, start: float) -> float:
    """Return the shortest turn from ``start`` to ``to``, in (-pi, pi], counter-clockwise positive."""
    return normalize_angle(to - start)


def degrees_text(angle: float) -> str:
    """Write an angle in radians as whole degrees for people: above -180, up to 180."""
    degrees = round(math.degrees(normalize_angle(angle)))
    return f"{180 if degrees == -180 else degrees} deg"


def yaw_of_quaternion(x: float, y: float, z: float, w: float) -> float:
    """Return the heading of the rotated x axis in (-pi, pi]; zero for the invalid all-zero quaternion."""
    return math.atan2(2.0 * (w * z + x * y), w**2 + x**2 - y**2 - z**2)


@dataclass(frozen=True, slots=True)
class Pose2:
    """A pose in the plane; also the transform from the body frame to the frame it is given in.

    Attributes:
        x: Position in metres.
        y: Position in metres.
        yaw: Heading in radians, not necessarily wrapped.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def __matmul__(self, other: Pose2) -> Pose2:
        """Compose: ``pose_a_in_w @ pose_b_in_a`` is b in w, with the yaw wrapped to (-pi, pi]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            normalize_angle(self.yaw + other.yaw),
        )

    def inverse(self) -> Pose2:
        """Return the inverse transform."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(-c * self.x - s * self.y, s * self.x - c * self.y, normalize_angle(-self.yaw))

    def apply(self, x: float, y: float) -> tuple[float, float]:
        """Take a point from the body frame to the frame this pose is given in."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + c * x - s * y, self.y + s * x + c * y

    def distance_to(self, other: Pose2) -> float:
        """Return the straight distance between the two positions in metres."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def bearing_to(self, x: float, y: float) -> float:
        """Return the direction of a point as seen from here, relative to the heading, in (-pi, pi]."""
        return normalize_angle(math.atan2(y - self.y, x - self.x) - self.yaw)

    def is_finite(self) -> bool:
        """Tell whether no number of the pose is NaN or infinite."""
        return math.isfinite(self.x) and math.isfinite(self.y) and math.isfinite(self.yaw)

    def is_within_limits(self) -> bool:
        """Tell whether it is finite, at most 10 km away on each axis and turned by 1000 turns at most."""
        return (
            abs(self.x) <= MAX_DISTANCE_M and abs(self.y) <= MAX_DISTANCE_M and abs(self.yaw) <= MAX_ANGLE_RAD
        )


@dataclass(frozen=True, slots=True)
class FramedPose:
    """A pose that somebody gives in a frame of theirs.

    Attributes:
        pose: In that frame.
        frame: Its name; empty for the map's.
        problem: Why it is none, empty when it is one.
    """

    pose: Pose2
    frame: str = ""
    problem: str = ""


@dataclass(frozen=True, slots=True)
class FramedPath:
    """Poses of a way in a frame."""

    poses: tuple[Pose2, ...]
    frame: str


@dataclass(frozen=True, slots=True)
class Point3:
    """A point or an offset in space, metres."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


def problem_with_quaternion(x: float, y: float, z: float, w: float) -> str:
    """Tell why a quaternion is not a heading, empty when it is one.

    Source:
        REFERENCE 7.3 (goal quaternion).
    """
    squared = x * x + y * y + z * z + w * w
    if not math.isfinite(squared):
        return "the goal's orientation is not finite"
    if squared < 1e-6:
        return "the goal's orientation is the zero quaternion; w: 1.0 means straight ahead"
    if 2.0 * (x * x + y * y) / squared > 1e-3:
        return "the goal's orientation is tilted; the robot can only turn about the vertical axis"
    return ""


@dataclass(frozen=True, slots=True)
class Twist2:
    """A velocity in the plane, in the body frame of a differential drive.

    Attributes:
        linear: Forward speed in m/s.
        angular: Turning speed in rad/s, counter-clockwise positive.
    """

    linear: float = 0.0
    angular: float = 0.0

    def is_zero(self) -> bool:
        """Tell whether this is exactly standstill."""
        return self.linear == 0.0 and self.angular == 0.0

    def slowed_to(self, speed: float, turning: float = math.inf) -> Twist2:
        """Return the same arc, no faster than a speed, m/s, and a turning speed, rad/s."""
        limits = ((speed, abs(self.linear)), (turning, abs(self.angular)))
        share = min((1.0, *(most / value for most, value in limits if value)))
        return Twist2(self.linear * share, self.angular * share)


STANDSTILL = Twist2()


def integrate_twist(pose: Pose2, twist: Twist2, duration: float) -> Pose2:
    """Drive with a constant twist for a while (exact arc).

    Args:
        pose: Where the motion starts.
        twist: The constant velocity.
        duration: Seconds.
    """
    turn = twist.angular * duration
    if abs(turn) < 1e-9:
        return pose @ Pose2(twist.linear * duration, 0.0, turn)
    radius = twist.linear / twist.angular
    return pose @ Pose2(radius * math.sin(turn), radius * (1.0 - math.cos(turn)), turn)
