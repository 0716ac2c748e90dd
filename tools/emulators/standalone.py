"""An emulated device alone on a line: options, loop, plug, and the lines of text that cause faults."""

from __future__ import annotations

import os
import random
import select
import socket
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeAlias

from florence_bt.core.errors import ConfigError, DeviceLost, FlorenceError, closest_first
from florence_bt.core.socket_paths import short_path
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from tools.emulators.tcp_line import TcpLine

Line: TypeAlias = PseudoTerminal | TcpLine

GARBAGE = 0xFF
"""A byte that was sent at another speed, as it arrives."""

MOST_NOISE = 10_000


@dataclass(frozen=True, slots=True)
class StandaloneOptions:
    """The options of a device that runs alone.

    Attributes:
        link: Where to put a link to the device file of a pseudo-terminal; None for none.
        tcp_port: Listen on this TCP port of this machine instead (0: any); None for a pseudo-terminal.
        model: The name of the device's model; empty for the usual one.
        seed: Start of the sensors' noise; None for perfect sensors.
        strict_baud: A client at the wrong speed understands nothing and is not understood.
        control: Where to put the socket of the control channel; None for none.
    """

    link: Path | None = None
    tcp_port: int | None = None
    model: str = ""
    seed: int | None = None
    strict_baud: bool = False
    control: Path | None = None


@dataclass(frozen=True, slots=True)
class ControlCommand:
    """A command of the control channel.

    Attributes:
        usage: The command and its arguments, for people.
        meaning: What it does, for people.
        run: Takes the words after the first one; gives the answer, None for ``ok``.
    """

    usage: str
    meaning: str
    run: Callable[[list[str]], str | None]


class StandaloneEmulator(ABC):
    """A device, its line with a plug, its control channel, and their loop.

    A subclass makes the device, then calls :meth:`_listen`.

    Attributes:
        ended: Whether the command ``quit`` came.
    """

    faults: Any
    """The faults: the dataclass of the device."""

    def __init__(self, options: StandaloneOptions) -> None:
        """Open the line.

        Args:
            options: How to run it.

        Raises:
            DeviceLost: The link or the TCP port cannot be made.
        """
        self._options = options
        self._tcp_port = options.tcp_port
        self._random = random.Random(options.seed or 0)
        self._line: Line | None = None
        self._commands: dict[str, ControlCommand] = {}
        self.ended = False
        self.plug()

    def _listen(self, console: int | None) -> None:
        """Open the control channel.

        Args:
            console: A file descriptor that brings lines of text, such as standard input; None for none.

        Raises:
            DeviceLost: The socket cannot be made; the line is closed then.
        """
        commands = (
            self.fault("silent on|off", "what the device sends is lost", switch),
            self.fault("commands_lost on|off", "what the device is sent is lost", switch),
            ControlCommand("noise COUNT", "so many random bytes before what is sent next", self._noise),
            self.fault("bad_checksums NUMBER", "the next frames or scans have a wrong checksum", COUNT),
            *self.control_commands(),
            ControlCommand(
                "power on|off",
                "off forgets everything; on starts it",
                lambda words: self.set_power(switch(words)),
            ),
            ControlCommand(
                "unplug", "pull the plug: the device file or TCP port is gone", lambda _words: self.unplug()
            ),
            ControlCommand("plug", "put the plug back in", lambda _words: self.plug()),
            ControlCommand("clear", "all of the above undone", self._clear),
            ControlCommand("status", "the device as one line of JSON", lambda _words: self.status()),
            ControlCommand("help", "this list", lambda _words: self._help()),
            ControlCommand("quit", "end the program", self._quit),
        )
        self._commands = {command.usage.split()[0]: command for command in commands}
        path = self._options.control
        try:
            self._channel = ControlChannel(path, console)
        except OSError as error:
            self.unplug()
            raise DeviceLost(f"cannot listen at {path}: {error}") from error

    @property
    def path(self) -> str:
        """Return the path that a client opens; empty while the plug is out."""
        return self._line.path if self._line is not None else ""

    @property
    def plugged(self) -> bool:
        """Tell whether the line is there."""
        return self._line is not None

    def plug(self) -> None:
        """Put the plug in; nothing happens when it is.

        Raises:
            DeviceLost: The link or the TCP port cannot be made.
        """
        if self._line is not None:
            return
        if self._tcp_port is None:
            self._line = PseudoTerminal(self._options.link)
            return
        line = TcpLine(port=self._tcp_port)
        self._line, self._tcp_port = line, line.port

    def unplug(self) -> None:
        """Pull the plug: the client loses the line; the device goes on."""
        if self._line is not None:
            self._line.unplug()
            self._line = None

    def serve(self, go_on: Callable[[], bool]) -> None:
        """Run until the command ``quit`` comes or go_on is no longer true."""
        while go_on() and not self.ended:
            readers: list[int] = self._channel.descriptors()
            if self._line is not None:
                readers.append(self._line.fileno())
            ready, _, _ = select.select(readers, [], [], self._longest_wait())
            self._channel.serve(ready, self.run)
            self.step()

    def run(self, line: str) -> str:
        """Run one line of the control channel.

        Returns:
            ``ok``, what was asked for, or ``error:`` and what would have worked.
        """
        words = line.split()
        if not words:
            return "ok"
        command = self._commands.get(words[0])
        try:
            if command is None:
                raise ConfigError(
                    f"there is no command {words[0]!r}", valid=closest_first(words[0], self._commands)
                )
            return command.run(words[1:]) or "ok"
        except FlorenceError as error:
            return f"error: {error}"

    def _received_at_other_end(self, data: bytes, baud_rate: int) -> bytes:
        """Return what one end of the line makes of what the other sent.

        Args:
            data: What was sent.
            baud_rate: The device's speed.
        """
        line = self._line
        if self._options.strict_baud and isinstance(line, PseudoTerminal) and line.client_baud != baud_rate:
            return bytes([GARBAGE]) * len(data)
        return data

    @abstractmethod
    def step(self) -> None:
        """Serve the line and let the time pass, once."""

    @abstractmethod
    def control_commands(self) -> Sequence[ControlCommand]:
        """Return the device's own commands of the control channel."""

    @abstractmethod
    def set_power(self, on: bool) -> None:
        """Switch the device on or off."""

    @abstractmethod
    def status(self) -> str:
        """Describe the device as JSON."""

    @abstractmethod
    def _longest_wait(self) -> float:
        """Return how long the device has nothing to do unless something arrives, in seconds."""

    def close(self) -> None:
        """End the line and the control channel."""
        self.unplug()
        self._channel.close()

    def fault(
        self, usage: str, meaning: str, read: Callable[[list[str]], Any], *, field: str = ""
    ) -> ControlCommand:
        """Make a command that sets a fault.

        Args:
            usage: The command and its arguments.
            meaning: What it does, for people.
            read: The value of the fault from the words after the first one.
            field: The fault; the one called like the command when not given.
        """
        name = field or usage.split()[0]
        return ControlCommand(usage, meaning, lambda words: setattr(self.faults, name, read(words)))

    def _noise(self, words: list[str]) -> None:
        self.faults.noise += self._random.randbytes(integer(0, MOST_NOISE)(words))

    def _clear(self, _words: list[str]) -> None:
        fresh = type(self.faults)()
        for field in fields(fresh):
            setattr(self.faults, field.name, getattr(fresh, field.name))
        self.set_power(True)
        self.plug()

    def _help(self) -> str:
        return "\n".join(f"{command.usage:<26}{command.meaning}" for command in self._commands.values())

    def _quit(self, _words: list[str]) -> None:
        self.ended = True


def switch(words: Sequence[str]) -> bool:
    """Read ``on`` or ``off``.

    Raises:
        ConfigError: It is neither.
    """
    if list(words) not in (["on"], ["off"]):
        raise ConfigError(f"cannot understand {' '.join(words)!r}", valid=("on", "off"))
    return words[0] == "on"


def number(lowest: float, highest: float) -> Callable[[Sequence[str]], float]:
    """Make a reader of one number in a range; raises ConfigError for anything else."""

    def read(words: Sequence[str]) -> float:
        try:
            value = float(words[0]) if len(words) == 1 else None
        except ValueError:
            value = None
        if value is None or not lowest <= value <= highest:
            raise ConfigError(f"a number from {lowest:g} to {highest:g} is needed, not {' '.join(words)!r}")
        return value

    return read


def integer(lowest: int, highest: int) -> Callable[[Sequence[str]], int]:
    """Make a reader of one whole number in a range; raises ConfigError for anything else."""

    def read(words: Sequence[str]) -> int:
        value = number(lowest, highest)(words)
        if value != int(value):
            raise ConfigError(f"a whole number is needed, not {words[0]!r}")
        return int(value)

    return read


COUNT = integer(0, 1_000_000)
"""Reads how many frames, answers or bytes something happens to."""


def some_of(words: Sequence[str], known: Sequence[str] | Mapping[str, int]) -> Sequence[str]:
    """Return the words, each of them known; ``none`` stands for no word.

    Raises:
        ConfigError: A word is not known, or there is none.
    """
    if list(words) == ["none"]:
        return ()
    wrong = [word for word in words if word not in known]
    if wrong or not words:
        raise ConfigError(f"cannot understand {' '.join(words)!r}", valid=(*known, "none"))
    return words


def bits(known: Mapping[str, int]) -> Callable[[Sequence[str]], int]:
    """Make a reader of some words, each of which stands for a bit."""
    return lambda words: sum(known[word] for word in some_of(words, known))


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
        """Return what to wait for."""
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
