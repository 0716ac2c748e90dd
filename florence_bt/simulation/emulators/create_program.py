"""The emulated Create alone on a pseudo-terminal, for any client; ``python -m`` runs it (``__main__.py``).

One loop serves the line, the time and the lines of text of the control channel. The clock is given.
"""

from __future__ import annotations

import select
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from florence_bt.core.errors import DeviceLost
from florence_bt.simulation.base_noise import PERFECT_BASE, BaseNoiseParameters, BaseSensors
from florence_bt.simulation.emulators._control_channel import ControlChannel
from florence_bt.simulation.emulators._create_control import CreateControl
from florence_bt.simulation.emulators._create_models import MODELS
from florence_bt.simulation.emulators.create import CreateEmulator
from florence_bt.simulation.emulators.kinematic_base import KinematicBase
from florence_bt.simulation.emulators.pty_port import PseudoTerminal

LONGEST_WAIT_S, LONGEST_WAIT_MOVING_S = 0.02, 0.005
"""How often the base looks around while nothing is streamed: scripts, songs, behaviours."""

GARBAGE = 0xFF
"""What a byte looks like that was sent at another speed."""


@dataclass(frozen=True, slots=True)
class CreateOptions:
    """How to run it.

    Attributes:
        link: Where to put a link to the device file; None for none.
        model: ``create`` or ``create2``.
        header_in_checksum: The form of the stream's checksum; None for the model's own.
        seed: Start of the sensors' noise; None for perfect sensors.
        strict_baud: A client at the wrong speed understands nothing and is not understood.
        control: Where to put the socket of the control channel; None for none.
    """

    link: Path | None = None
    model: str = "create"
    header_in_checksum: bool | None = None
    seed: int | None = None
    strict_baud: bool = False
    control: Path | None = None


class CreateProgram:
    """Line, base, control channel and their loop.

    Attributes:
        create: The base.
    """

    def __init__(
        self, options: CreateOptions, clock: Callable[[], float], console: int | None = None
    ) -> None:
        """Open the line and the control channel.

        Args:
            options: How to run it.
            clock: Seconds, never running backwards.
            console: A file descriptor that brings lines of text, such as standard input; None for none.

        Raises:
            DeviceLost: The link or the socket cannot be made.
        """
        self._options = options
        self._clock = clock
        separation_m = MODELS[options.model].wheel_separation_mm / 1000.0
        noise = PERFECT_BASE if options.seed is None else BaseNoiseParameters()
        self._base = KinematicBase(separation_m)
        self.create = CreateEmulator(
            self._base,
            BaseSensors(self._base, options.seed or 0, replace(noise, wheel_separation=separation_m)),
            model=options.model,
            header_in_checksum=options.header_in_checksum,
        )
        self._line: PseudoTerminal | None = PseudoTerminal(options.link)
        self.control = CreateControl(self.create, self._base, self, options.seed or 0)
        try:
            self._talks = ControlChannel(options.control, console)
        except OSError as error:
            self._line.close()
            raise DeviceLost(f"cannot listen at {options.control}: {error}") from error

    @property
    def path(self) -> str:
        """What a client opens; empty while the plug is out."""
        return self._line.path if self._line is not None else ""

    @property
    def plugged(self) -> bool:
        """Whether the line is there."""
        return self._line is not None

    def plug(self) -> None:
        """Put the plug in; nothing happens when it is."""
        if self._line is None:
            self._line = PseudoTerminal(self._options.link)

    def unplug(self) -> None:
        """Pull the plug: the client loses the line; the base goes on."""
        if self._line is not None:
            self._line.unplug()
            self._line = None

    def serve(self, go_on: Callable[[], bool]) -> None:
        """Run until ``quit`` is said or go_on says no."""
        while go_on() and not self.control.ended:
            readers: list[int] = self._talks.descriptors()
            if self._line is not None:
                readers.append(self._line.fileno())
            due = self.create.next_frame()
            wait = LONGEST_WAIT_S if self.create.wheels == (0, 0) else LONGEST_WAIT_MOVING_S
            if due is not None:
                wait = max(0.0, min(wait, due - self._clock()))
            ready, _, _ = select.select(readers, [], [], wait)
            self._talks.serve(ready, self.control.run)
            self.step()

    def step(self) -> None:
        """Serve the line and let the time pass, once."""
        now = self._clock()
        self._base.advance_to(now)
        line = self._line
        received = line.read() if line is not None else b""
        if received and self._wrong_speed():
            received = bytes([GARBAGE]) * len(received)
        answer = (self.create.receive(received, now) if received else b"") + self.create.poll(now)
        if answer and line is not None:
            line.write(bytes([GARBAGE]) * len(answer) if self._wrong_speed() else answer)

    def close(self) -> None:
        """End the line and the control channel."""
        self.unplug()
        self._talks.close()

    def _wrong_speed(self) -> bool:
        line = self._line
        return self._options.strict_baud and line is not None and line.client_baud != self.create.baud_rate
