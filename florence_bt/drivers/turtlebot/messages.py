"""Topics and services of the base, and the values on them, by the interfaces' fields."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from florence_bt.core import topic_names
from florence_bt.core.geometry import Twist2
from florence_bt.core.ports import Delivery, Service, Topic
from florence_bt.core.sensing import Odometry
from florence_bt.drivers.turtlebot.battery import battery_of, is_full
from florence_bt.drivers.turtlebot.codec.packets import ChargingState
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.driver import BaseReading


@dataclass(frozen=True, slots=True)
class BaseOdometry(Odometry):
    """Odometry, and whether it is that of a base at rest, which is surer of it."""

    at_rest: bool = False


@dataclass(frozen=True, slots=True)
class TurnRate:
    """A reading of a gyro about z.

    Attributes:
        stamp: Seconds.
        rate: rad/s.
        yaw: Radians, integrated from the rate.
    """

    stamp: float
    rate: float
    yaw: float


@dataclass(frozen=True, slots=True)
class JointState:
    """The joints, as ``sensor_msgs/JointState`` has them: radians and rad/s."""

    stamp: float
    name: Sequence[str]
    position: Sequence[float]
    velocity: Sequence[float]


STATUS_CHARGING, STATUS_DISCHARGING, STATUS_NOT_CHARGING, STATUS_FULL = 1, 2, 3, 4
HEALTH_GOOD, HEALTH_UNSPECIFIED_FAILURE = 1, 5
TECHNOLOGY_NIMH = 1
"""Values of ``power_supply_status``, ``_health`` and ``_technology`` in ``sensor_msgs/BatteryState``."""
CHARGING = (ChargingState.RECOVERY, ChargingState.CHARGING, ChargingState.TRICKLE)


@dataclass(frozen=True, slots=True)
class BatteryState:
    """The battery, as ``sensor_msgs/BatteryState`` has it: what is not known is NaN.

    Attributes:
        stamp: Seconds.
        voltage: Volts.
        current: Amperes, negative while discharging.
        temperature: Degrees Celsius.
        charge: What is left, Ah.
        capacity: What it holds when full, Ah.
        design_capacity: The same.
        percentage: Charge by capacity, 0 to 1.
        present: The base knows of a battery.
        power_supply_status: One of the constants ``STATUS_``.
        power_supply_health: One of the constants ``HEALTH_``.
        power_supply_technology: ``TECHNOLOGY_NIMH``.
    """

    stamp: float
    voltage: float
    current: float
    temperature: float
    charge: float
    capacity: float
    design_capacity: float
    percentage: float
    present: bool
    power_supply_status: int
    power_supply_health: int
    power_supply_technology: int = TECHNOLOGY_NIMH


def battery_state(reading: BaseReading) -> BatteryState:
    """Return what to tell of the battery."""
    battery, failed = battery_of(reading.state), reading.state.charging_state == ChargingState.FAULT
    capacity = _or_nan(battery.capacity_ah)
    return BatteryState(
        reading.stamp,
        voltage=_or_nan(battery.voltage_v),
        current=_or_nan(battery.current_a),
        temperature=_or_nan(battery.temperature_c),
        charge=_or_nan(battery.charge_ah),
        capacity=capacity,
        design_capacity=capacity,
        percentage=_or_nan(battery.fraction),
        present=battery.capacity_ah is not None,
        power_supply_status=_status(reading.state),
        power_supply_health=HEALTH_UNSPECIFIED_FAILURE if failed else HEALTH_GOOD,
    )


def _status(state: SensorState) -> int:
    if is_full(state):
        return STATUS_FULL
    if state.charging_state in CHARGING:
        return STATUS_CHARGING
    return STATUS_NOT_CHARGING if state.charging_sources_available else STATUS_DISCHARGING


def _or_nan(number: float | None) -> float:
    return math.nan if number is None else number


@dataclass(frozen=True, slots=True)
class DigitalOutputs:
    """The request of ``SetDigitalOutputs``: zero is off."""

    digital_out_0: int
    digital_out_1: int
    digital_out_2: int

    @property
    def bits(self) -> int:
        """Bit i is output i."""
        values = (self.digital_out_0, self.digital_out_1, self.digital_out_2)
        return sum(1 << place for place, value in enumerate(values) if value)


@dataclass(frozen=True, slots=True)
class ModeRequest:
    """The request of ``SetTurtlebotMode``."""

    mode: int


@dataclass(frozen=True, slots=True)
class LedRequest:
    """The request of ``SetLeds``."""

    leds: int
    power_colour: int
    power_intensity: int


@dataclass(frozen=True, slots=True)
class SongRequest:
    """The request of ``PlaySong``."""

    notes: Sequence[int]
    durations: Sequence[float]


@dataclass(frozen=True, slots=True)
class DockRequest:
    """The request of ``std_srvs/SetBool``: whether to dock, or to end that."""

    data: bool


IMU = Topic(topic_names.IMU, TurnRate, interface="sensor_msgs/msg/Imu")
RAW_IMU = Topic(topic_names.RAW_IMU, TurnRate, interface="sensor_msgs/msg/Imu")
STATE = Topic("~/sensor_state", SensorState, interface="florence_interfaces/msg/TurtlebotSensorState")
CREATE_2_STATE = Topic("~/create2_sensors", SensorState, interface="florence_interfaces/msg/Create2Sensors")
JOINTS = Topic(topic_names.JOINT_STATES, JointState, interface="sensor_msgs/msg/JointState")
BATTERY = Topic(topic_names.BATTERY_STATE, BatteryState, Delivery.LATCHED, "sensor_msgs/msg/BatteryState")
COMMANDS = Topic(topic_names.CMD_VEL, Twist2, Delivery.COMMAND)
MANUAL_COMMANDS = Topic(topic_names.MANUAL_CMD_VEL, Twist2, Delivery.COMMAND)
SET_OUTPUTS = Service("~/set_digital_outputs", "florence_interfaces/srv/SetDigitalOutputs", DigitalOutputs)
SET_MODE = Service("~/set_operation_mode", "florence_interfaces/srv/SetTurtlebotMode", ModeRequest)
SET_LEDS = Service("~/set_leds", "florence_interfaces/srv/SetLeds", LedRequest)
PLAY_SONG = Service("~/play_song", "florence_interfaces/srv/PlaySong", SongRequest)
DOCK = Service("~/dock", "std_srvs/srv/SetBool", DockRequest)
