"""``florence up --robot``: with devices missing, and with emulated ones in their place."""

from __future__ import annotations

import json
import sys

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.timeout(1800)]

FLORENCE = [sys.executable, "-m", "florence_bt.cli"]
PATIENCE_S = 600.0

ABSENT_DEVICES = """\
turtlebot_node: {port: nowhere/create}
hokuyo_node: {port: nowhere/hokuyo}
kinect_node: {source: nowhere/kinect}
"""


@pytest.fixture
def config(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text(ABSENT_DEVICES)
    return file


def test_missing_devices_are_told_before_ready(ros_domain, start_process, config, tmp_path):
    up = start_process(*FLORENCE, "up", "--robot", config, "--out", tmp_path / "up")
    up.wait_for("ready after", PATIENCE_S)
    told = up.output.partition("ready after")[0]
    for node in ("turtlebot_node", "hokuyo_node", "kinect_node"):
        assert f"device missing: {node}: " in told
    assert "there is no such port: plug the device in or correct the parameter 'port'" in told
    assert up.end(timeout_s=PATIENCE_S) == 130


def test_a_rehearsal_drives_emulated_devices_in_place_of_the_configured_ones(
    ros_domain, start_process, config, tmp_path
):
    up = start_process(*FLORENCE, "up", "--robot", config, "--emulate", "--out", tmp_path / "up")
    up.wait_for("ready after", PATIENCE_S)
    assert "device missing" not in up.output
    assert "does not know where it is" not in up.output
    status = start_process(*FLORENCE, "status")
    assert status.process.wait(PATIENCE_S) == 0, status.output
    doctor = start_process(*FLORENCE, "doctor", "--config", config, "--format", "json")
    assert doctor.process.wait(PATIENCE_S) == 0, doctor.output
    found = json.loads(doctor.output)
    assert not [finding for finding in found if finding["level"] in ("problem", "warning")]
    assert up.end(timeout_s=PATIENCE_S) == 130
    assert not any((tmp_path / "up" / "ports").iterdir())
