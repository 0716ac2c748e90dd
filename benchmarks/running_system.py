"""What benchmarks of the whole system share: a mission to its end, and what a process has cost."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from florence_interfaces.srv import MissionStatus

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.system import System
from florence_bt.app.runs.client import ACTIVE_STATES

TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")


class Systems:
    """Whole systems, one after the other; one that is asked for again in the same way is still there.

    Args:
        folder: Has the folders of the bring-ups.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._options: dict[str, Any] | None = None
        self._system: System | None = None
        self._open = ExitStack()
        self._number = 0

    @contextmanager
    def running(self, **options: Any) -> Iterator[System]:
        """Bring a system up with some options of :class:`BringUp`; it is ready.

        One in which something failed is not used again.
        """
        if self._system is None or options != self._options:
            self.close()
            self._number += 1
            made = System(BringUp(folder=str(self._folder / str(self._number)), **options), print)
            self._system, self._options = self._open.enter_context(made), options
            self._system.wait_ready()
        try:
            yield self._system
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the system, if there is one."""
        self._system = None
        self._open.close()


def run_mission(
    system: System, mission: str, inputs: dict[str, object], budget_s: float
) -> MissionStatus.Response:
    """Run a mission to its end; its status."""
    client = system.client
    answer = client.run(mission, inputs, caller="benchmark")
    assert answer.accepted, answer.message

    def over() -> bool:
        return client.state.run_id == answer.run_id and client.state.state not in ACTIVE_STATES

    client.spin_until(over, budget_s, watch=system.check)
    return client.status(answer.run_id)


def cpu_seconds(pid: int) -> float:
    """User and system time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_SECOND
