"""A function for each command of the Open Interface, in units that people use (REFERENCE 1.3).

Speeds and radii are clamped to what the base can do; anything else outside its range is refused with a
``ConfigError``. The number in each function is the command's opcode.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.turtlebot.codec.models import CREATE, Model
from florence_bt.drivers.turtlebot.codec.packets import known_packets, packet_size

BAUD_RATES = (300, 600, 1200, 2400, 4800, 9600, 14400, 19200, 28800, 38400, 57600, 115200)
"""By their codes for the Baud command."""

STREAM_OVERHEAD_BYTES = 3
"""Header, length and checksum of a stream frame."""

MAX_WHEEL_SPEED_MMPS = 500
"""Of Drive and Drive Direct; the motors are no faster (REFERENCE 1.1)."""
MAX_RADIUS_MM = 2000
"""The widest arc of Drive."""
MAX_PWM = 255
"""Of Drive PWM."""
MAX_NOTES = 16
"""Of a song."""
MAX_SCRIPT_BYTES = 100
MAX_DUTY = 128
"""A low side driver that is wholly on."""

STRAIGHT, ALSO_STRAIGHT = -0x8000, 0x7FFF
SPIN_CLOCKWISE, SPIN_COUNTER_CLOCKWISE = -1, 1
"""Radii of the Drive command with a meaning of their own."""


def start() -> bytes:
    """Wake the interface; the base is in Passive mode after it, from any mode."""
    return bytes([128])


def baud(rate: int) -> bytes:
    """Change the line's speed until the power goes; wait 100 ms, then talk at the new one.

    Args:
        rate: Bits per second.

    Raises:
        ConfigError: The base does not know this rate.
    """
    if rate not in BAUD_RATES:
        raise ConfigError(f"there is no baud rate {rate}", valid=map(str, BAUD_RATES))
    return bytes([129, BAUD_RATES.index(rate)])


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


def power_down() -> bytes:
    """Go to sleep (Create 2)."""
    return bytes([133])


def stop_interface() -> bytes:
    """Leave the interface (Create 2): mode Off, in which only Start is accepted."""
    return bytes([173])


def spot() -> bytes:
    """Clean a spot; ends in Passive mode."""
    return bytes([134])


def cover() -> bytes:
    """Cover a room; ends in Passive mode."""
    return bytes([135])


def cover_and_dock() -> bytes:
    """Cover until the home base is seen, then dock; ends in Passive mode."""
    return bytes([143])


def demo(number: int) -> bytes:
    """Play a built-in demo of the Create.

    Args:
        number: 0 to 9; -1 ends the demo that plays.
    """
    return struct.pack(">Bb", 136, _in_range("demo", number, -1, 9))


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


def spin(velocity_mmps: int) -> bytes:
    """Turn on the spot.

    Args:
        velocity_mmps: Speed of the wheels, positive turns counter-clockwise.
    """
    return drive(abs(velocity_mmps), SPIN_COUNTER_CLOCKWISE if velocity_mmps >= 0 else SPIN_CLOCKWISE)


def drive_direct(right_mmps: int, left_mmps: int) -> bytes:
    """Set the speed of both wheels; it persists until the next command. Clamped to +-500 mm/s.

    Args:
        right_mmps: Right wheel in mm/s, forward positive; first, as on the wire.
        left_mmps: Left wheel in mm/s.
    """
    speeds = (_clamp(right_mmps, MAX_WHEEL_SPEED_MMPS), _clamp(left_mmps, MAX_WHEEL_SPEED_MMPS))
    return struct.pack(">Bhh", 145, *speeds)


def drive_pwm(right: int, left: int) -> bytes:
    """Set the voltage of both wheels (Create 2). Clamped.

    Args:
        right: -255 to 255.
        left: -255 to 255.
    """
    return struct.pack(">Bhh", 146, _clamp(right, MAX_PWM), _clamp(left, MAX_PWM))


def low_side_drivers(bits: int) -> bytes:
    """Switch the three low side drivers; bit i is driver i (0 and 1 carry 0.5 A, 2 carries 1.5 A)."""
    return bytes([138, _in_range("bits", bits, 0, 7)])


def pwm_low_side_drivers(driver2: int, driver1: int, driver0: int) -> bytes:
    """Set the duty of the low side drivers, 0 to 128 each; driver 2 first, as on the wire."""
    return bytes([144, *(_in_range("duty", duty, 0, MAX_DUTY) for duty in (driver2, driver1, driver0))])


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


def send_ir(code: int) -> bytes:
    """Send an infrared byte through low side driver 1."""
    return bytes([151, _in_range("code", code, 0, 255)])


def script(commands: Sequence[bytes]) -> bytes:
    """Store a script; no commands clear it.

    Args:
        commands: Commands as bytes, at most 100 together.
    """
    whole = b"".join(commands)
    return bytes([152, _in_range("length of the script", len(whole), 0, MAX_SCRIPT_BYTES)]) + whole


def play_script() -> bytes:
    """Play the stored script; as its last command it makes the script go round."""
    return bytes([153])


def show_script() -> bytes:
    """Ask for the stored script; the answer is its length, then its bytes."""
    return bytes([154])


def wait_time(tenths_of_s: int) -> bytes:
    """Do nothing, and accept nothing, for 0 to 25.5 s."""
    return bytes([155, _in_range("tenths of a second", tenths_of_s, 0, 255)])


def wait_distance(distance_mm: int) -> bytes:
    """Accept nothing until the base has gone this far; the sign gives the direction."""
    return struct.pack(">Bh", 156, _in_range("millimetres", distance_mm, -32767, 32767))


def wait_angle(angle_deg: int) -> bytes:
    """Accept nothing until the base has turned this far, counter-clockwise positive."""
    return struct.pack(">Bh", 157, _in_range("degrees", angle_deg, -32767, 32767))


def wait_event(event: int) -> bytes:
    """Accept nothing until an event comes (1 to 22, REFERENCE 1.4) or, negative, is over."""
    _in_range("event without its sign", abs(event), 1, 22)
    return struct.pack(">Bb", 158, event)


def _clamp(value: int, limit: int) -> int:
    return max(-limit, min(limit, value))


def _in_range(name: str, value: int, lowest: int, highest: int) -> int:
    if not lowest <= value <= highest:
        raise ConfigError(f"{name} must be {lowest} to {highest}, not {value}")
    return value
