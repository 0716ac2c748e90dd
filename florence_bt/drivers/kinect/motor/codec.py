"""The control transfers of the Kinect's motor, light and accelerometer. No USB, no time.

Source: REFERENCE 5.5.
"""

from __future__ import annotations

import enum
import math
import struct
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError, FrameError

WRITE, READ = 0x40, 0xC0
"""bmRequestType of the transfers."""
SET_LED, INITIALISE, SET_TILT, READ_STATE = 0x06, 0x10, 0x31, 0x32
"""bRequest of the transfers."""

READY = 0x22
"""Answer of the motor to INITIALISE."""

STATE_SIZE = 10
"""Bytes of the answer to READ_STATE."""
_STATE = struct.Struct(">2xhhhbB")

COUNTS_PER_G = 819
GRAVITY = 9.80665
"""m/s², of the device's g."""
TILT_LIMIT_DEG = 31.0
"""To both sides of the horizon, as libfreenect clamps it."""
RECOMMENDED_TILT_DEG = 27.0
"""By the manufacturer; REFERENCE 5.5 has it unverified."""
LARGEST_LED = 7
"""The last of the light's options."""
_TILT_UNKNOWN = -128
"""Half degrees that are told while the motor moves; REFERENCE 5.5 has it unverified."""


class TiltStatus(enum.IntEnum):
    """The states of the motor."""

    STOPPED = 0
    LIMIT = 1
    MOVING = 4


@dataclass(frozen=True, slots=True)
class MotorRequest:
    """A control transfer without data.

    Attributes:
        request: bRequest.
        value: wValue, 0..65535.
    """

    request: int
    value: int


@dataclass(frozen=True, slots=True)
class MotorState:
    """The state of the device, as it reports it.

    Attributes:
        counts: Acceleration along x, y and z, 819 a g; at rest and level y is 819.
        half_degrees: Angle above the horizon; None while it is not known (moving).
        status: What the motor does; a number for what the manual does not list.
    """

    counts: tuple[int, int, int]
    half_degrees: int | None
    status: int

    @property
    def acceleration(self) -> tuple[float, float, float]:
        """Acceleration along x, y and z, m/s²."""
        x, y, z = (count / COUNTS_PER_G * GRAVITY for count in self.counts)
        return x, y, z

    @property
    def tilt_deg(self) -> float | None:
        """Degrees above the horizon, None while it is not known."""
        return None if self.half_degrees is None else self.half_degrees / 2.0


def tilt_request(degrees: float) -> MotorRequest:
    """Tilt the head; beyond 31 degrees it is tilted by 31.

    Raises:
        ConfigError: The angle is not a number.
    """
    if not math.isfinite(degrees):
        raise ConfigError(f"cannot tilt the Kinect to {degrees}", valid=["-31..31 degrees"])
    half = round(2.0 * max(-TILT_LIMIT_DEG, min(TILT_LIMIT_DEG, degrees)))
    return MotorRequest(SET_TILT, half & 0xFFFF)


def led_request(option: int) -> MotorRequest:
    """Set the light.

    Args:
        option: 0 off, 1 green, 2 red, 3 yellow, 4 and 5 green blinking, 6 and 7 red and yellow blinking.

    Raises:
        ConfigError: There is no such option.
    """
    if not 0 <= option <= LARGEST_LED:
        raise ConfigError(f"the Kinect's light has no option {option}", valid=[f"0..{LARGEST_LED}"])
    return MotorRequest(SET_LED, option)


def decode_state(data: bytes) -> MotorState:
    """Decode the answer to READ_STATE.

    Raises:
        FrameError: It has not ten bytes.
    """
    if len(data) != STATE_SIZE:
        raise FrameError(f"the Kinect's motor answered {len(data)} bytes instead of {STATE_SIZE}")
    x, y, z, tilt, status = _STATE.unpack(data)
    return MotorState((x, y, z), None if tilt == _TILT_UNKNOWN else tilt, status)
