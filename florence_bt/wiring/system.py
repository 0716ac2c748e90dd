"""Brings the whole system up and down: the processes, and a client that knows when all of it is ready."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from types import TracebackType

from florence_bt.core.errors import ConfigError, DeviceTimeout
from florence_bt.wiring.client import MissionClient
from florence_bt.wiring.locks import lock_domain, lock_folder
from florence_bt.wiring.options import BringUp
from florence_bt.wiring.preflight import check_options
from florence_bt.wiring.signals import deaf
from florence_bt.wiring.simulated import clear_ports
from florence_bt.wiring.supervisor import Supervisor
from florence_bt.wiring.topology import groups

READY_BUDGET_S = 90.0
"""Wall seconds that all nodes get to start; the first start compiles the hot loops."""


class System:
    """A running system. Use as a context manager: leaving it stops the robot and ends every process.

    Args:
        options: What to bring up.

    Raises:
        ConfigError: A file of the bring-up is wrong, or another one uses the folder or the domain; nothing
            was started.
    """

    def __init__(self, options: BringUp) -> None:
        check_options(options)
        self.options = options
        folder = Path(options.folder)
        with ExitStack() as stack:
            locks = [
                stack.enter_context(closing(lock())) for lock in (partial(lock_folder, folder), lock_domain)
            ]
            if options.simulated:
                clear_ports(options)
            self._supervisor = Supervisor(
                options.write(), folder / "logs", keep_open=[lock.fileno() for lock in locks]
            )
            self.client = MissionClient()
            self._locks = stack.pop_all()

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
        """Wait until a mission can run. A real robot may still have to be told where it is.

        Args:
            report: Told what is going on, in short lines.

        Returns:
            Wall seconds it took.

        Raises:
            ProcessDied: A process ended.
            ConfigError: Another system runs in the same ROS domain.
            DeviceTimeout: It takes too long; names what is missing.
        """
        start = time.monotonic()
        report(f"starting {len(self.pids())} processes ({', '.join(self.pids())})")
        if not self.client.spin_until(self._is_ready, READY_BUDGET_S, watch=self._check_start):
            missing = ", ".join(self.client.missing() or self._not_up()) or "the robot's pose"
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

    def _is_ready(self) -> bool:
        if self._not_up() or self.client.missing():
            return False
        return not self.options.simulated or self.client.knows_pose()

    def _not_up(self) -> list[str]:
        """The groups whose process has not all its nodes yet; an earlier bring-up left other ids."""
        return [group for group, pid in self.pids().items() if self._id_in(group) != str(pid)]

    def _id_in(self, group: str) -> str:
        try:
            return self.options.up_file(group).read_text(encoding="utf-8").strip()
        except OSError:
            return ""

    def _check_start(self) -> None:
        """What may go wrong before all is ready; another user's or machine's system is seen here only."""
        self.check()
        if self.client.servers() > 1:
            raise ConfigError(
                "another system runs in the same ROS domain",
                valid=["another domain, e.g. ROS_DOMAIN_ID=7", "ending that one first"],
            )

    def _down(self) -> None:
        """End everything, whatever the impatient press meanwhile: half of it would leave the base driving."""
        with deaf():
            # The mission process goes first: it cancels its goals while navigation can still stop the base.
            self._supervisor.stop()
            self.client.close()
            self._locks.close()
