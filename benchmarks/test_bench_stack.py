"""The whole system on ROS over simulated hardware: how fast it goes, and what it costs when idle."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.system import System
from florence_bt.app.runs.client import ACTIVE_STATES
from florence_bt.ros.environment import reach_of

TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
IDLE_S = 10.0
SPEEDS = (3.0, 5.0)
"""Simulated seconds per wall second asked for; the first is the aim. Beyond what the machine can do, the
latencies between the processes count more and more in simulated time, and missions begin to fail."""


@pytest.fixture
def domain(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "97")
    for name, value in reach_of({}).variables.items():
        monkeypatch.delenv(name, raising=False) if value is None else monkeypatch.setenv(name, value)


def cpu_seconds(pid: int) -> float:
    """User and system time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_SECOND


def test_idle_cpu(benchmark, figures, domain, tmp_path):
    with System(BringUp(folder=str(tmp_path), person="kitchen"), print) as system:
        system.wait_ready()
        pids = system.pids()
        before = {group: cpu_seconds(pid) for group, pid in pids.items()}

        def idle():
            begin = time.perf_counter()
            system.client.spin_until(lambda: False, IDLE_S, watch=system.check)
            return time.perf_counter() - begin

        wall = benchmark.pedantic(idle, rounds=1)
        used = {group: 100 * (cpu_seconds(pid) - before[group]) / wall for group, pid in pids.items()}
    figures.add(
        "idle executor (process missions)", f"{used['missions']:.1f} % of a core", "10 s after the start-up"
    )
    rest = ", ".join(f"{group} {share:.1f}" for group, share in used.items())
    figures.add("idle stack, all processes", f"{sum(used.values()):.0f} % of a core", rest)


@pytest.mark.parametrize("speed", SPEEDS)
def test_stack_speed(benchmark, figures, domain, tmp_path, speed):
    with System(BringUp(folder=str(tmp_path), person="study", speed=speed), print) as system:
        system.wait_ready()
        client = system.client
        client.follow_truth()
        client.spin_until(lambda: bool(client.truth), 5.0)

        def mission():
            begin, wall = client.truth["time"], time.perf_counter()
            answer = client.run("goto_user", {}, caller="benchmark")
            assert answer.accepted, answer.message

            def over():
                state = client.state
                return state.run_id == answer.run_id and state.state not in ACTIVE_STATES

            client.spin_until(over, 120.0, watch=system.check)
            return client.truth["time"] - begin, time.perf_counter() - wall, client.status(answer.run_id)

        simulated, wall, status = benchmark.pedantic(mission, rounds=1)
    figures.add(
        "ROS stack: simulated seconds per wall second",
        f"{simulated / wall:.1f}",
        f"asked for {speed:g}: goto_user {status.state} in {simulated:.0f} s {status.reason}",
    )
