"""Sensor packets of the Open Interface: their sizes, types and ranges (REFERENCE 1.5)."""

from __future__ import annotations

import enum
import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.drivers.turtlebot.codec.models import CREATE, CREATE_2, Model


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
RIGHT_WHEEL_OVERCURRENT, LEFT_WHEEL_OVERCURRENT = 8, 16
"""Bits of packet 14; the others are those of the low side drivers."""

WHEEL_OVERCURRENTS = RIGHT_WHEEL_OVERCURRENT | LEFT_WHEEL_OVERCURRENT
INTERNAL_CHARGER, HOME_BASE = 1, 2
"""Bits of packet 34."""

_FLAG = "?"
_TYPE_RANGES = {"B": (0, 255), "b": (-128, 127), "H": (0, 65535), "h": (-32768, 32767), _FLAG: (0, 1)}


@dataclass(frozen=True, slots=True)
class Packet:
    """One sensor packet.

    Attributes:
        id: Its number on the wire.
        name: The field of :class:`~florence_bt.drivers.turtlebot.codec.state.SensorState` that it fills.
        code: Its type as a ``struct`` character, big-endian; of ``?`` the manual knows the bytes 0 and 1.
        scale: What one count is in the unit of the field; None when the field keeps the count.
        highest: The largest count that the manual knows; None for all that the type holds.
    """

    id: int
    name: str
    code: str
    scale: float | None = None
    highest: int | None = None

    @property
    def size(self) -> int:
        """Bytes on the wire."""
        return struct.calcsize(">" + self.wire_code)

    @property
    def wire_code(self) -> str:
        """The ``struct`` character that keeps the count as it came: a flag of 255 is no mere ``True``."""
        return "B" if self.is_flag else self.code

    @property
    def is_flag(self) -> bool:
        """Tell whether the field is true or false."""
        return self.code == _FLAG

    def is_plausible(self, value: int) -> bool:
        """Tell whether the manual knows this count."""
        lowest, highest = _TYPE_RANGES[self.code]
        return lowest <= value <= (highest if self.highest is None else self.highest)


_MILLI = 1e-3
_DEGREE = math.pi / 180.0
"""Factors from the units on the wire to SI units."""

PACKETS: dict[int, Packet] = {
    packet.id: packet
    for packet in (
        Packet(7, "bumps_wheeldrops", "B", highest=31),
        Packet(8, "wall", _FLAG),
        Packet(9, "cliff_left", _FLAG),
        Packet(10, "cliff_front_left", _FLAG),
        Packet(11, "cliff_front_right", _FLAG),
        Packet(12, "cliff_right", _FLAG),
        Packet(13, "virtual_wall", _FLAG),
        Packet(14, "motor_overcurrents", "B", highest=31),
        Packet(15, "dirt_detector_left", "B"),
        Packet(16, "dirt_detector_right", "B"),
        Packet(17, "remote_opcode", "B"),
        Packet(18, "buttons", "B"),
        Packet(19, "distance", "h", _MILLI),
        Packet(20, "angle", "h", _DEGREE),
        Packet(21, "charging_state", "B", highest=5),
        Packet(22, "voltage", "H"),
        Packet(23, "current", "h"),
        Packet(24, "temperature", "b"),
        Packet(25, "charge", "H"),
        Packet(26, "capacity", "H"),
        Packet(27, "wall_signal", "H", highest=4095),
        Packet(28, "cliff_left_signal", "H", highest=4095),
        Packet(29, "cliff_front_left_signal", "H", highest=4095),
        Packet(30, "cliff_front_right_signal", "H", highest=4095),
        Packet(31, "cliff_right_signal", "H", highest=4095),
        Packet(32, "user_digital_inputs", "B", highest=31),
        Packet(33, "user_analog_input", "H", highest=1023),
        Packet(34, "charging_sources_available", "B", highest=3),
        Packet(35, "oi_mode", "B", highest=3),
        Packet(36, "song_number", "B", highest=15),
        Packet(37, "song_playing", _FLAG),
        Packet(38, "number_of_stream_packets", "B", highest=108),
        Packet(39, "requested_velocity", "h", _MILLI),
        Packet(40, "requested_radius", "h", _MILLI),
        Packet(41, "requested_right_velocity", "h", _MILLI),
        Packet(42, "requested_left_velocity", "h", _MILLI),
        Packet(43, "left_encoder", "H"),
        Packet(44, "right_encoder", "H"),
        Packet(45, "light_bumper", "B", highest=63),
        Packet(46, "light_bump_left_signal", "H", highest=4095),
        Packet(47, "light_bump_front_left_signal", "H", highest=4095),
        Packet(48, "light_bump_center_left_signal", "H", highest=4095),
        Packet(49, "light_bump_center_right_signal", "H", highest=4095),
        Packet(50, "light_bump_front_right_signal", "H", highest=4095),
        Packet(51, "light_bump_right_signal", "H", highest=4095),
        Packet(52, "remote_opcode_left", "B"),
        Packet(53, "remote_opcode_right", "B"),
        Packet(54, "left_motor_current", "h"),
        Packet(55, "right_motor_current", "h"),
        Packet(56, "main_brush_current", "h"),
        Packet(57, "side_brush_current", "h"),
        Packet(58, "stasis", "B", highest=3),
    )
}
"""Every packet by its number; those from 43 on only a Create 2 has."""

USER_ANALOG_INPUT = PACKETS[33]
"""The packet of the input that the gyro is wired to."""

GROUPS: dict[int, range] = dict(CREATE_2.groups)
"""Packets that one number asks for together; those from 100 on only a Create 2 knows."""


def members(packet_id: int) -> Iterator[Packet]:
    """Return the packets that a number stands for: those of a group in order, or the packet itself.

    Raises:
        KeyError: There is no such packet.
    """
    return (PACKETS[member] for member in GROUPS.get(packet_id, (packet_id,)))


def packet_size(packet_id: int) -> int:
    """Return how many bytes of data a packet or group has on the wire."""
    return sum(packet.size for packet in members(packet_id))


def known_packets(packet_ids: Sequence[int], model: Model = CREATE) -> list[int]:
    """Return the numbers as a list.

    Raises:
        ConfigError: The base has no such packet or group.
    """
    unknown = [number for number in packet_ids if number not in model.packets and number not in model.groups]
    if unknown:
        groups = ", ".join(str(group) for group in model.groups)
        raise ConfigError(
            f"{model.name}: there is no sensor packet {unknown[0]}; packets are {model.packets.start} to "
            f"{model.packets.stop - 1} and groups {groups}"
        )
    return list(packet_ids)


def layout(packet_ids: Sequence[int]) -> str:
    """Return the ``struct`` characters of packets or groups in a row, without the byte order."""
    return "".join(packet.wire_code for packet_id in packet_ids for packet in members(packet_id))


def decode_packets(packet_ids: Sequence[int], data: bytes) -> dict[int, int]:
    """Return the counts in an answer to ``sensors`` or ``query_list``, by packet number.

    Args:
        packet_ids: Packets or groups, in the order of the request.
        data: The whole answer.

    Raises:
        FrameError: The length does not fit the request.
    """
    codes = struct.Struct(">" + layout(packet_ids))
    if len(data) != codes.size:
        raise FrameError(f"the answer for {list(packet_ids)} has {codes.size} bytes, not {len(data)}")
    numbers = [packet.id for packet_id in packet_ids for packet in members(packet_id)]
    return dict(zip(numbers, codes.unpack(data), strict=True))


def implausible(values: Mapping[int, int]) -> dict[str, int]:
    """Return the counts that the manual does not know, by the names of their fields.

    Args:
        values: Counts by packet number.
    """
    packets = ((PACKETS[number], value) for number, value in values.items())
    return {packet.name: value for packet, value in packets if not packet.is_plausible(value)}
