"""One bring-up at a time: in a folder and in a ROS domain.

In one folder a second one would take the ports and logs of the first; in one domain the two would drive each
other's robot.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
from pathlib import Path

from florence_bt.core.errors import ConfigError


class Lock:
    """The right to use something; gone with the last process that holds it, however that ends.

    Args:
        file: Stands for the thing; its folder is made when needed.
        place: The thing in words, e.g. ``the folder 'runs'``.
        instead: What the user can do when it is taken or cannot be used.

    Raises:
        ConfigError: Somebody uses it, or the file cannot be written.
    """

    def __init__(self, file: Path, place: str, instead: str) -> None:
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            self._descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise ConfigError(f"{place} cannot be used: {error.strerror}", valid=[instead]) from error
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            owner = os.read(self._descriptor, 20).decode(errors="replace").strip() or "unknown"
            os.close(self._descriptor)
            raise ConfigError(
                f"a bring-up (process {owner}), or what is left of it, uses {place}",
                valid=[instead, "ending that one first"],
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


def lock_folder(folder: Path) -> Lock:
    """Take a folder; it is made when needed.

    Raises:
        ConfigError: As :class:`Lock`.
    """
    return Lock(
        folder / "lock", f"the folder {str(folder)!r}", "another folder that can be written to, with --out"
    )


def lock_domain() -> Lock:
    """Take the ROS domain of this process on this machine, for this user.

    Discovery is no way to find another system before it is disturbed: it takes seconds on a busy machine.

    Raises:
        ConfigError: As :class:`Lock`.
    """
    domain = os.environ.get("ROS_DOMAIN_ID") or "0"
    folder = Path(tempfile.gettempdir()) / f"florence-{os.getuid()}"
    return Lock(
        folder / f"domain-{domain}", f"the ROS domain {domain}", "another domain, e.g. ROS_DOMAIN_ID=7"
    )
