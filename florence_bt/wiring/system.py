"""Brings the whole system up and down: the processes, and a client that knows when all of it is ready."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

from florence_bt.core.errors import DeviceTimeout
from florence_bt.wiring.client import MissionClient
from florence_bt.wiring.options import BringUp
from florence_bt.wiring.preflight import check_options
from florence_bt.wiring.supervisor import Supervisor
from florence_bt.wiring.topology import groups

READY_BUDGET_S = 90.0
"""Wall seconds that all nodes get to start; the first start compiles the hot loops."""


class System:
    """A running system. Use as a context manager: leaving it stops the robot and ends every process.

    Args:
        options: What to bring up.

    Raises:
        ConfigError: A file of the bring-up is wrong; nothing was started.
    """

    def __init__(self, options: BringUp) -> None:
        check_options(options)
        self.options = options
        self._supervisor = Supervisor(options.write(), Path(options.folder) / "logs")
        self.client = MissionClient()

    def __enter__(self) -> System:
        """Start the processes; they are not ready yet."""
        try:
            self._supervisor.start(groups(self.options))
        except BaseException:
            self._down()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop everything."""
        self._down()

    def wait_ready(self, report: Callable[[str], None]) -> float:
        """Wait until a mission can run.

        Args:
            report: Told what is going on, in short lines.

        Returns:
            Wall seconds it took.

        Raises:
            ProcessDied: A process ended.
            DeviceTimeout: It takes too long; names what is missing.
        """
        start = time.monotonic()
        report(f"starting {len(self.pids())} processes ({', '.join(self.pids())})")
        if not self.client.spin_until(self.client.is_ready, READY_BUDGET_S, watch=self.check):
            missing = ", ".join(self.client.missing()) or "the robot's pose"
            raise DeviceTimeout(
                f"not ready after {READY_BUDGET_S:.0f} s, missing: {missing}; "
                f"see the logs in {self.options.folder}/logs"
            )
        return time.monotonic() - start

    def pids(self) -> dict[str, int]:
        """Process ids by group of nodes."""
        return self._supervisor.pids()

    def check(self) -> None:
        """Raise when a process has died."""
        self._supervisor.check()

    def _down(self) -> None:
        """End everything, whatever the impatient press meanwhile: half of it would leave the base driving."""
        with _deaf_to_signals():
            # The mission process goes first: it cancels its goals while navigation can still stop the base.
            self._supervisor.stop()
            self.client.close()


@contextmanager
def _deaf_to_signals() -> Iterator[None]:
    """Ignore Ctrl-C and SIGTERM for a while; signals belong to the main thread, others are deaf anyway."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
