"""A pseudo-terminal that stands for a serial device: real drivers open its path like any port."""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import os
import pty
import struct
import termios
import tty
from pathlib import Path

from florence_bt.core.errors import DeviceLost

PTY_READ_SIZE = 4096
"""Bytes taken at once. Chosen."""
_SPEEDS = {
    getattr(termios, f"B{rate}"): rate
    for rate in (300, 600, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400)
}


class PseudoTerminal:
    """The device's end of a serial line; nothing here ever waits.

    The client's end is kept open here as well, so the line survives a client that closes and opens it again.
    When the last client has left, the line is as new: what it did not read is gone, as are its settings and a
    lock that it left behind. What is sent while no client is there is lost, as on a real line.

    Attributes:
        path: What the client opens: the link when one was asked for, otherwise the pty's own device file.
        lost_bytes: Bytes that found no room because no client read them, as on a real line.
    """

    def __init__(self, link: Path | None = None) -> None:
        """Open the line.

        Args:
            link: Where to put a symbolic link to the client's end; an old link there is replaced.

        Raises:
            DeviceLost: There is a file at the link's place, or no permission to make the link.
        """
        self._device, self._client = pty.openpty()
        tty.setraw(self._client)
        os.fchmod(self._client, 0o600)  # the group tty may write to it otherwise
        os.set_blocking(self._device, False)
        self._link = link
        self.path = os.ttyname(self._client)
        self._watch = ClientWatch(self.path)
        self.lost_bytes = 0
        if link is not None:
            try:
                _replace_link(link, self.path)
            except OSError as error:
                self._link = None
                self.close()
                raise DeviceLost(f"cannot link {link} to {self.path}: {error}") from error
            self._target, self.path = self.path, str(link)

    @property
    def has_client(self) -> bool:
        """Tell whether somebody has the line open; where the system does not say, somebody always has."""
        self._look_for_clients()
        return self._watch.clients > 0 or not self._watch.works

    @property
    def client_baud(self) -> int | None:
        """The speed that the client has set; None for one that is not among the usual ones.

        Raises:
            DeviceLost: The line is closed.
        """
        self.fileno()
        return _SPEEDS.get(termios.tcgetattr(self._client)[5])

    def fileno(self) -> int:
        """Return the device end's file descriptor, for ``select``.

        Raises:
            DeviceLost: The line is closed.
        """
        if self._device < 0:
            raise DeviceLost(f"{self.path} is closed")
        return self._device

    def read(self) -> bytes:
        """Read what the client has sent since the last call, often nothing.

        Raises:
            DeviceLost: The line is closed.
        """
        pieces = []
        with contextlib.suppress(BlockingIOError):
            while piece := os.read(self.fileno(), PTY_READ_SIZE):
                pieces.append(piece)
        self._look_for_clients()
        return b"".join(pieces)

    def write(self, data: bytes) -> None:
        """Send to the client; what finds no room, or nobody, is lost and counted.

        Raises:
            DeviceLost: The line is closed.
        """
        written, device = 0, self.fileno()
        if self.has_client:
            with contextlib.suppress(BlockingIOError):
                while written < len(data):
                    written += os.write(device, data[written:])
        self.lost_bytes += len(data) - written

    def unplug(self) -> None:
        """Pull the plug: the client's next read or write fails, and the path is gone."""
        self.close()

    def close(self) -> None:
        """End the line and remove the link; harmless when it is closed already."""
        if self._link is not None and self._link.is_symlink() and os.readlink(self._link) == self._target:
            self._link.unlink()
        self._link = None
        self._watch.close()
        for descriptor in (self._device, self._client):
            if descriptor >= 0:
                os.close(descriptor)
        self._device = self._client = -1

    def _look_for_clients(self) -> None:
        if self._client >= 0 and self._watch.update():
            termios.tcflush(self._client, termios.TCIFLUSH)
            fcntl.ioctl(self._client, termios.TIOCNXCL)
            if self._watch.clients == 0:
                tty.setraw(self._client)


def _replace_link(link: Path, target: str) -> None:
    if link.is_symlink():
        link.unlink()
    link.symlink_to(target)


IN_OPEN, IN_CLOSE = 0x20, 0x08 | 0x10
"""Events of inotify: opened; closed, after writing or not."""
_EVENT = struct.Struct("iIII")
_READ_SIZE = 64 * _EVENT.size


class ClientWatch:
    """Counts the clients of a device file from now on.

    Attributes:
        works: Whether the kernel reports; without that the count means nothing.
        clients: How many have it open.
    """

    def __init__(self, path: str) -> None:
        """Begin to watch.

        Args:
            path: The device file.
        """
        libc = ctypes.CDLL(None, use_errno=True)
        self._descriptor: int = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
        self.clients = 0
        self.works = (
            self._descriptor >= 0
            and libc.inotify_add_watch(self._descriptor, os.fsencode(path), IN_OPEN | IN_CLOSE) >= 0
        )

    def update(self) -> bool:
        """Read the news.

        Returns:
            Whether the last client left since the last call, even when another one came meanwhile.
        """
        all_left = False
        for mask in self._masks():
            if mask & IN_OPEN:
                self.clients += 1
            elif mask & IN_CLOSE:
                self.clients = max(0, self.clients - 1)
                all_left = all_left or self.clients == 0
        return all_left

    def close(self) -> None:
        """Watch no more; harmless when called twice."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1
        self.works = False

    def _masks(self) -> list[int]:
        masks = []
        with contextlib.suppress(BlockingIOError):
            while self.works:
                data = os.read(self._descriptor, _READ_SIZE)
                place = 0
                while place < len(data):
                    _, mask, _, name_length = _EVENT.unpack_from(data, place)
                    masks.append(mask)
                    place += _EVENT.size + name_length
        return masks
