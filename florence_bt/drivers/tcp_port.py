"""Bytes in and out of a device on the network, in the form of a serial port.

The connection is made while somebody reads, so opening never waits: a device that is switched off costs its
node nothing.
"""

from __future__ import annotations

import os
import select
import socket
import threading

from florence_bt.core.errors import DeviceLost, DeviceTimeout

READ_SIZE = 65536
"""Bytes taken at once, at most. Chosen: a scan has some 3 kB."""
CONNECT_TIMEOUT_S, UNHEARD_TIMEOUT_S = 3.0, 3.0
"""A peer that answers no connection, or acknowledges nothing, for this long is gone: its cable was pulled.
Chosen."""

MOST_BYTES_WAITING = 65536
"""Bytes that may wait for a device that does not take them. Chosen."""


class TcpPort:
    """A TCP connection as a :class:`~florence_bt.drivers.serial_port.BytePort`.

    One thread reads; any thread writes. What is written before the connection stands goes out when it does.
    """

    def __init__(self, host: str, port: int) -> None:
        """Prepare; the first reads connect.

        Args:
            host: Name or address.
            port: Number of the port.
        """
        self.name = f"{host}:{port}"
        self._address = (host, port)
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        self._connected = False
        self._closed = False
        self._waited_s = 0.0
        self._outbox = bytearray()

    def read(self, timeout_s: float) -> bytes:
        """Wait for bytes; see ``BytePort``."""
        try:
            if not self._connected:
                self._connect(timeout_s)
                return b""
            peer = self._peer()
            ready, _, _ = select.select([peer], [], [], timeout_s)
            if not ready:
                self._flush()
                return b""
            data = peer.recv(READ_SIZE)
        except BlockingIOError:
            return b""
        except (OSError, ValueError) as error:  # ValueError: closed while it was waited for
            raise DeviceLost(f"{self.name} went away: {error}; check the cable and the power") from error
        if not data:
            raise DeviceLost(f"{self.name} hung up")
        return data

    def write(self, data: bytes) -> None:
        """Send bytes; see ``BytePort``."""
        with self._lock:
            if self._closed:
                raise DeviceLost(f"{self.name} is closed")
            self._outbox += data
            if len(self._outbox) > MOST_BYTES_WAITING:
                raise DeviceTimeout(f"{self.name} takes no bytes")
        try:
            self._flush()
        except OSError as error:
            raise DeviceLost(f"{self.name} went away: {error}; check the cable and the power") from error

    def set_rts(self, level: bool) -> bool:
        """Return False: a network has no modem lines."""
        return False

    def close(self) -> None:
        """Hang up; harmless when it is closed already."""
        with self._lock:
            self._closed = True
            if self._socket is not None:
                self._socket.close()

    def _peer(self) -> socket.socket:
        if self._socket is None or self._closed:
            raise DeviceLost(f"{self.name} is closed")
        return self._socket

    def _connect(self, timeout_s: float) -> None:
        if self._socket is None:
            self._begin()
        peer = self._peer()
        _, ready, _ = select.select([], [peer], [], timeout_s)
        if ready:
            number = peer.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if number:
                raise self._unreachable(os.strerror(number))
            self._connected = True
            self._flush()
            return
        self._waited_s += timeout_s
        if self._waited_s >= CONNECT_TIMEOUT_S:
            raise self._unreachable(f"no answer for {CONNECT_TIMEOUT_S:g} s")

    def _begin(self) -> None:
        """Look up the address and send the first packet."""
        try:
            found = socket.getaddrinfo(*self._address, type=socket.SOCK_STREAM)
            # Scanners speak IPv4, though a name such as localhost may stand for an IPv6 address first.
            family, kind, protocol, _, address = min(found, key=lambda entry: entry[0] != socket.AF_INET)
            peer = socket.socket(family, kind, protocol)
        except OSError as error:
            raise self._unreachable(str(error)) from error
        peer.setblocking(False)
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(1000 * UNHEARD_TIMEOUT_S))
        with self._lock:
            if self._closed:
                peer.close()
                raise DeviceLost(f"{self.name} is closed")
            self._socket = peer
        try:
            peer.connect(address)
        except BlockingIOError:
            return  # on its way; _connect waits for it
        except OSError as error:
            raise self._unreachable(str(error)) from error

    def _flush(self) -> None:
        with self._lock:
            if not self._connected or self._closed or self._socket is None:
                return
            while self._outbox:
                try:
                    sent = self._socket.send(self._outbox)
                except BlockingIOError:
                    return  # the reader comes back to it
                del self._outbox[:sent]

    def _unreachable(self, why: str) -> DeviceLost:
        return DeviceLost(
            f"cannot reach {self.name}: {why}; check the sensor's power, the cable and the address"
        )
