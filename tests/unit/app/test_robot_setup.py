"""``florence init``: devices on a made-up machine, the files, running it twice; the folder for `up`."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.app.bringup.config import load_config
from florence_bt.app.bringup.robot_folder import read_robot_folder
from florence_bt.app.doctor.finding import good, problem
from florence_bt.app.robot_setup.discovery import SerialDevice, find_base, find_laser, serial_devices
from florence_bt.app.robot_setup.files import Answers, robot_yaml, systemd_unit, udev_rules
from florence_bt.cli.application import app
from florence_bt.core.errors import ConfigError


def plug(root: Path, tty: str, ids: str = "", serial: str = "") -> None:
    """List a terminal as the kernel does: below its USB device, with a link in the class."""
    device = root / "devices" / "usb1" / f"1-{tty}"
    port = device / "1-1:1.0" / tty
    port.mkdir(parents=True)
    if ids:
        vendor, _, product = ids.partition(":")
        (device / "idVendor").write_text(vendor + "\n")
        (device / "idProduct").write_text(product + "\n")
    if serial:
        (device / "serial").write_text(serial + "\n")
    entry = root / "class" / tty
    entry.mkdir(parents=True)
    (entry / "device").symlink_to(port)


def test_serial_devices_are_found_with_their_ids_and_serial_numbers(tmp_path):
    plug(tmp_path, "ttyUSB0", "0403:6001", "A9XYZ")
    plug(tmp_path, "ttyACM0", "15d1:0000")
    plug(tmp_path, "ttyUSB1")
    plug(tmp_path, "ttyS0", "0403:6001")
    assert serial_devices(tmp_path / "class", Path("/dev")) == [
        SerialDevice("/dev/ttyACM0", "15d1:0000"),
        SerialDevice("/dev/ttyUSB0", "0403:6001", "A9XYZ"),
        SerialDevice("/dev/ttyUSB1"),
    ]
    assert serial_devices(tmp_path / "nowhere") == []


CABLES = [
    SerialDevice("/dev/ttyUSB0", "0403:6001", "A1"),
    SerialDevice("/dev/ttyACM0", "15d1:0000"),
    SerialDevice("/dev/ttyUSB1", "0403:6001", "A2"),
]


def test_of_two_cables_the_one_that_answers_is_the_base():
    def ask(config):
        (section,) = config.values()
        found = good if section["port"] == "/dev/ttyUSB1" else problem
        arguments = ("firmware", "base", "answers; passive, 14.9 V")
        yield found(*arguments) if found is good else found(*arguments, "switch it on")

    base = find_base(CABLES, "create", ask)
    assert base is not None and (base.path, base.serial) == ("/dev/ttyUSB1", "A2") and "14.9" in base.answer
    laser = find_laser(CABLES, ask)
    assert laser is not None and laser.path == "/dev/ttyACM0" and not laser.answer
    assert find_base(CABLES[1:2], "create", ask) is None


def test_a_device_with_a_serial_number_gets_its_name_by_it_and_the_others_keep_the_general_rule():
    rules = udev_rules({"create": SerialDevice("/dev/ttyUSB1", "0403:6001", "A2"), "hokuyo": CABLES[1]})
    (create,) = (line for line in rules.splitlines() if 'SYMLINK+="create"' in line)
    assert 'ATTRS{serial}=="A2"' in create and 'ATTRS{idVendor}=="0403"' in create
    (hokuyo,) = (line for line in rules.splitlines() if 'SYMLINK+="hokuyo"' in line)
    assert "serial" not in hokuyo and rules.count('"045e"') == 4
    assert udev_rules({"create": None, "hokuyo": None}).count('SYMLINK+="create"') == 2


@pytest.mark.parametrize("service", ["user", "system"])
def test_the_unit_survives_every_path_and_is_right_for_systemd(tmp_path, service):
    folder = tmp_path / "my robot 50%"
    folder.mkdir()
    program = tmp_path / "florence"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    variables = {"ROS_DOMAIN_ID": "7", "PYTHONPATH": "/a b:/c", "HOME": "/root", "ROS_DISTRO": ""}
    text = systemd_unit(folder, [str(program)], service, "root", variables)
    assert "ROS_DOMAIN_ID=7" in text and "HOME" not in text and "ROS_DISTRO" not in text
    assert ("User=root" in text) is (service == "system")
    if shutil.which("systemd-analyze") is None:
        pytest.skip("there is no systemd-analyze here")
    unit = tmp_path / "florence.service"
    unit.write_text(text)
    scope = ["--user"] if service == "user" else []
    done = subprocess.run(
        ["systemd-analyze", *scope, "verify", unit],
        env={"XDG_RUNTIME_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "florence.service" not in done.stderr, done.stderr


def answers(**changes: object) -> Answers:
    usual = {"robot_type": "create", "base": "/dev/create", "laser": "/dev/hokuyo", "speech": "print"}
    rest = {"map_file": "", "hotspots": "hotspots.yaml", "service": "none", "emulate": False}
    return Answers(**{**usual, **rest, **changes})


def test_the_configuration_keeps_what_the_package_says_and_has_the_answers(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text(robot_yaml(answers(robot_type="create2", laser="192.168.0.10", speech="no: 1"), file))
    config = load_config(file)
    assert config["turtlebot_node"]["port"] == "/dev/create"
    assert config["turtlebot_node"]["robot_type"] == "create2"
    assert config["turtlebot_node"]["gyro_measurement_range"] == 150.0
    assert config["hokuyo_node"]["ip_address"] == "192.168.0.10"
    assert config["speech"]["program"] == "no: 1"
    assert "# document, table 8" in file.read_text()


def florence(*words: str | Path):
    return CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)


def test_it_can_be_run_twice_and_leaves_what_is_there(tmp_path):
    folder = tmp_path / "robot"
    first = florence("init", folder, "--yes", "--service", "none")
    assert first.exit_code == 0 and f"florence up {folder}" in first.output
    assert not (folder / "florence.service").exists() and "systemctl" not in first.output
    config = folder / "robot.yaml"
    config.write_text(
        config.read_text().replace("gyro_scale_correction: 1.35", "gyro_scale_correction: 1.41")
    )
    mine = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    again = florence("init", folder, "--yes", "--service", "none")
    assert again.exit_code == 0 and {file: file.read_bytes() for file in mine} == mine
    assert "stays as it is" in again.output and "1.41" in again.output
    assert again.output.count("as it should be") == len(mine) - 1


def test_wrong_answers_change_nothing(tmp_path):
    for words in (("--service", "systemd"), ("--robot-type", "roombaa"), ("--map", tmp_path / "none.yaml")):
        result = florence("init", tmp_path / "robot", "--yes", *words)
        assert result.exit_code == 2 and "would have worked" in result.output
    assert not (tmp_path / "robot").exists()


def test_the_folder_says_what_up_brings_up(tmp_path):
    assert florence("init", tmp_path / "robot", "--yes", "--service", "none").exit_code == 0
    its = read_robot_folder(tmp_path / "robot")
    assert its.robot == tmp_path / "robot" / "robot.yaml" and its.map is None and not its.emulate
    assert its.missions == (tmp_path / "robot" / "missions",) and its.out == tmp_path / "robot" / "runs"
    with pytest.raises(ConfigError, match="florence init"):
        read_robot_folder(tmp_path)
    (tmp_path / "robot" / "florence.yaml").write_text("robot: robot.yaml\nmapp: maps/home.yaml\n")
    with pytest.raises(ConfigError, match=r"florence\.yaml:2:1.*'mapp'.*map"):
        read_robot_folder(tmp_path / "robot")
    (tmp_path / "robot" / "florence.yaml").write_text("robot: robot.yaml\nemulate: maybe\n")
    with pytest.raises(ConfigError, match=r"florence\.yaml:2:10"):
        read_robot_folder(tmp_path / "robot")


def test_up_with_a_folder_refuses_what_contradicts_it(tmp_path):
    assert florence("init", tmp_path / "robot", "--yes", "--service", "none").exit_code == 0
    for words in (("--sim",), ("--missions-only",)):
        result = florence("up", tmp_path / "robot", *words)
        assert result.exit_code == 2 and "florence up FOLDER" in result.output
    assert florence("up", tmp_path).exit_code == 2
