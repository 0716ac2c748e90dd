"""``florence up`` for a robot: with devices missing, and as a rehearsal in a folder of ``florence init``.

Emulated devices take the place of the configured ones; what dies comes back, and the logs tell it.
"""

from __future__ import annotations

import json
import os
import re
import signal
import sys
import time
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.timeout(1800)]

FLORENCE = [sys.executable, "-m", "florence_bt.cli"]
PATIENCE_S = 600.0
REASON = "was killed by SIGKILL, which is started again"
ABSENT_DEVICES = """\
turtlebot_node: {port: nowhere/create}
hokuyo_node: {port: nowhere/hokuyo}
kinect_node: {source: nowhere/kinect}
"""


def kill(folder: Path, process: str) -> None:
    """Kill a process of the bring-up of a robot's folder."""
    words = f"florence_bt.app.bringup.process\0{process}\0{folder}"
    (victim,) = (
        entry.name for entry in Path("/proc").iterdir() if entry.name.isdigit() and words in _command(entry)
    )
    os.kill(int(victim), signal.SIGKILL)


def _command(entry: Path) -> str:
    try:
        return (entry / "cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return ""


def done(child: Any) -> str:
    assert child.process.wait(PATIENCE_S) == 0, child.output
    return str(child.output)


def test_missing_devices_are_told_before_ready(ros_domain: int, start_process: Any, tmp_path: Path) -> None:
    (config := tmp_path / "robot.yaml").write_text(ABSENT_DEVICES)
    up = start_process(*FLORENCE, "up", "--robot", config, "--out", tmp_path / "up")
    up.wait_for("ready after", PATIENCE_S)
    told = up.output.partition("ready after")[0]
    for node in ("turtlebot_node", "hokuyo_node", "kinect_node"):
        assert f"device missing: {node}: " in told
    assert "there is no such port: plug the device in or correct the parameter 'port'" in told
    assert up.end(timeout_s=PATIENCE_S) == 130


def test_a_folder_of_init_is_brought_up_and_what_dies_comes_back(
    ros: Any, start_process: Any, tmp_path: Path, patrol: Path
) -> None:
    folder = tmp_path / "robot"
    made = done(start_process(*FLORENCE, "init", folder, "--yes", "--emulate", "--service", "none"))
    assert re.search(r"base: \S+/create \(0403:6001\) answers; passive", made)
    assert re.search(r"laser: \S+/hokuyo \(15d1:0000\) answers; .*URG-04LX", made)
    (patrol / "patrol.yaml").rename(folder / "missions" / "patrol.yaml")
    config = folder / "robot.yaml"
    text, count = re.subn(r"(?m)^  (port|source): \S+", r"  \1: nowhere/\1", config.read_text())
    assert count == 3, "the devices of the configuration are not looked at"
    config.write_text(text)

    system = start_process(*FLORENCE, "up", folder, "--person", "absent")
    system.wait_for("ready after", PATIENCE_S)
    assert "device missing" not in system.output and "does not know where it is" not in system.output
    found = json.loads(done(start_process(*FLORENCE, "doctor", "--config", config, "--format", "json")))
    assert not [finding for finding in found if finding["level"] in ("problem", "warning")]
    told: dict[str, tuple[int, str]] = {}
    listener = ros.add(FlorenceNode("listener"))
    listener.create_subscription(
        DiagnosticArray,
        "diagnostics",
        lambda message: told.update({one.name: (one.level[0], one.message) for one in message.status}),
        RELIABLE,
    )
    ros.spin_until(lambda: told.get("florence_up: process people") == (0, "runs"), PATIENCE_S)

    # The base last: with it the localisation begins anew, at the pose that it kept.
    for process in ("people", "hardware"):
        begin = len(system.output)
        watcher = start_process(*FLORENCE, "run", "patrol", "--headless")
        watcher.wait_for("[>] drive to the hotspot", PATIENCE_S)
        kill(folder / "runs", process)
        system.wait_for(f"the process '{process}' was killed by SIGKILL", PATIENCE_S, begin=begin)
        assert watcher.process.wait(PATIENCE_S) == 1
        assert f"the process '{process}' {REASON}" in watcher.output
        system.wait_for("the robot may drive again", PATIENCE_S, begin=begin)
        assert f"the process '{process}' is up again" in system.output
    warning = told_soon(ros, told, "florence_up: process hardware", 1)
    assert "once" in warning and told["florence_up: process navigation"][0] == 0

    # It knows where it is, and drives; how far depends on how busy this machine is.
    end = time.monotonic() + PATIENCE_S
    while "the place is known" not in (where := done(start_process(*FLORENCE, "where"))):
        assert time.monotonic() < end, where  # a scan must confirm the place that was kept
    drives_in_the_end(start_process)
    system.end(signal.SIGTERM, PATIENCE_S)
    assert system.process.returncode == 130
    assert not any((folder / "runs" / "ports").iterdir())

    logs = done(start_process(*FLORENCE, "logs", "--level", "warn"))
    assert logs.index("'people' was killed") < logs.index("'hardware' was killed")
    assert "the process people starts" not in logs, "that is information"
    times = [line[:12] for line in logs.splitlines() if re.match(r"\d\d:\d\d:\d\d\.\d{3} ", line)]
    assert times == sorted(times)


def drives_in_the_end(start_process: Any) -> None:
    """Run the patrol until it drives: a rehearsal waits for no busy machine, whose answers are late."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        run = start_process(*FLORENCE, "run", "patrol", "--headless")
        while run.process.poll() is None:
            if "-- driving" in run.output:
                return
            time.sleep(0.02)
        assert "did not answer the goal within" in run.output, run.output
    raise AssertionError("it never drove")


def told_soon(ros: Any, told: dict[str, tuple[int, str]], name: str, level: int) -> str:
    """Wait until a diagnosis has a level; gives its message."""
    begin = time.monotonic()
    ros.spin_until(lambda: told[name][0] == level, PATIENCE_S, what=f"{name} since {begin:.0f}")
    return told[name][1]
