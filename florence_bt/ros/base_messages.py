"""ROS messages of a base's gyro; plain numbers in."""

from __future__ import annotations

from sensor_msgs.msg import Imu

from florence_bt.core.geometry import Pose2
from florence_bt.ros.conversions import pose_to_ros, stamp_to_ros

YAW_ONLY = (1e6, 0.0, 0.0, 0.0, 1e6, 0.0, 0.0, 0.0, 1e-6)
"""Covariance of orientation and rate of a gyro about z (REFERENCE 1.8)."""

NOT_MEASURED = (-1.0, *([0.0] * 8))


def gyro_to_ros(rate: float, yaw: float, frame_id: str, stamp: float) -> Imu:
    """Convert a single-axis gyro to an Imu.

    Args:
        rate: rad/s about z.
        yaw: Radians, integrated from the rate.
        frame_id: The gyro's frame.
        stamp: Seconds.
    """
    message = Imu(
        orientation=pose_to_ros(Pose2(yaw=yaw)).orientation,
        orientation_covariance=YAW_ONLY,
        angular_velocity_covariance=YAW_ONLY,
        linear_acceleration_covariance=NOT_MEASURED,
    )
    message.header.stamp = stamp_to_ros(stamp)
    message.header.frame_id = frame_id
    message.angular_velocity.z = rate
    return message
