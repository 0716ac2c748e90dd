"""Paths of Unix sockets: the kernel takes 107 bytes of a path, and folders are deeper than that."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LONGEST = 107
"""Bytes of ``sun_path`` without its end (unix(7))."""


@contextmanager
def short_path(path: str | Path) -> Iterator[str]:
    """Give a path that a Unix socket can be bound to or connect to, good while the block runs.

    Args:
        path: Where the socket is, or shall be.

    Yields:
        The path itself, or a shorter one to the same place by way of its folder.

    Raises:
        OSError: There is no such folder.
    """
    if len(os.fsencode(path)) <= LONGEST:
        yield str(path)
        return
    folder, name = os.path.split(path)
    descriptor = os.open(folder or ".", os.O_PATH | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{descriptor}/{name}"
    finally:
        os.close(descriptor)
