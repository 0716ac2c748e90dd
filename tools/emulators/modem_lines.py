"""Runs another program's Python client as if pseudo-terminals had modem lines.

Clients wake a real base by pulses on RTS or DTR. A pseudo-terminal has no such lines and no program can give
it some, so that pyserial raises OSError there. With this, such a line takes every level and does nothing.

Only the standard library is used, so any Python can run this file for a client in an environment of its own:
``python modem_lines.py client.py ARGUMENTS``.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import runpy
import struct
import sys
import termios
from collections.abc import Iterator
from pathlib import Path
from typing import Any

READ_LINES = termios.TIOCMGET
WRITE_LINES = (termios.TIOCMSET, termios.TIOCMBIS, termios.TIOCMBIC)
NO_SUCH_LINE = (errno.ENOTTY, errno.EINVAL)
ALL_OFF = struct.pack("I", 0)


@contextlib.contextmanager
def pretended_modem_lines() -> Iterator[None]:
    """Let terminals without modem lines take every level within this block; reading says that all are off."""
    ioctl = fcntl.ioctl

    def pretend(fd: Any, request: int, *arguments: Any) -> Any:
        try:
            return ioctl(fd, request, *arguments)
        except OSError as error:
            descriptor = fd if isinstance(fd, int) else fd.fileno()
            if error.errno not in NO_SUCH_LINE or not os.isatty(descriptor):
                raise
            if request == READ_LINES:
                return ALL_OFF
            if request in WRITE_LINES:
                return arguments[0] if arguments else 0
            raise

    fcntl.ioctl = pretend
    try:
        yield
    finally:
        fcntl.ioctl = ioctl


def main(arguments: list[str] | None = None) -> int:
    """Run a client's file.

    Args:
        arguments: The file, then its own arguments; those of the process when not given.

    Returns:
        The exit code: 0, or 2 when no file was named; the client may end the process with another one.
    """
    words = sys.argv[1:] if arguments is None else arguments
    if not words or words[0] in ("-h", "--help"):
        print(
            "usage: python -m tools.emulators.modem_lines CLIENT.py [ARGUMENTS]",
            file=sys.stderr,
        )
        return 2
    sys.argv = words
    sys.path[0] = str(Path(words[0]).resolve().parent)
    with pretended_modem_lines():
        runpy.run_path(words[0], run_name="__main__")
    return 0


if __name__ == "__main__":
    sys.exit(main())
