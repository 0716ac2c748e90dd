"""The emulated Create alone, on a pseudo-terminal or a TCP port, for any client; ``python -m`` runs it.

The clock is given.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from florence_bt.simulation.emulators._create_control import CreateControl
from florence_bt.simulation.emulators._create_models import MODELS
from florence_bt.simulation.emulators._lone_program import LoneProgram
from florence_bt.simulation.emulators.create import CreateEmulator
from florence_bt.simulation.emulators.kinematic_base import KinematicBase
from florence_bt.simulation.sensors.base_noise import PERFECT_BASE, BaseNoiseParameters, BaseSensors

LONGEST_WAIT_S, LONGEST_WAIT_MOVING_S = 0.02, 0.005
"""How often the base looks around while nothing is streamed: scripts, songs, behaviours."""


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
        tcp_port: Listen on this TCP port of this machine instead (0: any); None for a pseudo-terminal.
        latency_s: How much later everything leaves. A real base needs 10 to 20 ms for an answer (REFERENCE
            1.6), and some clients throw away what came before they begin to listen.
        keeps_input: What comes while a wait runs is obeyed after it, not ignored.
    """

    link: Path | None = None
    model: str = "create"
    header_in_checksum: bool | None = None
    seed: int | None = None
    strict_baud: bool = False
    control: Path | None = None
    tcp_port: int | None = None
    latency_s: float = 0.0
    keeps_input: bool = False


class CreateProgram(LoneProgram):
    """Line, base and control channel.

    Attributes:
        create: The base.
        control: Obeys lines of text.
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
            DeviceLost: The link, the TCP port or the socket cannot be made.
        """
        super().__init__(options.link, options.tcp_port, options.strict_baud)
        self._latency_s = options.latency_s
        self._leaving: deque[tuple[float, bytes]] = deque()
        self._clock = clock
        separation_m = MODELS[options.model].wheel_separation_mm / 1000.0
        noise = PERFECT_BASE if options.seed is None else BaseNoiseParameters()
        self._passed = clock()
        self._base = KinematicBase(separation_m)
        self.create = CreateEmulator(
            self._base,
            BaseSensors(self._base, options.seed or 0, replace(noise, wheel_separation=separation_m)),
            model=options.model,
            header_in_checksum=options.header_in_checksum,
            keeps_input=options.keeps_input,
        )
        self.control = CreateControl(self.create, self._base, self, clock, options.seed or 0)
        self._listen(self.control, options.control, console)

    def step(self) -> None:
        """Serve the line and let the time pass, once."""
        now = self._clock()
        answer = self._pass_time(now)
        self._base.advance_to(now)
        line = self._line
        received = self._as_heard(line.read(), self.create.baud_rate) if line is not None else b""
        answer += (self.create.receive(received, now) if received else b"") + self.create.poll(now)
        if answer:
            self._leaving.append((now + self._latency_s, answer))
        while self._leaving and now >= self._leaving[0][0]:
            leaves = self._leaving.popleft()[1]
            if line is not None:
                line.write(self._as_heard(leaves, self.create.baud_rate))

    def _pass_time(self, now: float) -> bytes:
        """Let the time since the last step pass, in short pieces while the base moves: scripts watch it."""
        said = b""
        while self.create.wheels != (0, 0) and now - self._passed > LONGEST_WAIT_MOVING_S:
            self._passed += LONGEST_WAIT_MOVING_S
            self._base.advance_to(self._passed)
            said += self.create.poll(self._passed)
        self._passed = now
        return said

    def _longest_wait(self) -> float:
        due = [LONGEST_WAIT_S if self.create.wheels == (0, 0) else LONGEST_WAIT_MOVING_S]
        now, frame = self._clock(), self.create.next_frame()
        if frame is not None:
            due.append(frame - now)
        if self._leaving:
            due.append(self._leaving[0][0] - now)
        return max(0.0, min(due))
