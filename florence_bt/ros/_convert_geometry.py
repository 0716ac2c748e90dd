"""Times, poses, velocities and transforms to and from their messages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from builtin_interfaces.msg import Duration as DurationMsg
from builtin_interfaces.msg import Time as TimeMsg
from geometry_msgs.msg import (
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Twist,
)
from nav_msgs.msg import Odometry as OdometryMsg
from nav_msgs.msg import Path as PathMsg
from std_msgs.msg import Header

from florence_bt.core.errors import FrameError
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.sensing import Odometry
from florence_bt.core.transforms import Transform3

NANO = 1_000_000_000
NO_COVARIANCE = (0.0,) * 36


def _split(seconds: float) -> tuple[int, int]:
    if not math.isfinite(seconds):
        raise FrameError(f"{seconds} is no time")
    whole, nanoseconds = divmod(round(seconds * NANO), NANO)
    if not -(2**31) <= whole < 2**31:
        raise FrameError(f"{seconds} s does not fit the 32 bits of a ROS time")
    return whole, nanoseconds


def stamp_to_ros(seconds: float) -> TimeMsg:
    """A moment, rounded to nanoseconds."""
    whole, nanoseconds = _split(seconds)
    return TimeMsg(sec=whole, nanosec=nanoseconds)


def stamp_from_ros(message: TimeMsg) -> float:
    """A moment in seconds."""
    return float(message.sec) + float(message.nanosec) / NANO


def duration_to_ros(seconds: float) -> DurationMsg:
    """A length of time, rounded to nanoseconds."""
    whole, nanoseconds = _split(seconds)
    return DurationMsg(sec=whole, nanosec=nanoseconds)


def duration_from_ros(message: DurationMsg) -> float:
    """A length of time in seconds."""
    return float(message.sec) + float(message.nanosec) / NANO


def header_to_ros(frame_id: str, stamp: float) -> Header:
    """A header."""
    return Header(stamp=stamp_to_ros(stamp), frame_id=frame_id)


def frame_from_ros(frame_id: str) -> str:
    """A frame's name without the leading slash of old software."""
    return frame_id.lstrip("/")


def quaternion_from_yaw(yaw: float) -> Quaternion:
    """A heading as a quaternion."""
    return Quaternion(z=math.sin(yaw / 2.0), w=math.cos(yaw / 2.0))


def yaw_from_quaternion(q: Quaternion) -> float:
    """The heading of the rotated x axis in (-pi, pi]; zero for the invalid all-zero quaternion."""
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), q.w**2 + q.x**2 - q.y**2 - q.z**2)


def pose_to_ros(pose: Pose2) -> Pose:
    """A pose in the plane z = 0."""
    message = Pose(orientation=quaternion_from_yaw(pose.yaw))
    message.position.x, message.position.y = float(pose.x), float(pose.y)
    return message


def pose_from_ros(message: Pose) -> Pose2:
    """The part of a pose that lies in the plane."""
    return Pose2(message.position.x, message.position.y, yaw_from_quaternion(message.orientation))


def pose_stamped_to_ros(pose: Pose2, frame_id: str, stamp: float) -> PoseStamped:
    """A pose with its frame and moment."""
    return PoseStamped(header=header_to_ros(frame_id, stamp), pose=pose_to_ros(pose))


def pose_stamped_from_ros(message: PoseStamped) -> tuple[Pose2, str, float]:
    """Pose, frame and moment."""
    header = message.header
    return pose_from_ros(message.pose), frame_from_ros(header.frame_id), stamp_from_ros(header.stamp)


def pose_with_covariance_to_ros(
    pose: Pose2, covariance: Sequence[float], frame_id: str, stamp: float
) -> PoseWithCovarianceStamped:
    """A pose with its uncertainty.

    Args:
        pose: The pose.
        covariance: Shape (36,): 6 x 6 row-major over x, y, z, roll, pitch, yaw.
        frame_id: The frame of the pose.
        stamp: Seconds.
    """
    message = PoseWithCovarianceStamped(header=header_to_ros(frame_id, stamp))
    message.pose.pose = pose_to_ros(pose)
    message.pose.covariance = _covariance(covariance)
    return message


def pose_array_to_ros(poses: Iterable[Pose2], frame_id: str, stamp: float) -> PoseArray:
    """Many poses in one frame."""
    return PoseArray(header=header_to_ros(frame_id, stamp), poses=[pose_to_ros(pose) for pose in poses])


def path_to_ros(poses: Iterable[Pose2], frame_id: str, stamp: float) -> PathMsg:
    """A path."""
    stamped = [pose_stamped_to_ros(pose, frame_id, stamp) for pose in poses]
    return PathMsg(header=header_to_ros(frame_id, stamp), poses=stamped)


def path_from_ros(message: PathMsg) -> list[Pose2]:
    """The poses of a path."""
    return [pose_from_ros(stamped.pose) for stamped in message.poses]


def twist_to_ros(twist: Twist2) -> Twist:
    """A velocity in the plane."""
    message = Twist()
    message.linear.x, message.angular.z = float(twist.linear), float(twist.angular)
    return message


def twist_from_ros(message: Twist) -> Twist2:
    """The part of a velocity that a differential drive can follow."""
    return Twist2(message.linear.x, message.angular.z)


def odometry_to_ros(
    odometry: Odometry,
    frame_id: str,
    child_frame_id: str,
    pose_covariance: Sequence[float] = NO_COVARIANCE,
    twist_covariance: Sequence[float] = NO_COVARIANCE,
) -> OdometryMsg:
    """Odometry of a base.

    Args:
        odometry: Pose and velocity.
        frame_id: The frame of the pose.
        child_frame_id: The frame that moves, and the frame of the velocity.
        pose_covariance: Shape (36,): 6 x 6 row-major over x, y, z, roll, pitch, yaw.
        twist_covariance: Likewise.
    """
    message = OdometryMsg(header=header_to_ros(frame_id, odometry.stamp), child_frame_id=child_frame_id)
    message.pose.pose = pose_to_ros(odometry.pose)
    message.pose.covariance = _covariance(pose_covariance)
    message.twist.twist = twist_to_ros(odometry.twist)
    message.twist.covariance = _covariance(twist_covariance)
    return message


def odometry_from_ros(message: OdometryMsg) -> Odometry:
    """Pose and velocity of a base."""
    return Odometry(
        stamp_from_ros(message.header.stamp),
        pose_from_ros(message.pose.pose),
        twist_from_ros(message.twist.twist),
    )


def transform_to_ros(
    parent: str, child: str, stamp: float, transform: Transform3 | Pose2
) -> TransformStamped:
    """A transform from a child to its parent frame."""
    message = TransformStamped(header=header_to_ros(parent, stamp), child_frame_id=child)
    target = message.transform
    if isinstance(transform, Pose2):
        target.translation.x, target.translation.y = float(transform.x), float(transform.y)
        target.rotation = quaternion_from_yaw(transform.yaw)
    else:
        target.translation.x, target.translation.y, target.translation.z = map(float, transform.translation)
        x, y, z, w = transform.quaternion()
        target.rotation = Quaternion(x=x, y=y, z=z, w=w)
    return message


def transform_from_ros(message: TransformStamped) -> tuple[str, str, float, Transform3]:
    """Parent, child, moment and transform.

    Raises:
        FrameError: The rotation is not a quaternion, or a number is not finite.
    """
    t, q = message.transform.translation, message.transform.rotation
    numbers = (t.x, t.y, t.z, q.x, q.y, q.z, q.w)
    if not all(map(math.isfinite, numbers)) or not any(numbers[3:]):
        raise FrameError(
            f"the transform of frame {message.child_frame_id!r} is not a rigid motion: {numbers}"
        )
    transform = Transform3.from_quaternion(numbers[:3], (q.x, q.y, q.z, q.w))
    header = message.header
    return (
        frame_from_ros(header.frame_id),
        frame_from_ros(message.child_frame_id),
        stamp_from_ros(header.stamp),
        transform,
    )


def _covariance(values: Sequence[float]) -> list[float]:
    if len(values) != 36:
        raise FrameError(f"a covariance has 36 numbers, not {len(values)}")
    return [float(value) for value in values]
