"""Bytes in and out of a serial device: the one transport that the serial drivers share.

What the bytes mean is the codecs' business. Nothing here asks for the time; reading waits in ``select``.
"""

from __future__ import annotations

import errno
import os
import select
import termios
from typing import Protocol

import serial
from serial.tools import list_ports

from florence_bt.core.errors import DeviceLost, DeviceTimeout

WRITE_TIMEOUT_S = 0.5
"""Chosen: a command of a few bytes takes milliseconds."""


class BytePort(Protocol):
    """A two-way stream of bytes to one device."""

    @property
    def name(self) -> str:
        """Return what people call the port, e.g. ``/dev/ttyUSB0``."""

    def read(self, timeout_s: float) -> bytes:
        """Wait for bytes.

        Args:
            timeout_s: Longest wait in seconds; zero only takes what is there.

        Returns:
            What has arrived, empty when the time is over.

        Raises:
            DeviceLost: The device went away or the port was closed.
        """

    def write(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            DeviceLost: The device went away or the port was closed.
            DeviceTimeout: The device does not take the bytes.
        """

    def set_rts(self, level: bool) -> bool:
        """Set the modem line RTS.

        Returns:
            Whether the port has that line; pseudo-terminals and some adapters have none.
        """

    def close(self) -> None:
        """Give the port back; harmless when it is closed already."""


class SerialPort:
    """A serial device, opened for this process alone. Pseudo-terminals work too.

    8 data bits, no parity, 1 stop bit, no flow control (REFERENCE 1.1, 4.2).
    """

    def __init__(self, path: str, baud_rate: int) -> None:
        """Open the port.

        Args:
            path: Device file; links are followed.
            baud_rate: Bits per second; USB devices and pseudo-terminals ignore it.

        Raises:
            DeviceLost: The port cannot be opened; the message says what to do.
        """
        self.name = path
        try:
            # A read never waits inside pyserial: read() below waits in select with its own time-out.
            self._serial = serial.Serial(
                path, baud_rate, timeout=0, write_timeout=WRITE_TIMEOUT_S, exclusive=True
            )
        except (OSError, ValueError) as error:
            raise DeviceLost(_explain_open(path, error)) from error

    def read(self, timeout_s: float) -> bytes:
        """Wait for bytes; see :class:`BytePort`."""
        try:
            ready, _, _ = select.select([self._serial.fileno()], [], [], timeout_s)
            # Asking for at least one byte makes pyserial notice a device that hung up.
            return bytes(self._serial.read(max(1, self._serial.in_waiting))) if ready else b""
        except (OSError, TypeError, ValueError) as error:  # pyserial's answers to a port closed meanwhile
            raise DeviceLost(f"{self.name} went away while reading: {error}; check the plug") from error

    def write(self, data: bytes) -> None:
        """Send bytes; see :class:`BytePort`."""
        try:
            self._serial.write(data)
        except serial.SerialTimeoutException as error:
            raise DeviceTimeout(f"{self.name} took no bytes for {WRITE_TIMEOUT_S} s") from error
        except (OSError, TypeError, ValueError) as error:
            raise DeviceLost(f"{self.name} went away while writing: {error}; check the plug") from error

    def set_rts(self, level: bool) -> bool:
        """Set the modem line RTS; see :class:`BytePort`."""
        try:
            self._serial.rts = level
        except (OSError, TypeError, ValueError):
            # A port that is gone says so at the next read or write; all others have no such line.
            return False
        return True

    def set_baud_rate(self, baud_rate: int) -> None:
        """Speak at another speed from now on.

        Raises:
            DeviceLost: The device went away, or cannot be so fast.
        """
        try:
            if self._serial.baudrate != baud_rate:
                self._serial.baudrate = baud_rate
        except (OSError, TypeError, ValueError) as error:
            raise DeviceLost(f"{self.name} cannot be set to {baud_rate} baud: {error}") from error

    def close(self) -> None:
        """Give the port back; harmless when it is closed already."""
        self._serial.close()


class SecondHandle:
    """Writes to a port that another process has open, past that process; for when it does not answer.

    The speed of the line is the other one's. The lock of :class:`SerialPort` is pyserial's, ``flock``, which
    binds those who ask for it, as this class does not.
    """

    def __init__(self, path: str) -> None:
        """Open the port a second time; never waits.

        Args:
            path: Device file; links are followed.

        Raises:
            DeviceLost: The port cannot be opened; the message says what to do.
        """
        self.name = path
        try:
            self._descriptor = os.open(path, os.O_WRONLY | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise DeviceLost(_explain_open(path, error)) from error

    def write(self, data: bytes) -> None:
        """Send bytes now; what the other process has written and is not yet sent is dropped. Never waits.

        Raises:
            DeviceLost: The device went away.
            DeviceTimeout: The device does not take the bytes.
        """
        try:
            termios.tcflush(self._descriptor, termios.TCOFLUSH)
            sent = os.write(self._descriptor, data)
        except BlockingIOError:
            sent = 0
        except (OSError, termios.error) as error:
            raise DeviceLost(f"{self.name} went away while writing: {error}; check the plug") from error
        if sent < len(data):
            raise DeviceTimeout(f"{self.name} took {sent} of {len(data)} bytes")

    def close(self) -> None:
        """Give the handle back; the other process keeps its own."""
        os.close(self._descriptor)


def _explain_open(path: str, error: OSError | ValueError) -> str:
    """Say why a port did not open and what would have worked."""
    number = getattr(error, "errno", None)
    if number in (errno.EACCES, errno.EPERM):
        advice = "no permission: add your user to the group dialout (or uucp) and log in again"
    elif number in (errno.EAGAIN, errno.EBUSY):
        advice = "another program uses it: end that program first"
    elif number == errno.ENOENT:
        advice = "there is no such port: plug the device in or correct the parameter 'port'"
    elif number == errno.EISDIR or isinstance(error.__context__, termios.error):
        advice = "it is not a serial port: correct the parameter 'port'"
    else:
        advice = f"{error}: correct the parameter 'port'"
    found = ", ".join(sorted(port.device for port in list_ports.comports())) or "none"
    return f"cannot open {path}: {advice}; ports found: {found}"
