"""The emulated scanner alone, on a pseudo-terminal or a TCP port, for any client; ``python -m`` runs it.

One loop serves the line, the time and the lines of text of the control channel. The clock is given.
"""

from __future__ import annotations

import select
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from florence_bt.core.errors import DeviceLost
from florence_bt.simulation.emulators._control_channel import ControlChannel
from florence_bt.simulation.emulators._scip_control import ScipControl
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.emulators.scip import MODELS, ScipEmulator
from florence_bt.simulation.emulators.scip_room import ScipRoom
from florence_bt.simulation.emulators.tcp_line import TcpLine

LONGEST_WAIT_S = 0.1

Line: TypeAlias = PseudoTerminal | TcpLine


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
    """

    link: Path | None = None
    tcp_port: int | None = None
    model: str = "urg-04lx"
    scip1: bool = False
    seed: int | None = None
    control: Path | None = None


class ScipProgram:
    """Line, scanner, control channel and their loop.

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
        self._options = options
        self._start = clock()
        self._clock = clock
        model = MODELS[options.model]
        self.scanner = ScipEmulator(ScipRoom(model, options.seed), model=model, speaks_scip1=options.scip1)
        self._tcp_port = options.tcp_port
        self._line: Line | None = None
        self.plug()
        self.control = ScipControl(self.scanner, self, self.now, options.seed or 0)
        try:
            self._channel = ControlChannel(options.control, console)
        except OSError as error:
            self.unplug()
            raise DeviceLost(f"cannot listen at {options.control}: {error}") from error

    def now(self) -> float:
        """Seconds since the start."""
        return self._clock() - self._start

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
        if self._line is not None:
            return
        if self._tcp_port is None:
            self._line = PseudoTerminal(self._options.link)
            return
        line = TcpLine(port=self._tcp_port)
        self._line, self._tcp_port = line, line.port

    def unplug(self) -> None:
        """Pull the plug: the client loses the line; the scanner goes on."""
        if self._line is not None:
            self._line.unplug()
            self._line = None

    def serve(self, go_on: Callable[[], bool]) -> None:
        """Run until ``quit`` is said or go_on says no."""
        while go_on() and not self.control.ended:
            readers: list[int] = self._channel.descriptors()
            if self._line is not None:
                readers.append(self._line.fileno())
            due = self.scanner.next_deadline()
            wait = LONGEST_WAIT_S if due is None else max(0.0, min(LONGEST_WAIT_S, due - self.now()))
            ready, _, _ = select.select(readers, [], [], wait)
            self._channel.serve(ready, self.control.run)
            self.step()

    def step(self) -> None:
        """Serve the line and let the time pass, once."""
        now, line = self.now(), self._line
        received = line.read() if line is not None else b""
        answer = (self.scanner.receive(received, now) if received else b"") + self.scanner.poll(now)
        if answer and line is not None:
            line.write(answer)

    def close(self) -> None:
        """End the line and the control channel."""
        self.unplug()
        self._channel.close()
