"""``florence up --split``: a process has one node, is called as it, and starts again alone."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

from florence_bt.app.bringup.fork_server import ForkServer
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.supervisor import ProcessDied, Supervisor
from florence_bt.app.bringup.topology import companions, processes
from florence_bt.app.logs.logs import LogReader
from florence_bt.ros.node import FlorenceNode

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]

NODES = ["velocity_filter", "robot_description"]


def test_each_node_is_alone_in_its_process_and_starts_again_alone(ros: Any, tmp_path: Path) -> None:
    options = BringUp(folder=str(tmp_path), simulated=False, split=True)
    assert set(NODES) < set(processes(options)) and companions("velocity_filter", options) == []
    watcher = ros.add(FlorenceNode("watcher"))

    with (
        ForkServer(tmp_path) as fork_server,
        Supervisor(options.write(), tmp_path / "logs", fork_server.fork) as supervisor,
    ):
        supervisor.start(NODES)

        def up() -> bool:
            """Whether each process says that its node is there."""
            supervisor.check()
            files = {name: options.up_file(name) for name in NODES}
            return all(
                file.exists() and file.read_text().strip() == str(supervisor.pids()[name])
                for name, file in files.items()
            )

        ros.spin_until(up, what="both processes")
        ros.spin_until(lambda: set(NODES) <= set(watcher.get_node_names()), what="both nodes")
        before = supervisor.pids()

        os.kill(before["velocity_filter"], signal.SIGKILL)

        def death() -> str:
            try:
                supervisor.check()
            except ProcessDied as died:
                return died.name
            return ""

        assert ros.spin_until(death, what="the death") == "velocity_filter"
        assert supervisor.start_again("velocity_filter") == 0.0
        ros.spin_until(up, what="the new process")
        after = supervisor.pids()
        assert after["robot_description"] == before["robot_description"]
        assert after["velocity_filter"] != before["velocity_filter"]

    starts = [
        entry.process
        for entry in LogReader(tmp_path / "logs", (), "info", whole=False).new()
        if entry.lines[0].endswith(" starts")
    ]
    assert sorted(starts) == ["robot_description", "velocity_filter", "velocity_filter"]
