"""Keeps the manual override over restarts of the driver, power cuts included: while a file exists, it is on.

What is in the file is for people: damage to it cannot drop the override. A second file stays after the
release: its own date is that at which the override was switched on last.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

from florence_bt.core.errors import ConfigError


class OverrideFile:
    """The file that stands for the manual override.

    Args:
        file: The file; its folder exists. None keeps nothing.

    Attributes:
        switched_on: The date at which the override was switched on last, in seconds since 1970; 0 when that
            is not known.
    """

    def __init__(self, file: Path | None) -> None:
        self._file = file
        self.switched_on = 0.0
        if file is not None:
            self._last = file.with_name(f"{file.name}_switched_on")
            self.switched_on = max(_date_of(file), _date_of(self._last))

    def is_on(self) -> bool:
        """Tell whether the override is on; also when that cannot be found out."""
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
        """Let the next start find the override on or off, and when it was switched on.

        Raises:
            ConfigError: The file could not be written or removed.
        """
        if on:
            self.switched_on = time.time()
        if self._file is None:
            return
        try:
            if on:
                self._file.write_text("The manual override is on. It ends with: florence release\n")
                _flush(self._file)
                self._last.touch()
            else:
                self._file.unlink(missing_ok=True)
            _flush(self._file.parent)
        except OSError as error:
            after = "on" if self.is_on() else "off"
            raise ConfigError(
                f"after a restart the manual override will be {after}: {self._file}: {error.strerror}",
                valid=["a folder that can be written to"],
            ) from error


def _date_of(file: Path) -> float:
    """Return when a file was written, in seconds since 1970; 0 when there is none, or nobody can tell."""
    try:
        return os.lstat(file).st_mtime
    except OSError:
        return 0.0


def _flush(path: Path) -> None:
    """Bring a file or folder to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
