"""An emulated device alone on a line: what the programs of all devices share.

One loop serves the line, the time and the lines of text of the control channel.
"""

from __future__ import annotations

import select
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from florence_bt.core.errors import DeviceLost
from florence_bt.simulation.emulators._control_channel import ControlChannel
from florence_bt.simulation.emulators._fault_lines import FaultLines
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.emulators.tcp_line import TcpLine

Line: TypeAlias = PseudoTerminal | TcpLine

GARBAGE = 0xFF
"""What a byte looks like that was sent at another speed."""


class LoneProgram(ABC):
    """A device, its line with a plug, its control channel, and their loop."""

    def __init__(self, link: Path | None, tcp_port: int | None, strict_baud: bool) -> None:
        """Open the line.

        Args:
            link: Where to put a link to the device file of a pseudo-terminal; None for none.
            tcp_port: Listen on this TCP port of this machine instead (0: any); None for a pseudo-terminal.
            strict_baud: A client at the wrong speed understands nothing and is not understood.

        Raises:
            DeviceLost: The link or the TCP port cannot be made.
        """
        self._strict_baud = strict_baud
        self._link = link
        self._tcp_port = tcp_port
        self._line: Line | None = None
        self.plug()

    def _listen(self, control: FaultLines, path: Path | None, console: int | None) -> None:
        """Open the control channel.

        Args:
            control: Obeys its lines.
            path: Where to put its socket; None for none.
            console: A file descriptor that brings lines of text, such as standard input; None for none.

        Raises:
            DeviceLost: The socket cannot be made; the line is closed then.
        """
        self._faults = control
        try:
            self._channel = ControlChannel(path, console)
        except OSError as error:
            self.unplug()
            raise DeviceLost(f"cannot listen at {path}: {error}") from error

    @property
    def path(self) -> str:
        """What a client opens; empty while the plug is out."""
        return self._line.path if self._line is not None else ""

    @property
    def plugged(self) -> bool:
        """Whether the line is there."""
        return self._line is not None

    def plug(self) -> None:
        """Put the plug in; nothing happens when it is.

        Raises:
            DeviceLost: The link or the TCP port cannot be made.
        """
        if self._line is not None:
            return
        if self._tcp_port is None:
            self._line = PseudoTerminal(self._link)
            return
        line = TcpLine(port=self._tcp_port)
        self._line, self._tcp_port = line, line.port

    def unplug(self) -> None:
        """Pull the plug: the client loses the line; the device goes on."""
        if self._line is not None:
            self._line.unplug()
            self._line = None

    def serve(self, go_on: Callable[[], bool]) -> None:
        """Run until ``quit`` is said or go_on says no."""
        while go_on() and not self._faults.ended:
            readers: list[int] = self._channel.descriptors()
            if self._line is not None:
                readers.append(self._line.fileno())
            ready, _, _ = select.select(readers, [], [], self._longest_wait())
            self._channel.serve(ready, self._faults.run)
            self.step()

    def _as_heard(self, data: bytes, baud_rate: int) -> bytes:
        """What one end of the line makes of what the other sent.

        Args:
            data: What was sent.
            baud_rate: The device's speed.
        """
        line = self._line
        if self._strict_baud and isinstance(line, PseudoTerminal) and line.client_baud != baud_rate:
            return bytes([GARBAGE]) * len(data)
        return data

    @abstractmethod
    def step(self) -> None:
        """Serve the line and let the time pass, once."""

    @abstractmethod
    def _longest_wait(self) -> float:
        """How long the device has nothing to do unless something arrives, in seconds."""

    def close(self) -> None:
        """End the line and the control channel."""
        self.unplug()
        self._channel.close()
