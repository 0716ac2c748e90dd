"""Bytes in and out of a serial device: the one transport that the serial drivers share.

What the bytes mean is the codecs' business. Nothing here asks for the time; reading waits in ``select``.
"""

from __future__ import annotations

import errno
import select
import threading
from collections.abc import Callable
from typing import Protocol

import serial
from serial.tools import list_ports

from florence_bt.core.errors import DeviceError, DeviceLost, DeviceTimeout

WRITE_TIMEOUT_S = 0.5


class BytePort(Protocol):
    """A two-way stream of bytes to one device."""

    @property
    def name(self) -> str:
        """What people call the port, e.g. ``/dev/ttyUSB0``."""

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

    def close(self) -> None:
        """Give the port back; harmless when it is closed already."""
        self._serial.close()


def _explain_open(path: str, error: OSError | ValueError) -> str:
    """Say why a port did not open and what would have worked."""
    number = getattr(error, "errno", None)
    if number in (errno.EACCES, errno.EPERM):
        advice = "no permission: add your user to the group dialout (or uucp) and log in again"
    elif number in (errno.EAGAIN, errno.EBUSY):
        advice = "another program uses it: end that program first"
    elif number == errno.ENOENT:
        advice = "there is no such port: plug the device in or correct the parameter 'port'"
    else:
        advice = f"{error}: correct the parameter 'port'"
    found = ", ".join(sorted(port.device for port in list_ports.comports())) or "none"
    return f"cannot open {path}: {advice}; ports found: {found}"


class PortReader:
    """Reads a port on a thread of its own and hands on what comes.

    Both callbacks run on that thread; a node passes them on through ``FlorenceNode.call_soon``.
    """

    WAIT_S = 0.1
    """How long one wait for bytes may take, so the longest that :meth:`stop` blocks."""

    def __init__(
        self,
        port: BytePort,
        on_data: Callable[[bytes], None],
        on_lost: Callable[[DeviceError], None],
    ) -> None:
        """Prepare the thread.

        Args:
            port: The open port; it stays the caller's to close, after :meth:`stop`.
            on_data: Called with every piece of bytes, never empty.
            on_lost: Called once when the port fails; the thread has nothing more to read then.
        """
        self._port = port
        self._on_data = on_data
        self._on_lost = on_lost
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reader of {port.name}", daemon=True)

    def start(self) -> None:
        """Begin to read."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread; after this no callback comes any more. Harmless when called twice."""
        self._stopping.set()
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                data = self._port.read(self.WAIT_S)
            except DeviceError as error:
                if not self._stopping.is_set():
                    self._on_lost(error)
                return
            if data and not self._stopping.is_set():
                self._on_data(data)
