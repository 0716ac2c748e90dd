"""What a recording costs while goto_user runs."""

from __future__ import annotations

import pytest

pytest.importorskip("foxglove")

from benchmarks.running_system import cpu_seconds, run_mission
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.system import System


def test_recording_cpu(benchmark, figures, domain, tmp_path):
    """In shares of simulated time, by which messages come: a busy machine makes less of it a second."""

    def mission(*, record: bool) -> dict[str, float]:
        options = BringUp(folder=str(tmp_path / str(record)), person="living_room", seed=27, record=record)
        with System(options, print) as system:
            system.wait_ready()
            system.client.follow_truth()
            assert system.client.spin_until(lambda: bool(system.client.truth), 30.0)
            pids, begin = system.pids(), system.client.truth["time"]
            before = {group: cpu_seconds(pid) for group, pid in pids.items()}
            status = run_mission(system, "goto_user", {}, 600.0)
            simulated = system.client.truth["time"] - begin
            assert status.state == "SUCCEEDED", status.reason
            return {
                group: 100 * (cpu_seconds(pid) - before[group]) / simulated for group, pid in pids.items()
            }

    used = benchmark.pedantic(lambda: mission(record=True), rounds=1)
    recorder, others = used.pop("recorder"), sum(used.values())
    without = sum(mission(record=False).values())
    size = sum(file.stat().st_size for file in (tmp_path / "True" / "recordings").iterdir()) / 1e6
    figures.add(
        "recorder during goto_user",
        f"{recorder:.1f} % of a core",
        f"aim: under 10 %; {size:.1f} MB; all others {others:.0f} %, without a recorder {without:.0f} %",
    )
    assert recorder < 10.0
