"""Who has a pseudo-terminal open: the kernel tells of each opening and closing (inotify)."""

from __future__ import annotations

import contextlib
import ctypes
import os
import struct

IN_OPEN, IN_CLOSE = 0x20, 0x08 | 0x10
_EVENT = struct.Struct("iIII")
_READ_SIZE = 64 * _EVENT.size


class ClientWatch:
    """Counts the clients of a device file from now on.

    Attributes:
        works: Whether the kernel tells; without that the count means nothing.
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
