"""Sequences that wake a base, change its mode and reset it, with the waits between (REFERENCE 1.1, 2.4).

The waits are deadlines, not sleeps.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.drivers.turtlebot.codec.models import CREATE, Model
from florence_bt.drivers.turtlebot.codec.packets import OiMode
from florence_bt.drivers.turtlebot.parameters import DriveMode


@dataclass(frozen=True, slots=True)
class SequenceStep:
    """One step of a sequence.

    Attributes:
        data: What to send.
        wait_s: Seconds before the next step.
        rts: Level of the line RTS from now on; None leaves it.
    """

    data: bytes = b""
    wait_s: float = 0.0
    rts: bool | None = None


class CommandSequence:
    """A list of steps, sent one by one.

    Attributes:
        rts: The level of the line RTS that the last step asked for; None when none did.
    """

    def __init__(self) -> None:
        self._steps: deque[SequenceStep] = deque()
        self._due: float | None = None
        self.rts: bool | None = None

    @property
    def due(self) -> float | None:
        """Return when the next step (or the end of the last wait) is due; None when the sequence is over."""
        return self._due

    @property
    def busy(self) -> bool:
        """Tell whether something is left to send or to wait for."""
        return self._due is not None

    def begin(self, steps: Iterable[SequenceStep], now: float) -> None:
        """Start a sequence; what is left of an earlier one is dropped."""
        self._steps = deque(steps)
        self._due = now

    def take(self, now: float) -> bytes:
        """Return the bytes that are due by now."""
        out = b""
        while self._due is not None and now >= self._due:
            if not self._steps:
                self._due = None
                break
            step = self._steps.popleft()
            out += step.data
            if step.rts is not None:
                self.rts = step.rts
                # The line changes after the bytes are out: whoever sends must look before the next step.
                self._due = now + step.wait_s
                break
            # From now on, not from when it was due: a late call must not shorten the wait.
            self._due = now + step.wait_s
        return out


MODE_WAIT_S = 0.5
"""After 128, 131 and 132."""

RESET_WAIT_S = 5.0
"""After a soft reset."""

FILL_PARTIAL_COMMAND = commands.start() * 4
"""Completes a command that an earlier program left half sent: it would take our first bytes for its last, at
most four (Drive). The base goes to Passive mode, in which the start-up begins."""

FILL_PARTIAL_COMMAND_KEEPING_MODE = bytes(4)
"""Completes such a command too, for a base that must keep its mode and outputs, as in an emergency stop: a
half Drive command ends with low speeds, and further zeros are not commands."""

WAKE_UP = (
    SequenceStep(wait_s=0.1, rts=False),
    SequenceStep(wait_s=0.75, rts=True),
    *(SequenceStep(wait_s=0.25, rts=level) for level in (False, True) * 3),
)
"""Pulses on RTS."""

ENTER_MODE = {OiMode.SAFE: commands.safe(), OiMode.FULL: commands.full()}


def stand(wanted: OiMode) -> bytes:
    """Stop a base, also one that drives to its dock by itself: that ends with its mode (REFERENCE 1.1)."""
    return ENTER_MODE.get(wanted, b"") + commands.drive_direct(0, 0)


STREAMED_PACKETS = (*range(7, 15), *range(17, 36), 41, 42)
"""Of a Create: all packets but the unused ones (15, 16), the songs and stream count (36 to 38) and those of
the Drive command (39, 40): 75 bytes a frame, where 86 is the limit and all 36 would be 91."""

STREAMED_PACKETS_CREATE_2 = (*range(7, 16), *range(17, 19), *range(21, 32), 34, 35, 37, *range(41, 59))
"""Of a Create 2: all but the unused ones; the encoders measure the motion better than distance and angle."""

DRIVE_PACKETS = (39, 40)
"""Velocity and radius that were asked for last; read in the drive mode that asks for them."""


def streamed_packets(model: Model, drive_mode: DriveMode) -> tuple[int, ...]:
    """Return what to have the base send every 15 ms."""
    packets = STREAMED_PACKETS if model is CREATE else STREAMED_PACKETS_CREATE_2
    return (*packets, *DRIVE_PACKETS) if drive_mode is DriveMode.DRIVE else packets


def enter_mode(wanted: OiMode, then: bytes, *, outputs_on: bool) -> list[SequenceStep]:
    """Go through Passive, which stops the motors, to a mode.

    Args:
        wanted: Passive, Safe or Full.
        then: What to send when the mode is reached.
        outputs_on: Digital outputs are on; on the way to Passive they are switched off first.
    """
    steps = [SequenceStep(commands.passive(), MODE_WAIT_S)]
    if wanted in ENTER_MODE:
        steps.append(SequenceStep(ENTER_MODE[wanted], MODE_WAIT_S))
    elif outputs_on:
        steps.insert(0, SequenceStep(commands.digital_outputs(0)))
    return [*steps, SequenceStep(then)]


def reset(then: bytes, *, outputs_on: bool) -> list[SequenceStep]:
    """Reboot the base; it is in Passive mode afterwards, in which it charges.

    Args:
        then: What to send when it listens again.
        outputs_on: Digital outputs are on; they are switched off first.
    """
    steps = [
        SequenceStep(commands.soft_reset(), RESET_WAIT_S),
        SequenceStep(commands.start(), MODE_WAIT_S),
        SequenceStep(then),
    ]
    return [SequenceStep(commands.digital_outputs(0)), *steps] if outputs_on else steps
