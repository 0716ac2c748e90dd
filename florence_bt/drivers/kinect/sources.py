"""Sources of Kinect frames: what they have in common, the one over a socket, and which one to open."""

from __future__ import annotations

import select
import socket
from collections import deque
from pathlib import Path
from typing import Protocol

from florence_bt.core.errors import DeviceLost
from florence_bt.core.socket_paths import short_path
from florence_bt.drivers.kinect.driver import KinectParameters
from florence_bt.drivers.kinect.fakenect import INDEX
from florence_bt.drivers.kinect.frames import Frame, FrameKind, FrameParser
from florence_bt.drivers.kinect.freenect_source import FreenectSource
from florence_bt.drivers.kinect.recording import RecordingSource, file_of

USB, RECORDING = "usb", "recording"


def open_source(parameters: KinectParameters) -> FrameSource:
    """Open what ``source`` names.

    Raises:
        DeviceLost: It cannot be opened; the message says what to do.
    """
    kind, _, rest = parameters.source.partition(":")
    if kind == USB:
        return FreenectSource(
            rest or "0", registered=parameters.depth_registration, library=parameters.library
        )
    if kind == RECORDING:
        if (Path(rest) / INDEX).exists() and not file_of(Path(rest)).exists():
            return FreenectSource(library=parameters.library, folder=rest)
        return RecordingSource(Path(rest))
    return SocketFrameSource(parameters.source)


RECEIVE_SIZE = 1 << 20
"""Bytes taken from the socket at once. Chosen: a colour picture has 0.9 MB."""


class FrameSource(Protocol):
    """A Kinect, or something that sends the frames of one."""

    def read(self, timeout_s: float) -> Frame | None:
        """Wait for the next frame.

        Args:
            timeout_s: Longest wait for bytes, in seconds.

        Returns:
            The frame, or None when none is complete yet.

        Raises:
            DeviceLost: The device went away.
        """

    def request(self, *, colour: bool) -> None:
        """Tell whether colour images are wanted besides the depth images; at first they are.

        Raises:
            DeviceLost: The device went away.
        """

    def close(self) -> None:
        """Let go of the device; harmless when called twice."""


class SocketFrameSource:
    """Frames from a Unix stream socket, in the format of ``frames.py``.

    Args:
        path: The socket file.

    Raises:
        DeviceLost: Nobody serves that socket.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        self._parser = FrameParser()
        self._frames: deque[Frame] = deque()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            with short_path(path) as place:
                self._socket.connect(place)
        except (OSError, ValueError) as error:
            self._socket.close()
            raise DeviceLost(
                f"no Kinect frames at {path}: {error}; start the simulated hardware or correct 'source' "
                "(usb: a real Kinect)"
            ) from error
        self._socket.setblocking(False)

    @property
    def skipped(self) -> int:
        """Bytes that belonged to no frame."""
        return self._parser.skipped

    def read(self, timeout_s: float) -> Frame | None:
        """Wait for the next frame; see :class:`FrameSource`."""
        if not self._frames:
            self._frames.extend(self._parser.feed(self._receive(timeout_s)))
        return self._frames.popleft() if self._frames else None

    def request(self, *, colour: bool) -> None:
        """Tell whether colour images are wanted; see :class:`FrameSource`."""
        try:
            wanted = FrameKind.DEPTH | FrameKind.VIDEO if colour else FrameKind.DEPTH
            self._socket.send(bytes([wanted]))
        except OSError as error:
            raise DeviceLost(f"the Kinect frames at {self._path} broke off: {error}") from error

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _receive(self, timeout_s: float) -> bytes:
        try:
            ready, _, _ = select.select([self._socket], [], [], timeout_s)
            data = self._socket.recv(RECEIVE_SIZE) if ready else None
        except (OSError, ValueError) as error:  # ValueError: closed meanwhile by another thread
            raise DeviceLost(f"the Kinect frames at {self._path} broke off: {error}") from error
        if data == b"":
            raise DeviceLost(f"the peer closed {self._path}")
        return data or b""
