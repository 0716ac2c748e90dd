"""One bring-up at a time in a folder: a second one would take the ports and logs of the first."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from florence_bt.core.errors import ConfigError

LOCK = "lock"


class FolderLock:
    """The right to use a folder; gone with the last process that holds it, however that ends.

    Args:
        folder: The folder; made when needed.

    Raises:
        ConfigError: Somebody uses it, or it cannot be written to.
    """

    def __init__(self, folder: Path) -> None:
        file = folder / LOCK
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise ConfigError(
                f"the folder {str(folder)!r} cannot be used: {error.strerror}",
                valid=["a folder that can be written to, with --out"],
            ) from error
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            owner = os.read(self._descriptor, 20).decode(errors="replace").strip()
            os.close(self._descriptor)
            raise ConfigError(
                f"a bring-up already runs in {str(folder)!r} (process {owner or 'unknown'}, or what is left of it)",
                valid=["another folder, with --out", "ending that one first"],
            ) from None
        os.truncate(self._descriptor, 0)
        os.write(self._descriptor, f"{os.getpid()}\n".encode())

    def fileno(self) -> int:
        """The descriptor; a process that inherits it holds the lock too."""
        return self._descriptor

    def close(self) -> None:
        """Let go; harmless when that was done already."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1
