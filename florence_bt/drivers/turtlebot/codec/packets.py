"""Sensor packets 7 to 42 of the Open Interface: their sizes, types and meaning (REFERENCE 1.5, 2.6)."""

from __future__ import annotations

import enum
import math
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from florence_bt.core.errors import FrameError


class OiMode(enum.IntEnum):
    """Operating modes, the values of packet 35 (REFERENCE 1.2)."""

    OFF = 0
    PASSIVE = 1
    SAFE = 2
    FULL = 3


class ChargingState(enum.IntEnum):
    """The values of packet 21."""

    NOT_CHARGING = 0
    RECOVERY = 1
    CHARGING = 2
    TRICKLE = 3
    WAITING = 4
    FAULT = 5


BUMP_RIGHT, BUMP_LEFT, DROP_RIGHT, DROP_LEFT, DROP_CASTER = 1, 2, 4, 8, 16
"""Bits of packet 7."""

BUMPS = BUMP_RIGHT | BUMP_LEFT
WHEEL_DROPS = DROP_RIGHT | DROP_LEFT | DROP_CASTER
INTERNAL_CHARGER, HOME_BASE = 1, 2
"""Bits of packet 34."""


@dataclass(frozen=True, slots=True)
class Packet:
    """One sensor packet.

    Attributes:
        id: Its number on the wire.
        name: The field of :class:`SensorState` that it fills.
        code: Its type as a ``struct`` character, big-endian.
        scale: What one count is in the unit of the field; None when the field keeps the count.
    """

    id: int
    name: str
    code: str
    scale: float | None = None

    @property
    def size(self) -> int:
        """Bytes on the wire."""
        return struct.calcsize(">" + self.code)


_MILLI = 1e-3
_DEGREE = math.pi / 180.0

PACKETS: dict[int, Packet] = {
    packet.id: packet
    for packet in (
        Packet(7, "bumps_wheeldrops", "B"),
        Packet(8, "wall", "?"),
        Packet(9, "cliff_left", "?"),
        Packet(10, "cliff_front_left", "?"),
        Packet(11, "cliff_front_right", "?"),
        Packet(12, "cliff_right", "?"),
        Packet(13, "virtual_wall", "?"),
        Packet(14, "motor_overcurrents", "B"),
        Packet(15, "dirt_detector_left", "B"),
        Packet(16, "dirt_detector_right", "B"),
        Packet(17, "remote_opcode", "B"),
        Packet(18, "buttons", "B"),
        Packet(19, "distance", "h", _MILLI),
        Packet(20, "angle", "h", _DEGREE),
        Packet(21, "charging_state", "B"),
        Packet(22, "voltage", "H"),
        Packet(23, "current", "h"),
        Packet(24, "temperature", "b"),
        Packet(25, "charge", "H"),
        Packet(26, "capacity", "H"),
        Packet(27, "wall_signal", "H"),
        Packet(28, "cliff_left_signal", "H"),
        Packet(29, "cliff_front_left_signal", "H"),
        Packet(30, "cliff_front_right_signal", "H"),
        Packet(31, "cliff_right_signal", "H"),
        Packet(32, "user_digital_inputs", "B"),
        Packet(33, "user_analog_input", "H"),
        Packet(34, "charging_sources_available", "B"),
        Packet(35, "oi_mode", "B"),
        Packet(36, "song_number", "B"),
        Packet(37, "song_playing", "?"),
        Packet(38, "number_of_stream_packets", "B"),
        Packet(39, "requested_velocity", "h", _MILLI),
        Packet(40, "requested_radius", "h", _MILLI),
        Packet(41, "requested_right_velocity", "h", _MILLI),
        Packet(42, "requested_left_velocity", "h", _MILLI),
    )
}
"""Every packet by its number."""

GROUPS: dict[int, range] = {
    0: range(7, 27),
    1: range(7, 17),
    2: range(17, 21),
    3: range(21, 27),
    4: range(27, 35),
    5: range(35, 43),
    6: range(7, 43),
}
"""Packets that one number asks for together."""


def members(packet_id: int) -> Iterator[Packet]:
    """The packets that a number stands for: those of a group in order, or the packet itself.

    Raises:
        KeyError: There is no such packet.
    """
    return (PACKETS[member] for member in GROUPS.get(packet_id, (packet_id,)))


def packet_size(packet_id: int) -> int:
    """How many bytes of data a packet or group has on the wire."""
    return sum(packet.size for packet in members(packet_id))


@dataclass(frozen=True, slots=True)
class SensorState:
    """Everything the base tells about itself; the fields of TurtlebotSensorState but the header.

    Attributes:
        bumps_wheeldrops: Bits: bump right, bump left, drop right, drop left, drop caster.
        wall: The right-hand wall sensor sees one.
        cliff_left: The floor is missing there.
        cliff_front_left: The floor is missing there.
        cliff_front_right: The floor is missing there.
        cliff_right: The floor is missing there.
        virtual_wall: An infrared wall is seen.
        motor_overcurrents: Bits.
        dirt_detector_left: Always 0 on a Create.
        dirt_detector_right: Always 0 on a Create.
        remote_opcode: Infrared byte, 255 for nothing.
        buttons: Bits: 0 Play, 2 Advance.
        distance: Metres since the last read, forward positive.
        angle: Radians since the last read, counter-clockwise positive, in steps of one degree.
        charging_state: See :class:`ChargingState`.
        voltage: Battery, mV.
        current: mA, negative while discharging.
        temperature: Battery, degrees Celsius.
        charge: mAh.
        capacity: mAh.
        wall_signal: 0 to 4095.
        cliff_left_signal: 0 to 4095.
        cliff_front_left_signal: 0 to 4095.
        cliff_front_right_signal: 0 to 4095.
        cliff_right_signal: 0 to 4095.
        user_digital_outputs: Bits that the host set last; the base does not tell them.
        user_digital_inputs: Bits.
        user_analog_input: 0 to 1023 for 0 to 5 V; the gyro.
        charging_sources_available: Bits: 0 internal charger, 1 home base.
        oi_mode: See :class:`OiMode`.
        song_number: Selected song.
        song_playing: A song plays.
        number_of_stream_packets: Packets in the stream.
        requested_velocity: m/s, from Drive.
        requested_radius: m, from Drive.
        requested_right_velocity: m/s, from Drive Direct.
        requested_left_velocity: m/s, from Drive Direct.
    """

    bumps_wheeldrops: int = 0
    wall: bool = False
    cliff_left: bool = False
    cliff_front_left: bool = False
    cliff_front_right: bool = False
    cliff_right: bool = False
    virtual_wall: bool = False
    motor_overcurrents: int = 0
    dirt_detector_left: int = 0
    dirt_detector_right: int = 0
    remote_opcode: int = 255
    buttons: int = 0
    distance: float = 0.0
    angle: float = 0.0
    charging_state: int = 0
    voltage: int = 0
    current: int = 0
    temperature: int = 0
    charge: int = 0
    capacity: int = 0
    wall_signal: int = 0
    cliff_left_signal: int = 0
    cliff_front_left_signal: int = 0
    cliff_front_right_signal: int = 0
    cliff_right_signal: int = 0
    user_digital_outputs: int = 0
    user_digital_inputs: int = 0
    user_analog_input: int = 0
    charging_sources_available: int = 0
    oi_mode: int = 0
    song_number: int = 0
    song_playing: bool = False
    number_of_stream_packets: int = 0
    requested_velocity: float = 0.0
    requested_radius: float = 0.0
    requested_right_velocity: float = 0.0
    requested_left_velocity: float = 0.0

    @property
    def cliff(self) -> bool:
        """Whether any of the four cliff sensors misses the floor."""
        return self.cliff_left or self.cliff_front_left or self.cliff_front_right or self.cliff_right

    @property
    def wheels_stopped(self) -> bool:
        """Whether the base was last told to stand still."""
        return self.requested_left_velocity == 0.0 and self.requested_right_velocity == 0.0


def state_from_values(values: Mapping[int, int], user_digital_outputs: int = 0) -> SensorState:
    """Build a state from packet values; packets that are not there leave the field's default.

    Args:
        values: Counts as they came over the wire, by packet number.
        user_digital_outputs: The bits that the host set last.
    """
    fields = {}
    for packet_id, value in values.items():
        packet = PACKETS[packet_id]
        fields[packet.name] = value if packet.scale is None else value * packet.scale
    return SensorState(user_digital_outputs=user_digital_outputs, **fields)  # type: ignore[arg-type]


_GROUP6 = struct.Struct(">" + "".join(packet.code for packet in members(6)))


def decode_group6(data: bytes) -> SensorState:
    """Decode the answer to ``sensors(6)``: every packet from 7 to 42.

    Args:
        data: 52 bytes.

    Raises:
        FrameError: The length is not 52.
    """
    if len(data) != _GROUP6.size:
        raise FrameError(f"group 6 has {_GROUP6.size} bytes, not {len(data)}")
    return state_from_values(dict(zip(GROUPS[6], _GROUP6.unpack(data), strict=True)))
