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
    voltage_v: float | None,
    current_a: float | None,
    temperature_c: float | None,
    charge_ah: float | None,
    capacity_ah: float | None,
    fraction: float | None,
    charging: bool,
    full: bool,
    plugged: bool,
    failed: bool,
    stamp: float,
) -> BatteryState:
    """Convert the state of a battery; what is not known (None) is NaN, as sensor_msgs wants it.

    Args:
        voltage_v: Volts.
        current_a: Amperes, negative while discharging.
        temperature_c: Degrees Celsius.
        charge_ah: What is left.
        capacity_ah: What it holds when full, also reported as its design capacity.
        fraction: Charge by capacity, 0 to 1.
        charging: Current flows into it on purpose.
        full: It is kept full.
        plugged: A charger is there.
        failed: The charger reports a fault.
        stamp: Seconds.
    """
    message = BatteryState(
        voltage=_or_nan(voltage_v),
        current=_or_nan(current_a),
        temperature=_or_nan(temperature_c),
        charge=_or_nan(charge_ah),
        capacity=_or_nan(capacity_ah),
        design_capacity=_or_nan(capacity_ah),
        percentage=_or_nan(fraction),
        present=capacity_ah is not None,
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


def _or_nan(number: float | None) -> float:
    return float("nan") if number is None else number
