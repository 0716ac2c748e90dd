"""A process that takes edits of mission files over for another one, again and again, until its input ends."""

from __future__ import annotations

import pickle
import pickletools
import signal
import struct
import subprocess
import sys
from contextlib import suppress

from florence_bt.core.errors import FlorenceError

PROTOCOL = 3
"""Of the pickles: later ones are read in frames of 64 kB, which keeps the interpreter for 10 ms at a time."""
SIZE = struct.Struct(">Q")
"""Before each pickle: its length, bytes."""


class CheckFailed(FlorenceError):
    """The process has ended in place of an answer."""


class CheckProcess:
    """The process, as its owner sees it. It loads what it needs with the first check.

    Attributes:
        killed: Whether :meth:`kill` was called.

    Raises:
        OSError: The process cannot be started.
    """

    def __init__(self) -> None:
        self.killed = False
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def check(self, pickled: bytes) -> bytes:
        """Let it take edits over and wait for that, on any one thread.

        Args:
            pickled: The missions in force (``MissionFolders``).

        Returns:
            The pickles of the report and of the missions.

        Raises:
            CheckFailed: It ended, or was killed.
        """
        assert self._process.stdin is not None and self._process.stdout is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(SIZE.pack(len(pickled)) + pickled)
            self._process.stdin.flush()
        head = self._process.stdout.read(SIZE.size)
        answer = self._process.stdout.read(*SIZE.unpack(head)) if len(head) == SIZE.size else b""
        if not answer:
            self._reap()
            code = self._process.returncode
            raise CheckFailed(f"their check ended with code {code}; its error is in the log")
        return answer

    def kill(self) -> None:
        """End it during a check, without waiting for that; the check fails."""
        self.killed = True
        self._process.kill()

    def close(self) -> None:
        """End it and wait until it is gone."""
        self.kill()
        self._reap()

    def _reap(self) -> None:
        with suppress(BrokenPipeError), self._process:
            pass


def main() -> None:
    """Answer requests until the input ends: missions in; the report and the missions out."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C in the terminal is for the owner
    while head := sys.stdin.buffer.read(SIZE.size):
        missions = pickle.loads(sys.stdin.buffer.read(*SIZE.unpack(head)))
        report = missions.refresh()
        for mission in missions.library:
            missions.findings_of(mission)
        # Optimized, because the owner frees the memo of what it reads all at once: 9 ms for a file of 304 kB.
        answer = pickle.dumps(report, PROTOCOL) + pickletools.optimize(pickle.dumps(missions, PROTOCOL))
        sys.stdout.buffer.write(SIZE.pack(len(answer)) + answer)
        sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
