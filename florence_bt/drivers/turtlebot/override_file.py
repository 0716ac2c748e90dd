"""Keeps the manual override over restarts of the driver, power cuts included: while a file exists, it is on.

What is in the file is for people: damage to it cannot drop the override.
"""

from __future__ import annotations

import os
from pathlib import Path

from florence_bt.core.errors import ConfigError


class OverrideFile:
    """The file that stands for the manual override.

    Args:
        file: The file; its folder exists. None keeps nothing.
    """

    def __init__(self, file: Path | None) -> None:
        self._file = file

    def is_on(self) -> bool:
        """Whether the override is on; also when that cannot be found out."""
        if self._file is None:
            return False
        try:
            os.lstat(self._file)
        except FileNotFoundError:
            return False
        except OSError:
            return True
        return True

    def keep(self, on: bool) -> None:
        """Let the next start find the override on or off.

        Raises:
            ConfigError: The file could not be written or removed.
        """
        if self._file is None:
            return
        try:
            if on:
                self._file.write_text("The manual override is on. It ends with: florence release\n")
            else:
                self._file.unlink(missing_ok=True)
            for path in (self._file, self._file.parent) if on else (self._file.parent,):
                _flush(path)
        except OSError as error:
            after = "on" if self.is_on() else "off"
            raise ConfigError(
                f"after a restart the manual override will be {after}: {self._file}: {error.strerror}",
                valid=["a folder that can be written to"],
            ) from error


def _flush(path: Path) -> None:
    """Bring a file or folder to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
