"""Commands of the Open Interface as bytes (REFERENCE 1.3).

Speeds are clamped to what the base can do; anything else outside its range is refused.
"""

from __future__ import annotations

import enum
import struct
from collections.abc import Sequence

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.turtlebot.codec.packets import GROUPS, PACKETS, packet_size

MAX_WHEEL_SPEED_MMPS = 500
STREAM_BUDGET_BYTES = 86
"""The longest frame that a 57600 baud line carries in the stream's 15 ms (REFERENCE 1.6)."""

STREAM_OVERHEAD_BYTES = 3
"""Header, length and checksum of a stream frame."""


class Opcode(enum.IntEnum):
    """The first byte of each command."""

    SOFT_RESET = 7
    START = 128
    SAFE = 131
    FULL = 132
    LEDS = 139
    SENSORS = 142
    DRIVE_DIRECT = 145
    DIGITAL_OUTPUTS = 147
    STREAM = 148
    QUERY_LIST = 149
    PAUSE_RESUME_STREAM = 150


def start() -> bytes:
    """Wake the interface; the base is in Passive mode after it, from any mode."""
    return bytes([Opcode.START])


def passive() -> bytes:
    """Go to Passive mode: sensors only, the motors stop."""
    return start()


def safe() -> bytes:
    """Go to Safe mode: the firmware stops at cliffs, wheel drops and the charger."""
    return bytes([Opcode.SAFE])


def full() -> bytes:
    """Go to Full mode: no firmware protection."""
    return bytes([Opcode.FULL])


def soft_reset() -> bytes:
    """Reboot the controller; it is in mode Off afterwards and needs seconds."""
    return bytes([Opcode.SOFT_RESET])


def drive_direct(right_mmps: int, left_mmps: int) -> bytes:
    """Set the speed of both wheels; it persists until the next command. Clamped to +-500 mm/s.

    Args:
        right_mmps: Right wheel in mm/s, forward positive; first, as on the wire.
        left_mmps: Left wheel in mm/s.
    """
    return struct.pack(">Bhh", Opcode.DRIVE_DIRECT, _clamp_speed(right_mmps), _clamp_speed(left_mmps))


def digital_outputs(bits: int) -> bytes:
    """Switch the three digital outputs.

    Args:
        bits: 0 to 7; bit i is output i.

    Raises:
        ConfigError: There are no such outputs.
    """
    return bytes([Opcode.DIGITAL_OUTPUTS, _in_range("digital output bits", bits, 0, 7)])


def leds(*, play: bool, advance: bool, power_colour: int, power_intensity: int) -> bytes:
    """Set the lights.

    Args:
        play: Light beside the Play button.
        advance: Light beside the Advance button.
        power_colour: 0 green to 255 red.
        power_intensity: 0 to 255.

    Raises:
        ConfigError: A number is not 0 to 255.
    """
    bits = (2 if play else 0) | (8 if advance else 0)
    colour = _in_range("the power light's colour", power_colour, 0, 255)
    intensity = _in_range("the power light's intensity", power_intensity, 0, 255)
    return bytes([Opcode.LEDS, bits, colour, intensity])


def sensors(packet_id: int) -> bytes:
    """Ask once for a packet or group.

    Raises:
        ConfigError: There is no such packet.
    """
    return bytes([Opcode.SENSORS, *_known([packet_id])])


def query_list(packet_ids: Sequence[int]) -> bytes:
    """Ask once for several packets; the answer is their data without header or checksum.

    Raises:
        ConfigError: There is no such packet, or there are more than 255.
    """
    return bytes(
        [Opcode.QUERY_LIST, _in_range("the number of packets", len(packet_ids), 0, 255), *_known(packet_ids)]
    )


def stream(packet_ids: Sequence[int]) -> bytes:
    """Ask for packets every 15 ms; an empty list ends the stream.

    Raises:
        ConfigError: There is no such packet, or the frame is too long for the line.
    """
    known = _known(packet_ids)
    length = STREAM_OVERHEAD_BYTES + sum(1 + packet_size(packet_id) for packet_id in known)
    if length > STREAM_BUDGET_BYTES:
        raise ConfigError(
            f"a stream frame of {length} bytes does not fit in 15 ms; at most {STREAM_BUDGET_BYTES} do"
        )
    return bytes([Opcode.STREAM, len(known), *known])


def pause_stream() -> bytes:
    """Silence the stream; its list is kept."""
    return bytes([Opcode.PAUSE_RESUME_STREAM, 0])


def resume_stream() -> bytes:
    """Let a paused stream go on."""
    return bytes([Opcode.PAUSE_RESUME_STREAM, 1])


def _clamp_speed(speed_mmps: int) -> int:
    return max(-MAX_WHEEL_SPEED_MMPS, min(MAX_WHEEL_SPEED_MMPS, speed_mmps))


def _in_range(what: str, value: int, lowest: int, highest: int) -> int:
    if not lowest <= value <= highest:
        raise ConfigError(f"{what} must be {lowest} to {highest}, not {value}")
    return value


def _known(packet_ids: Sequence[int]) -> list[int]:
    unknown = [packet_id for packet_id in packet_ids if packet_id not in PACKETS and packet_id not in GROUPS]
    if unknown:
        raise ConfigError(f"there is no sensor packet {unknown[0]}; packets are 7 to 42 and groups 0 to 6")
    return list(packet_ids)
