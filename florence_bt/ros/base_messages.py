"""What a base measures of itself, as ROS messages; plain numbers in."""

from __future__ import annotations

from collections.abc import Sequence

from sensor_msgs.msg import BatteryState, Imu, JointState

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


def joints_to_ros(
    names: Sequence[str], positions: Sequence[float], velocities: Sequence[float], stamp: float
) -> JointState:
    """Convert joint positions in radians and their velocities in rad/s."""
    message = JointState(name=names, position=positions, velocity=velocities)
    message.header.stamp = stamp_to_ros(stamp)
    return message


def battery_to_ros(
    *,
    voltage_v: float,
    current_a: float,
    temperature_c: float,
    charge_ah: float,
    capacity_ah: float,
    charging: bool,
    full: bool,
    plugged: bool,
    failed: bool,
    stamp: float,
) -> BatteryState:
    """Convert the state of a battery.

    Args:
        voltage_v: Volts.
        current_a: Amperes, negative while discharging.
        temperature_c: Degrees Celsius.
        charge_ah: What is left.
        capacity_ah: What it holds when full, also reported as its design capacity; 0 for unknown.
        charging: Current flows into it on purpose.
        full: It is kept full.
        plugged: A charger is there.
        failed: The charger reports a fault.
        stamp: Seconds.
    """
    message = BatteryState(
        voltage=voltage_v,
        current=current_a,
        temperature=temperature_c,
        charge=charge_ah,
        capacity=capacity_ah,
        design_capacity=capacity_ah,
        percentage=min(1.0, charge_ah / capacity_ah) if capacity_ah > 0.0 else float("nan"),
        present=capacity_ah > 0.0,
        power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_NIMH,
    )
    message.header.stamp = stamp_to_ros(stamp)
    if full:
        message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_FULL
    elif charging:
        message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_CHARGING
    elif plugged:
        message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_NOT_CHARGING
    else:
        message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    message.power_supply_health = (
        BatteryState.POWER_SUPPLY_HEALTH_UNSPEC_FAILURE if failed else BatteryState.POWER_SUPPLY_HEALTH_GOOD
    )
    return message
