"""Where Kinect frames come from: a source that is read with a time-out, and a thread that reads it.

Nothing here asks for the time; reading waits in ``select``.
"""

from __future__ import annotations

import select
import socket
import threading
from collections import deque
from collections.abc import Callable
from typing import Protocol

from florence_bt.core.errors import DeviceError, DeviceLost
from florence_bt.drivers.kinect.frames import Frame, FrameKind, FrameParser

RECEIVE_SIZE = 1 << 20


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
        """Tell whether colour pictures are wanted besides the depth pictures; at first they are.

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
            self._socket.connect(path)
        except (OSError, ValueError) as error:
            self._socket.close()
            raise DeviceLost(
                f"no Kinect frames at {path}: {error}; start the simulated hardware or correct 'source'"
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
        """Tell whether colour pictures are wanted; see :class:`FrameSource`."""
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
            raise DeviceLost(f"the other side closed {self._path}")
        return data or b""


class FrameReader:
    """Reads a source on a thread of its own and hands on what comes.

    Both callbacks run on that thread; a node passes them on through ``FlorenceNode.call_soon``.
    """

    WAIT_S = 0.1
    """How long one wait may take, so the longest that :meth:`stop` blocks."""

    def __init__(
        self,
        source: FrameSource,
        on_frame: Callable[[Frame], None],
        on_lost: Callable[[DeviceError], None],
    ) -> None:
        """Prepare the thread.

        Args:
            source: The open source; it stays the caller's to close, after :meth:`stop`.
            on_frame: Called with every frame.
            on_lost: Called once when the source fails; the thread has nothing more to read then.
        """
        self._source = source
        self._on_frame = on_frame
        self._on_lost = on_lost
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="reader of the Kinect", daemon=True)

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
                frame = self._source.read(self.WAIT_S)
            except DeviceError as error:
                if not self._stopping.is_set():
                    self._on_lost(error)
                return
            if frame is not None and not self._stopping.is_set():
                self._on_frame(frame)
