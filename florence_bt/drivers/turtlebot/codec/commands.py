"""A function for each command of the Open Interface, in units that people use (REFERENCE 1.3).

Speeds and radii are clamped to what the base can do; anything else outside its range is refused with a
``ConfigError``.
"""

from __future__ import annotations

from collections.abc import Sequence

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.turtlebot.codec.command_bytes import Command, encode
from florence_bt.drivers.turtlebot.codec.layouts import (
    ALSO_STRAIGHT,
    MAX_PWM,
    MAX_RADIUS_MM,
    MAX_WHEEL_SPEED_MMPS,
    SPIN_CLOCKWISE,
    SPIN_COUNTER_CLOCKWISE,
    STRAIGHT,
    Opcode,
)
from florence_bt.drivers.turtlebot.codec.models import CREATE, CREATE_2, Model
from florence_bt.drivers.turtlebot.codec.packets import known_packets, packet_size

BAUD_RATES = (300, 600, 1200, 2400, 4800, 9600, 14400, 19200, 28800, 38400, 57600, 115200)
"""By their codes for the Baud command."""

STREAM_OVERHEAD_BYTES = 3
"""Header, length and checksum of a stream frame."""


def start() -> bytes:
    """Wake the interface; the base is in Passive mode after it, from any mode."""
    return encode(Command(Opcode.START))


def baud(rate: int) -> bytes:
    """Change the line's speed until the power goes; wait 100 ms, then talk at the new one.

    Args:
        rate: Bits per second.

    Raises:
        ConfigError: The base does not know this rate.
    """
    if rate not in BAUD_RATES:
        raise ConfigError(f"there is no baud rate {rate}", valid=map(str, BAUD_RATES))
    return encode(Command(Opcode.BAUD, (BAUD_RATES.index(rate),)))


def passive() -> bytes:
    """Go to Passive mode: sensors only, the motors stop."""
    return start()


def safe() -> bytes:
    """Go to Safe mode: the firmware stops at cliffs, wheel drops and the charger."""
    return encode(Command(Opcode.SAFE))


def full() -> bytes:
    """Go to Full mode: no firmware protection."""
    return encode(Command(Opcode.FULL))


def soft_reset() -> bytes:
    """Reboot the controller; it is in mode Off afterwards and needs seconds."""
    return encode(Command(Opcode.SOFT_RESET))


def power_down() -> bytes:
    """Go to sleep (Create 2)."""
    return encode(Command(Opcode.POWER), CREATE_2)


def stop_interface() -> bytes:
    """Leave the interface (Create 2): mode Off, deaf to all but Start."""
    return encode(Command(Opcode.STOP), CREATE_2)


def spot() -> bytes:
    """Clean a spot; ends in Passive mode."""
    return encode(Command(Opcode.SPOT))


def cover() -> bytes:
    """Cover a room; ends in Passive mode."""
    return encode(Command(Opcode.COVER))


def cover_and_dock() -> bytes:
    """Cover until the home base is seen, then dock; ends in Passive mode."""
    return encode(Command(Opcode.COVER_AND_DOCK))


def demo(number: int) -> bytes:
    """Play a built-in demo of the Create.

    Args:
        number: 0 to 9; -1 ends the demo that plays.
    """
    return encode(Command(Opcode.DEMO, (number,)))


def drive(velocity_mmps: int, radius_mm: int | None) -> bytes:
    """Drive on an arc; persists until the next command. Velocity and radius are clamped.

    Args:
        velocity_mmps: -500 to 500, of the middle of the base.
        radius_mm: -2000 to 2000, positive to the left; None for straight on. 1 and -1 spin on the spot,
            counter-clockwise and clockwise.
    """
    velocity = _clamp(velocity_mmps, MAX_WHEEL_SPEED_MMPS)
    radius = STRAIGHT if radius_mm is None else radius_mm
    if radius not in (STRAIGHT, ALSO_STRAIGHT):
        radius = _clamp(radius, MAX_RADIUS_MM)
    return encode(Command(Opcode.DRIVE, (velocity, radius)))


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
    return encode(Command(Opcode.DRIVE_DIRECT, speeds))


def drive_pwm(right: int, left: int) -> bytes:
    """Set the voltage of both wheels (Create 2). Clamped.

    Args:
        right: -255 to 255.
        left: -255 to 255.
    """
    return encode(Command(Opcode.DRIVE_PWM, (_clamp(right, MAX_PWM), _clamp(left, MAX_PWM))), CREATE_2)


def low_side_drivers(bits: int) -> bytes:
    """Switch the three low side drivers; bit i is driver i (0 and 1 carry 0.5 A, 2 carries 1.5 A)."""
    return encode(Command(Opcode.LOW_SIDE_DRIVERS, (bits,)))


def pwm_low_side_drivers(driver2: int, driver1: int, driver0: int) -> bytes:
    """Set the duty of the low side drivers, 0 to 128 each; driver 2 first, as on the wire."""
    return encode(Command(Opcode.PWM_LOW_SIDE_DRIVERS, (driver2, driver1, driver0)))


def digital_outputs(bits: int) -> bytes:
    """Switch the three digital outputs.

    Args:
        bits: 0 to 7; bit i is output i.
    """
    return encode(Command(Opcode.DIGITAL_OUTPUTS, (bits,)))


def leds(bits: int, *, power_colour: int, power_intensity: int) -> bytes:
    """Set the lights.

    Args:
        bits: Of a Create 2 Play and 8 Advance; of a Create 2 1 Debris, 2 Spot, 4 Dock and 8 Check Robot.
        power_colour: 0 green to 255 red.
        power_intensity: 0 to 255.
    """
    return encode(Command(Opcode.LEDS, (bits, power_colour, power_intensity)))


def song(number: int, notes: Sequence[tuple[int, int]], model: Model = CREATE) -> bytes:
    """Store a song.

    Args:
        number: 0 to 15, of a Create 2 0 to 4.
        notes: 1 to 16 pairs of a MIDI number (31 to 127, anything else is a rest) and 1/64 s.
        model: The base.
    """
    if not notes:
        raise ConfigError("a song has 1 to 16 notes, not 0")
    tail = tuple(value for note in notes for value in note)
    return encode(Command(Opcode.SONG, (number,), tail), model)


def play_song(number: int, model: Model = CREATE) -> bytes:
    """Play a stored song; ignored while another one plays."""
    return encode(Command(Opcode.PLAY_SONG, (number,)), model)


def sensors(packet_id: int, model: Model = CREATE) -> bytes:
    """Ask once for a packet or group."""
    return encode(Command(Opcode.SENSORS, tuple(known_packets([packet_id], model))), model)


def query_list(packet_ids: Sequence[int], model: Model = CREATE) -> bytes:
    """Ask once for several packets; the answer is their data without header or checksum."""
    return encode(Command(Opcode.QUERY_LIST, (), tuple(known_packets(packet_ids, model))), model)


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
    return encode(Command(Opcode.STREAM, (), tuple(known)), model)


def pause_stream() -> bytes:
    """Silence the stream; its list is kept."""
    return encode(Command(Opcode.PAUSE_RESUME_STREAM, (0,)))


def resume_stream() -> bytes:
    """Let a paused stream go on."""
    return encode(Command(Opcode.PAUSE_RESUME_STREAM, (1,)))


def send_ir(code: int) -> bytes:
    """Send an infrared byte through low side driver 1."""
    return encode(Command(Opcode.SEND_IR, (code,)))


def script(commands: Sequence[bytes]) -> bytes:
    """Store a script; no commands clear it.

    Args:
        commands: Commands as bytes, at most 100 together.
    """
    return encode(Command(Opcode.SCRIPT, (), tuple(b"".join(commands))))


def play_script() -> bytes:
    """Play the stored script; as its last command it makes the script go round."""
    return encode(Command(Opcode.PLAY_SCRIPT))


def show_script() -> bytes:
    """Ask for the stored script; the answer is its length, then its bytes."""
    return encode(Command(Opcode.SHOW_SCRIPT))


def wait_time(tenths_of_s: int) -> bytes:
    """Do nothing, and listen to nothing, for 0 to 25.5 s."""
    return encode(Command(Opcode.WAIT_TIME, (tenths_of_s,)))


def wait_distance(distance_mm: int) -> bytes:
    """Listen to nothing until the base has gone this far; the sign tells the direction."""
    return encode(Command(Opcode.WAIT_DISTANCE, (distance_mm,)))


def wait_angle(angle_deg: int) -> bytes:
    """Listen to nothing until the base has turned this far, counter-clockwise positive."""
    return encode(Command(Opcode.WAIT_ANGLE, (angle_deg,)))


def wait_event(event: int) -> bytes:
    """Listen to nothing until an event comes (1 to 22, REFERENCE 1.4) or, negative, is over."""
    return encode(Command(Opcode.WAIT_EVENT, (event,)))


def _clamp(value: int, limit: int) -> int:
    return max(-limit, min(limit, value))
