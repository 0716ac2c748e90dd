"""What a recording costs while goto_user runs."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("foxglove")

from benchmarks.measure import size
from benchmarks.running_system import Systems, cpu_seconds, run_mission

MISSION, INPUTS = size(("goto_user", {}), ("goto_room", {"room": "hall"}))
WITH, WITHOUT = size(({"record": True}, {"record": False}), ({"record": True},) * 2)
"""What is brought up; a small run brings up one system for both."""


def test_recording_cpu(benchmark, figures, systems: Systems):
    """In shares of simulated time, by which messages come: a busy machine makes less of it a second."""

    def mission(**options: object) -> tuple[dict[str, float], Path]:
        with systems.running(person="living_room", seed=27, **options) as system:
            system.client.follow_truth()
            assert system.client.spin_until(lambda: bool(system.client.truth), 60.0)
            pids, begin = system.pids(), system.client.truth["time"]
            before = {group: cpu_seconds(pid) for group, pid in pids.items()}
            status = run_mission(system, MISSION, INPUTS, 600.0)
            # A mission that has nothing to do ends between two messages of the simulator.
            assert system.client.spin_until(lambda: system.client.truth["time"] > begin, 60.0)
            simulated = system.client.truth["time"] - begin
            assert status.state == "SUCCEEDED", status.reason
            used = {
                group: 100 * (cpu_seconds(pid) - before[group]) / simulated for group, pid in pids.items()
            }
            return used, Path(system.options.folder)

    used, folder = benchmark.pedantic(lambda: mission(**WITH), rounds=1)
    recorder, others = used.pop("recorder"), sum(used.values())
    without = sum(mission(**WITHOUT)[0].values())
    megabytes = sum(file.stat().st_size for file in (folder / "recordings").iterdir()) / 1e6
    figures.add(
        f"recorder during {MISSION}",
        f"{recorder:.1f} % of a core",
        f"aim: under 10 %; {megabytes:.1f} MB; all others {others:.0f} %, without a recorder {without:.0f} %",
    )
    figures.limit(recorder, most=10.0)
