"""What benchmarks of the whole system share: a mission to its end, and what a process has cost."""

from __future__ import annotations

import os
from pathlib import Path

from florence_interfaces.srv import MissionStatus

from florence_bt.app.bringup.system import System
from florence_bt.app.runs.client import ACTIVE_STATES

TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")


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
