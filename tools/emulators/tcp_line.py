"""The device's end of a TCP connection, in the form of a pseudo-terminal: one client at a time."""

from __future__ import annotations

import contextlib
import socket

from florence_bt.core.errors import DeviceLost

READ_SIZE = 4096
HOST = "127.0.0.1"


class TcpLine:
    """Listens on this machine; nothing here ever waits. A second client waits until the first has left.

    Attributes:
        path: What a client connects to, ``host:port``.
        lost_bytes: Bytes that found nobody, or no room.
    """

    def __init__(self, port: int = 0) -> None:
        """Listen.

        Args:
            port: TCP port; 0 for any that is free.

        Raises:
            DeviceLost: It cannot listen there.
        """
        try:
            self._server: socket.socket | None = socket.create_server((HOST, port), backlog=1)
        except (OSError, OverflowError) as error:  # OverflowError: there is no such number
            raise DeviceLost(f"cannot listen at {HOST}:{port}: {error}") from error
        self._server.setblocking(False)
        self._client: socket.socket | None = None
        self.port: int = self._server.getsockname()[1]
        self.path = f"{HOST}:{self.port}"
        self.lost_bytes = 0

    @property
    def has_client(self) -> bool:
        """Tell whether somebody is connected."""
        return self._client is not None

    def fileno(self) -> int:
        """Return the file descriptor to wait for.

        Raises:
            DeviceLost: The line is closed.
        """
        if self._server is None:
            raise DeviceLost(f"{self.path} is closed")
        return self._server.fileno() if self._client is None else self._client.fileno()

    def read(self) -> bytes:
        """Read what the client has sent since the last call, often nothing."""
        if self._client is None:
            self._accept()
        pieces = []
        with contextlib.suppress(BlockingIOError):
            while self._client is not None:
                piece = self._receive(self._client)
                if not piece:
                    self._hang_up()
                    break
                pieces.append(piece)
        return b"".join(pieces)

    def write(self, data: bytes) -> None:
        """Send to the client; what finds no room, or nobody, is lost and counted."""
        sent = 0
        while self._client is not None and sent < len(data):
            try:
                sent += self._client.send(data[sent:])
            except BlockingIOError:
                break
            except OSError:
                self._hang_up()
        self.lost_bytes += len(data) - sent

    def unplug(self) -> None:
        """Cut the connection and stop listening."""
        self.close()

    def close(self) -> None:
        """End the line; harmless when it is closed already."""
        self._hang_up()
        if self._server is not None:
            self._server.close()
            self._server = None

    def _accept(self) -> None:
        if self._server is None:
            raise DeviceLost(f"{self.path} is closed")
        with contextlib.suppress(BlockingIOError):
            client, _ = self._server.accept()
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client

    def _hang_up(self) -> None:
        if self._client is not None:
            self._client.close()
            self._client = None

    @staticmethod
    def _receive(client: socket.socket) -> bytes:
        try:
            return client.recv(READ_SIZE)
        except ConnectionError:
            return b""  # a client that broke off is gone like one that hung up
