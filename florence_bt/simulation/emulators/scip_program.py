"""The emulated scanner alone, on a pseudo-terminal or a TCP port, for any client; ``python -m`` runs it.

The clock is given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from florence_bt.simulation.emulators._lone_program import GARBAGE, LoneProgram
from florence_bt.simulation.emulators._scip_control import ScipControl
from florence_bt.simulation.emulators.scip import MODELS, ScipEmulator
from florence_bt.simulation.emulators.scip_room import ScipRoom

LONGEST_WAIT_S = 0.1


@dataclass(frozen=True, slots=True)
class ScipOptions:
    """How to run it.

    Attributes:
        link: Where to put a link to the device file; None for none.
        tcp_port: Listen on this TCP port of this machine instead (0: any); None for a pseudo-terminal.
        model: A name in ``MODELS``.
        scip1: Wake up in SCIP 1.1.
        seed: Start of the noise; None for perfect distances.
        control: Where to put the socket of the control channel; None for none.
        strict_baud: As on RS-232: a client at the wrong speed understands nothing and is not understood;
            the scanner wakes up with 19200.
        short_status: In SCIP 1.1, answer ``SCIP2.0`` with ``0`` and no sum.
    """

    link: Path | None = None
    tcp_port: int | None = None
    model: str = "urg-04lx"
    scip1: bool = False
    seed: int | None = None
    control: Path | None = None
    strict_baud: bool = False
    short_status: bool = False


class ScipProgram(LoneProgram):
    """Line, scanner and control channel.

    Attributes:
        scanner: The scanner.
        control: Obeys lines of text.
    """

    def __init__(self, options: ScipOptions, clock: Callable[[], float], console: int | None = None) -> None:
        """Open the line and the control channel.

        Args:
            options: How to run it.
            clock: Seconds, never running backwards.
            console: A file descriptor that brings lines of text, such as standard input; None for none.

        Raises:
            DeviceLost: The link, the TCP port or the socket cannot be made.
        """
        super().__init__(options.link, options.tcp_port, options.strict_baud)
        self._start = clock()
        self._clock = clock
        model = MODELS[options.model]
        self.scanner = ScipEmulator(
            ScipRoom(model, options.seed),
            model=model,
            speaks_scip1=options.scip1,
            short_status=options.short_status,
        )
        self.control = ScipControl(self.scanner, self, self.now, options.seed or 0)
        self._listen(self.control, options.control, console)

    def now(self) -> float:
        """Seconds since the start."""
        return self._clock() - self._start

    def step(self) -> None:
        """Serve the line and let the time pass, once."""
        now, line = self.now(), self._line
        baud_rate = self.scanner.state.bit_rate  # SS is answered at the old one
        received = self._as_heard(line.read(), baud_rate) if line is not None else b""
        received = received.replace(bytes([GARBAGE]), b"")  # no letters: the scanner passes over them
        answer = (self.scanner.receive(received, now) if received else b"") + self.scanner.poll(now)
        if answer and line is not None:
            line.write(self._as_heard(answer, baud_rate))

    def _longest_wait(self) -> float:
        due = self.scanner.next_deadline()
        return LONGEST_WAIT_S if due is None else max(0.0, min(LONGEST_WAIT_S, due - self.now()))
