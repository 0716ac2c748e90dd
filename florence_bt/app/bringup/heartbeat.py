"""Heartbeats: each process of a bring-up writes a byte into a pipe, from the loop that serves its callbacks.

The supervisor holds the other end. A pipe needs no ROS and no port, and what is in it waits for a supervisor
that was held up itself. Both ends are non-blocking; beats that find the pipe full are not needed.
"""

from __future__ import annotations

import os
import signal
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from florence_bt.ros.process import Beat

FD_VARIABLE = "FLORENCE_HEARTBEAT_FD"
"""Environment variable: the file descriptor into which a process of a bring-up writes its heartbeats."""
SILENT_S = 1.0
"""A process that has not beaten for this long does not answer. Nav2's bond waits for 4 s."""
KILLED_AFTER_S = 5.0
"""A process that has not beaten for this long will not come back. After the first :data:`SILENT_S` the time
that it waits for a processor does not count: on a machine that is too busy a process is late, not hung."""
LONG_WORK_S = 60.0
"""So much later is a process killed that has said, as its last beat, that long work begins. It is held as any
other that is silent."""
_BEAT, _LONG_WORK = b"\0", b"\1"
STACK_SIGNAL = signal.SIGUSR1
"""Makes a process of a bring-up write the stack of its main thread into its log."""
LONGEST_LOOK_S = 0.1
"""Two looks that are further apart count as this much silence: the supervisor was held up itself, and perhaps
all processes, by a machine that is too busy or was suspended. The supervisor looks every 0.05 s."""


def heartbeat_of_this_process() -> Beat:
    """Return what a process of a bring-up calls again and again.

    Raises:
        KeyError: It was not started by a supervisor.
    """
    descriptor = int(os.environ.pop(FD_VARIABLE))

    def beat(*, long_work: bool = False) -> None:
        # Full: the supervisor is held up, and what is in the pipe says enough. Broken: the supervisor was
        # killed, and the kernel's signal about that ends us in order.
        with suppress(BlockingIOError, BrokenPipeError):
            os.write(descriptor, _LONG_WORK if long_work else _BEAT)

    return beat


class HeartbeatMonitor:
    """Reads the heartbeats of one process.

    Attributes:
        writer: The file descriptor for the process; :meth:`started` closes it here.
        has_beaten: Whether the process has answered at all.
        silent_s: Seconds without a beat so far, as :data:`KILLED_AFTER_S` counts them; 0 before the first,
            because a process that starts has a budget of its own.
    """

    def __init__(self, now: float) -> None:
        self._reader, self.writer = os.pipe()
        for descriptor in (self._reader, self.writer):
            os.set_blocking(descriptor, False)
        self._looked = now
        self.has_beaten = False
        self._pid = 0
        self._run_delay_s = 0.0
        self._long_work_s = 0.0
        self.silent_s = 0.0

    @property
    def is_silent(self) -> bool:
        """Tell whether the process does not answer."""
        return self.silent_s >= SILENT_S

    def started(self, pid: int) -> None:
        """Note that the process has its end of the pipe now."""
        os.close(self.writer)
        self._pid = pid

    def look(self, now: float) -> None:
        """Take the beats that came; call it several times a second.

        Args:
            now: Steady seconds.
        """
        passed, self._looked = min(now - self._looked, LONGEST_LOOK_S), now
        try:
            came = os.read(self._reader, 4096)
        except BlockingIOError:
            came = b""
        if came:
            self.has_beaten, self.silent_s = True, 0.0
            self._long_work_s = LONG_WORK_S if came.endswith(_LONG_WORK) else 0.0
        elif self.has_beaten:
            if self.is_silent:
                before, self._run_delay_s = self._run_delay_s, run_delay(self._pid)
                passed -= min(passed, self._run_delay_s - before)
                at_work = min(passed, self._long_work_s)
                self._long_work_s -= at_work
                passed -= at_work
            self.silent_s += passed

    def close(self) -> None:
        """Close the pipe."""
        os.close(self._reader)


def run_delay(pid: int) -> float:
    """Return how long the main thread of a process could have run but had no processor, in all, seconds.

    The second field of ``/proc/PID/schedstat`` (Linux, Documentation/scheduler/sched-stats). 0 when the
    kernel does not count, or the process is gone.
    """
    try:
        return int(Path(f"/proc/{pid}/schedstat").read_text(encoding="ascii").split()[1]) / 1e9
    except OSError:
        return 0.0
