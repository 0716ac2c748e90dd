"""What wakes a base, changes its mode and resets it, with the waits between (REFERENCE 1.1, 2.4)."""

from __future__ import annotations

from florence_bt.drivers.turtlebot import codec
from florence_bt.drivers.turtlebot._script import Step
from florence_bt.drivers.turtlebot.codec.models import CREATE, Model
from florence_bt.drivers.turtlebot.codec.packets import OiMode
from florence_bt.drivers.turtlebot.parameters import DriveMode

MODE_WAIT_S = 0.5
"""After 128, 131 and 132."""

RESET_WAIT_S = 5.0
"""After a soft reset."""

END_OF_HALF_A_COMMAND = codec.start() * 4
"""Whoever had the port before may have gone amid a command, which would take our first bytes for its last: at
most four, of a Drive command. Another Start more than that does no harm."""

ZEROS_FOR_HALF_A_COMMAND = bytes(4)
"""The same for a base that may be driving and must keep its mode and outputs: a half Drive command ends with
low speeds, and a zero more is not a command."""

WAKE_UP = (
    Step(wait_s=0.1, rts=False),
    Step(wait_s=0.75, rts=True),
    *(Step(wait_s=0.25, rts=level) for level in (False, True) * 3),
)
"""Pulses on RTS."""

ENTER_MODE = {OiMode.SAFE: codec.safe(), OiMode.FULL: codec.full()}


def stand(wanted: OiMode) -> bytes:
    """Stops a base, also one that drives to its dock by itself: that ends with its mode (REFERENCE 1.1)."""
    return ENTER_MODE.get(wanted, b"") + codec.drive_direct(0, 0)


STREAMED_PACKETS = (*range(7, 15), *range(17, 36), 41, 42)
"""Of a Create: all packets but the unused ones (15, 16), the songs and stream count (36 to 38) and those of
the Drive command (39, 40): 75 bytes a frame, where 86 is the limit and all 36 would be 91."""

STREAMED_PACKETS_CREATE_2 = (*range(7, 16), *range(17, 19), *range(21, 32), 34, 35, 37, *range(41, 59))
"""Of a Create 2: all but the unused ones; the encoders tell the motion better than distance and angle."""

DRIVE_PACKETS = (39, 40)
"""Velocity and radius that were asked for last; read in the drive mode that asks for them."""


def streamed_packets(model: Model, drive_mode: DriveMode) -> tuple[int, ...]:
    """What to have the base send every 15 ms."""
    packets = STREAMED_PACKETS if model is CREATE else STREAMED_PACKETS_CREATE_2
    return (*packets, *DRIVE_PACKETS) if drive_mode is DriveMode.DRIVE else packets


def enter_mode(wanted: OiMode, then: bytes, *, outputs_on: bool) -> list[Step]:
    """Go through Passive, which stops the motors, to a mode.

    Args:
        wanted: Passive, Safe or Full.
        then: What to send when the mode is reached.
        outputs_on: Digital outputs are on; on the way to Passive they are switched off first.
    """
    steps = [Step(codec.passive(), MODE_WAIT_S)]
    if wanted in ENTER_MODE:
        steps.append(Step(ENTER_MODE[wanted], MODE_WAIT_S))
    elif outputs_on:
        steps.insert(0, Step(codec.digital_outputs(0)))
    return [*steps, Step(then)]


def reset(then: bytes, *, outputs_on: bool) -> list[Step]:
    """Reboot the base; it is in Passive mode afterwards, in which it charges.

    Args:
        then: What to send when it listens again.
        outputs_on: Digital outputs are on; they are switched off first.
    """
    steps = [Step(codec.soft_reset(), RESET_WAIT_S), Step(codec.start(), MODE_WAIT_S), Step(then)]
    return [Step(codec.digital_outputs(0)), *steps] if outputs_on else steps
