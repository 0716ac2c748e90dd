"""An emulated device alone on a line: its line with a plug, its loop, and lines of text that make things go wrong."""

from __future__ import annotations

import os
import select
import socket
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Protocol, TypeAlias

from florence_bt.core.errors import ConfigError, DeviceLost, FlorenceError, closest_first
from florence_bt.core.socket_paths import short_path
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.emulators.tcp_line import TcpLine

Line: TypeAlias = PseudoTerminal | TcpLine

GARBAGE = 0xFF
"""What a byte looks like that was sent at another speed."""


class StandaloneEmulator(ABC):
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

    def _received_at_other_end(self, data: bytes, baud_rate: int) -> bytes:
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


Verb: TypeAlias = Callable[[Sequence[str]], str | None]
"""Takes the words after the first one; gives the answer, nothing for ``ok``."""


class Plug(Protocol):
    """The plug of the device's line."""

    @property
    def plugged(self) -> bool:
        """Whether the line is there."""

    def plug(self) -> None:
        """Put it in."""

    def unplug(self) -> None:
        """Pull it out."""


class FaultLines:
    """Obeys lines of text: the first word says what to do, the others how.

    Attributes:
        ended: Whether ``quit`` was said.
    """

    def __init__(self, verbs: Mapping[str, Verb], plug: Plug, help_text: str) -> None:
        """Take the device's own verbs; ``unplug``, ``plug``, ``help`` and ``quit`` are added.

        Args:
            verbs: By their first word.
            plug: The plug of the device's line.
            help_text: The answer to ``help``.
        """
        self.ended = False
        self._plug = plug
        self._verbs: dict[str, Verb] = {
            **verbs,
            "unplug": lambda _words: plug.unplug(),
            "plug": lambda _words: plug.plug(),
            "help": lambda _words: help_text,
            "quit": self._quit,
        }

    def run(self, line: str) -> str:
        """Obey one line.

        Returns:
            ``ok``, what was asked for, or ``error:`` and what would have worked.
        """
        words = line.split()
        if not words:
            return "ok"
        verb = self._verbs.get(words[0])
        try:
            if verb is None:
                raise ConfigError(
                    f"there is no command {words[0]!r}", valid=closest_first(words[0], self._verbs)
                )
            return verb(words[1:]) or "ok"
        except FlorenceError as error:
            return f"error: {error}"

    def _quit(self, _words: Sequence[str]) -> None:
        self.ended = True


def switch(words: Sequence[str]) -> bool:
    """``on`` or ``off``.

    Raises:
        ConfigError: It is neither.
    """
    if list(words) not in (["on"], ["off"]):
        raise ConfigError(f"cannot understand {' '.join(words)!r}", valid=("on", "off"))
    return words[0] == "on"


def number(words: Sequence[str], lowest: float, highest: float) -> float:
    """One number.

    Raises:
        ConfigError: It is no number, or out of the range.
    """
    try:
        value = float(words[0]) if len(words) == 1 else None
    except ValueError:
        value = None
    if value is None or not lowest <= value <= highest:
        raise ConfigError(f"a number from {lowest:g} to {highest:g} is needed, not {' '.join(words)!r}")
    return value


def integer(words: Sequence[str], lowest: int, highest: int) -> int:
    """One whole number.

    Raises:
        ConfigError: It is no whole number, or out of the range.
    """
    value = number(words, lowest, highest)
    if value != int(value):
        raise ConfigError(f"a whole number is needed, not {words[0]!r}")
    return int(value)


def some_of(words: Sequence[str], known: Sequence[str] | Mapping[str, int]) -> Sequence[str]:
    """The words, each of them known; ``none`` stands for no word.

    Raises:
        ConfigError: A word is not known, or there is none.
    """
    if list(words) == ["none"]:
        return ()
    wrong = [word for word in words if word not in known]
    if wrong or not words:
        raise ConfigError(f"cannot understand {' '.join(words)!r}", valid=(*known, "none"))
    return words


LONGEST_LINE = 1000


class ControlChannel:
    """The control channel: lines on the console and on the connections of a Unix socket."""

    def __init__(self, path: Path | None, console: int | None) -> None:
        self._path = path
        self._server: socket.socket | None = None
        self._peers: dict[int, tuple[socket.socket | None, bytearray]] = {}
        if console is not None:
            self._peers[console] = (None, bytearray())
        if path is not None:
            path.unlink(missing_ok=True)
            self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            with short_path(path) as place:
                self._server.bind(place)
            self._server.listen()

    def descriptors(self) -> list[int]:
        """What to wait for."""
        return [*self._peers, *([self._server.fileno()] if self._server is not None else [])]

    def serve(self, ready: list[int], run: Callable[[str], str]) -> None:
        """Obey what came."""
        for descriptor in ready:
            if descriptor in self._peers:
                self._serve_peer(descriptor, run)
            elif self._server is not None and descriptor == self._server.fileno():
                peer, _ = self._server.accept()
                self._peers[peer.fileno()] = (peer, bytearray())

    def close(self) -> None:
        """Hang up and remove the socket."""
        for peer, _ in self._peers.values():
            if peer is not None:
                peer.close()
        if self._server is not None and self._path is not None:
            self._server.close()
            self._path.unlink(missing_ok=True)

    def _serve_peer(self, descriptor: int, run: Callable[[str], str]) -> None:
        peer, waiting = self._peers[descriptor]
        try:
            data = os.read(descriptor, LONGEST_LINE)
        except OSError:
            data = b""  # a peer that broke off has nothing more to say, like one that hung up
        waiting += data
        while (end := waiting.find(b"\n")) >= 0:
            line = waiting[:end].decode(errors="replace")
            del waiting[: end + 1]
            self._answer(peer, run(line))
        if not data or len(waiting) > LONGEST_LINE:
            del self._peers[descriptor]
            if peer is not None:
                peer.close()

    def _answer(self, peer: socket.socket | None, text: str) -> None:
        if peer is None:
            print(text, flush=True)
            return
        try:
            peer.sendall(text.encode() + b"\n")
        except OSError as error:
            print(f"the control channel broke off: {error}", file=sys.stderr)
