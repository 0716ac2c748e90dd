"""Sends the images of a simulated Kinect to whoever connects to a Unix socket.

The format is described in ``drivers/kinect/README.md``; the writer here is made from that description and
shares no code with the driver. Nothing blocks: a client that does not keep up misses frames.

Source: REFERENCE 5.2, 5.3.
"""

from __future__ import annotations

import contextlib
import os
import socket
import stat
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.socket_paths import short_path

DEPTH, VIDEO = 1, 2
"""Kinds of frames on the socket, a bit each."""
ALL_KINDS = DEPTH | VIDEO
SEND_BUFFER = 1 << 20

_HEAD = struct.Struct(">4sBxHHdI")


def pack_depth(raw: NDArray[np.uint16]) -> bytes:
    """Write 11-bit values one after the other, most significant bit first; eight take eleven bytes."""
    values = raw.reshape(-1)
    size = -(-11 * values.size // 8)
    v = np.pad(values, (0, -values.size % 8)).reshape(-1, 8).T
    out = np.empty((11, v.shape[1]), np.uint16)
    out[0] = v[0] >> 3
    out[1] = (v[0] << 5) | (v[1] >> 6)
    out[2] = (v[1] << 2) | (v[2] >> 9)
    out[3] = v[2] >> 1
    out[4] = (v[2] << 7) | (v[3] >> 4)
    out[5] = (v[3] << 4) | (v[4] >> 7)
    out[6] = (v[4] << 1) | (v[5] >> 10)
    out[7] = v[5] >> 2
    out[8] = (v[5] << 6) | (v[6] >> 5)
    out[9] = (v[6] << 3) | (v[7] >> 8)
    out[10] = v[7]
    return out.T.astype(np.uint8).tobytes()[:size]  # the cast keeps the low eight bits


def frame_bytes(kind: int, width: int, height: int, timestamp: float, payload: bytes) -> bytes:
    """Return a whole frame: header with checksum, payload."""
    head = _HEAD.pack(b"FKF1", kind, width, height, timestamp, len(payload))
    crc = zlib.crc32(payload, zlib.crc32(head + bytes(4)))
    return head + crc.to_bytes(4, "big") + payload


@dataclass(slots=True)
class KinectFaults:
    """The faults; set it at any time.

    Attributes:
        silent: No frame is sent, though the connection stays.
        garbage: These bytes go out once, before the next frame.
    """

    silent: bool = False
    garbage: bytes = b""


@dataclass(slots=True)
class _Client:
    connection: socket.socket
    wants: int = ALL_KINDS
    pending: bytearray = field(default_factory=bytearray)


class KinectFrameServer:
    """A Unix socket that sends frames to all who are connected.

    Call :meth:`poll` at least as often as there are frames, and soon while something is :attr:`pending`: it
    lets clients in, learns what they want and sends what did not fit before.

    Args:
        path: The socket file; a stale one is replaced.

    Attributes:
        faults: What shall go wrong.
        dropped: Frames that slow clients missed, summed over the clients.

    Raises:
        OSError: The socket cannot be made there, or something else stands at that path.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.faults = KinectFaults()
        self.dropped = 0
        self._clients: list[_Client] = []
        if self.path.exists() and stat.S_ISSOCK(os.stat(self.path).st_mode):
            self.path.unlink()
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            with short_path(self.path) as place:
                self._listener.bind(place)
            self._listener.listen()
        except OSError:
            self._listener.close()
            raise
        self._listener.setblocking(False)

    @property
    def client_count(self) -> int:
        """Count the clients; images for nobody need not be rendered."""
        return len(self._clients)

    @property
    def colour_wanted(self) -> bool:
        """Tell whether a client wants colour images; one that has not said what it wants gets everything."""
        return any(client.wants & VIDEO for client in self._clients)

    @property
    def pending(self) -> bool:
        """Tell whether something waits for room in a connection; then :meth:`poll` soon."""
        return any(client.pending for client in self._clients)

    def poll(self) -> None:
        """Let new clients in, send what is pending, forget clients that went."""
        with contextlib.suppress(BlockingIOError):
            while True:
                connection, _ = self._listener.accept()
                connection.setblocking(False)
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
                self._clients.append(_Client(connection))
        self._clients = [client for client in self._clients if self._flush(client)]

    def send_raw_depth(self, raw: NDArray[np.uint16], timestamp: float) -> None:
        """Send a depth image.

        Args:
            raw: Shape (height, width), 11-bit values, 2047 where nothing is measured.
            timestamp: Seconds.
        """
        height, width = raw.shape
        self._broadcast(DEPTH, lambda: frame_bytes(DEPTH, width, height, timestamp, pack_depth(raw)))

    def send_colour(self, pixels: NDArray[np.uint8], timestamp: float) -> None:
        """Send a colour image.

        Args:
            pixels: Shape (height, width, 3), red green blue.
            timestamp: Seconds.
        """
        height, width, _ = pixels.shape
        self._broadcast(VIDEO, lambda: frame_bytes(VIDEO, width, height, timestamp, pixels.tobytes()))

    def disconnect_all(self) -> None:
        """Throw every client out, as when the plug is pulled; they may come back."""
        for client in self._clients:
            client.connection.close()
        self._clients = []

    def close(self) -> None:
        """End the service and remove the socket file."""
        self.disconnect_all()
        self._listener.close()
        self.path.unlink(missing_ok=True)

    def _broadcast(self, kind: int, make: Callable[[], bytes]) -> None:
        self.poll()
        wanting = [client for client in self._clients if client.wants & kind]
        if not wanting or self.faults.silent:
            return
        garbage, self.faults.garbage = self.faults.garbage, b""
        frame = make()
        for client in wanting:
            if client.pending:
                self.dropped += 1
            else:
                client.pending += garbage + frame
        self.poll()

    def _flush(self, client: _Client) -> bool:
        """Send what is pending; False when the client is gone."""
        try:
            while client.pending:
                del client.pending[: client.connection.send(client.pending)]
            request = client.connection.recv(1024)
            alive = request != b""
            if alive:
                client.wants = request[-1] & ALL_KINDS
        except BlockingIOError:
            alive = True
        except OSError:
            alive = False
        if not alive:
            client.connection.close()
        return alive
