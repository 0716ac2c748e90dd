"""The commands of the Open Interface that the driver and its checks send, in units that people use.

Source: REFERENCE 1.3.

Speeds and radii are clamped to what the base can do; anything else outside its range is refused with a
``ConfigError``. The number in each function is the command's opcode.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.turtlebot.codec.models import CREATE, Model
from florence_bt.drivers.turtlebot.codec.packets import known_packets, packet_size

STREAM_OVERHEAD_BYTES = 3
"""Header, length and checksum of a stream frame."""

MAX_WHEEL_SPEED_MMPS = 500
MAX_RADIUS_MM = 2000
MAX_NOTES = 16

STRAIGHT, ALSO_STRAIGHT = -0x8000, 0x7FFF
"""Radii of the Drive command with a meaning of their own, beside 1 and -1."""


def start() -> bytes:
    """Wake the interface; the base is in Passive mode after it, from any mode."""
    return bytes([128])


def passive() -> bytes:
    """Go to Passive mode: sensors only, the motors stop."""
    return start()


def safe() -> bytes:
    """Go to Safe mode: the firmware stops at cliffs, wheel drops and the charger."""
    return bytes([131])


def full() -> bytes:
    """Go to Full mode: no firmware protection."""
    return bytes([132])


def soft_reset() -> bytes:
    """Reboot the controller; it is in mode Off afterwards and needs seconds."""
    return bytes([7])


def cover_and_dock() -> bytes:
    """Cover until the home base is seen, then dock; ends in Passive mode."""
    return bytes([143])


def drive(velocity_mmps: int, radius_mm: int | None) -> bytes:
    """Drive on an arc; persists until the next command. Velocity and radius are clamped.

    Args:
        velocity_mmps: -500 to 500, of the middle of the base.
        radius_mm: -2000 to 2000, positive to the left; None for straight on. 1 and -1 spin on the spot,
            counter-clockwise and clockwise.
    """
    radius = STRAIGHT if radius_mm is None else radius_mm
    if radius not in (STRAIGHT, ALSO_STRAIGHT):
        radius = _clamp(radius, MAX_RADIUS_MM)
    return struct.pack(">Bhh", 137, _clamp(velocity_mmps, MAX_WHEEL_SPEED_MMPS), radius)


def drive_direct(right_mmps: int, left_mmps: int) -> bytes:
    """Set the speed of both wheels; it persists until the next command. Clamped to +-500 mm/s.

    Args:
        right_mmps: Right wheel in mm/s, forward positive; first, as on the wire.
        left_mmps: Left wheel in mm/s.
    """
    speeds = (_clamp(right_mmps, MAX_WHEEL_SPEED_MMPS), _clamp(left_mmps, MAX_WHEEL_SPEED_MMPS))
    return struct.pack(">Bhh", 145, *speeds)


def digital_outputs(bits: int) -> bytes:
    """Switch the three digital outputs.

    Args:
        bits: 0 to 7; bit i is output i.
    """
    return bytes([147, _in_range("bits", bits, 0, 7)])


def leds(bits: int, *, power_colour: int, power_intensity: int) -> bytes:
    """Set the lights.

    Args:
        bits: Of a Create 2 Play and 8 Advance; of a Create 2 1 Debris, 2 Spot, 4 Dock and 8 Check Robot.
        power_colour: 0 green to 255 red.
        power_intensity: 0 to 255.
    """
    lights = {"bits": bits, "colour": power_colour, "intensity": power_intensity}
    return bytes([139, *(_in_range(name, value, 0, 255) for name, value in lights.items())])


def song(number: int, notes: Sequence[tuple[int, int]], model: Model = CREATE) -> bytes:
    """Store a song.

    Args:
        number: 0 to 15, of a Create 2 0 to 4.
        notes: 1 to 16 pairs of a MIDI number (31 to 127, anything else is a rest) and 1/64 s.
        model: The base.
    """
    if not 1 <= len(notes) <= MAX_NOTES:
        raise ConfigError(f"a song has 1 to {MAX_NOTES} notes, not {len(notes)}")
    tail = [_in_range("note or duration", value, 0, 255) for note in notes for value in note]
    return bytes([140, _in_range("song", number, 0, model.songs - 1), len(notes), *tail])


def play_song(number: int, model: Model = CREATE) -> bytes:
    """Play a stored song; ignored while another one plays."""
    return bytes([141, _in_range("song", number, 0, model.songs - 1)])


def sensors(packet_id: int, model: Model = CREATE) -> bytes:
    """Ask once for a packet or group."""
    return bytes([142, *known_packets([packet_id], model)])


def query_list(packet_ids: Sequence[int], model: Model = CREATE) -> bytes:
    """Ask once for several packets; the answer is their data without header or checksum."""
    known = known_packets(packet_ids, model)
    return bytes([149, _in_range("number of packets", len(known), 0, 255), *known])


def stream(packet_ids: Sequence[int], model: Model = CREATE) -> bytes:
    """Ask for packets every 15 ms; an empty list ends the stream.

    Raises:
        ConfigError: There is no such packet, or the frame is too long for the line.
    """
    known = known_packets(packet_ids, model)
    length = STREAM_OVERHEAD_BYTES + sum(1 + packet_size(packet_id) for packet_id in known)
    if length > model.stream_budget_bytes:
        raise ConfigError(
            f"a stream frame of {length} bytes does not fit in 15 ms; at most {model.stream_budget_bytes} do"
        )
    return bytes([148, len(known), *known])


def pause_stream() -> bytes:
    """Silence the stream; its list is kept."""
    return bytes([150, 0])


def resume_stream() -> bytes:
    """Let a paused stream go on."""
    return bytes([150, 1])


def _clamp(value: int, limit: int) -> int:
    return max(-limit, min(limit, value))


def _in_range(name: str, value: int, lowest: int, highest: int) -> int:
    if not lowest <= value <= highest:
        raise ConfigError(f"{name} must be {lowest} to {highest}, not {value}")
    return value
