"""The base is stopped by its port when the driver that drove it is gone, amid whatever it sent."""

import os
import select
import subprocess
import sys
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from florence_bt.app.bringup.hold import HungDriverStop, stop_base
from florence_bt.app.bringup.options import BringUp
from florence_bt.core.errors import DeviceLost
from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.simulation.emulators.create import CreateEmulator, Mode
from florence_bt.simulation.sensors.base_noise import PERFECT_BASE, BaseSensors

DRIVING = commands.drive_direct(200, 150)
ROBOT = """
turtlebot_node: {port: /dev/base, robot_type: create2, drive_mode: drive, update_rate: 20.0}
"""


class Port:
    """A port that leads to an emulated base."""

    def __init__(self, create: CreateEmulator) -> None:
        self.create = create
        self.opened: list[tuple[str, int]] = []
        self.closed = False

    def open(self, path: str, baud_rate: int) -> Any:
        self.opened.append((path, baud_rate))
        return self

    def write(self, data: bytes) -> None:
        assert not self.closed
        self.create.receive(data, 1.0)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def port(base: Any) -> Port:
    create = CreateEmulator(base, BaseSensors(base, 0, PERFECT_BASE))
    create.receive(bytes([128, 132]) + DRIVING, 0.0)
    assert base.wheels == (0.15, 0.2)
    return Port(create)


@pytest.mark.parametrize("sent", range(len(DRIVING) + 1))
def test_a_driver_may_die_amid_a_command(base: Any, port: Port, tmp_path: Any, sent: int) -> None:
    port.create.receive(commands.drive_direct(300, 300)[:sent], 0.5)
    options = BringUp(str(tmp_path))
    assert stop_base(options, port.open) == "the base was sent a stop command"
    assert base.wheels == (0.0, 0.0) and port.create.mode is Mode.FULL and port.closed
    assert port.opened == [(str(tmp_path / "ports" / "create"), 57600)]


def test_a_base_that_drives_to_its_dock_is_stopped(base: Any, port: Port, tmp_path: Any) -> None:
    port.create.receive(commands.cover_and_dock(), 0.5)
    port.create.poll(0.6)
    assert port.create.mode is Mode.PASSIVE
    assert stop_base(BringUp(str(tmp_path)), port.open) == "the base was sent a stop command"
    assert base.wheels == (0.0, 0.0) and port.create.mode is Mode.FULL


def test_the_port_of_a_real_robot_is_that_of_its_configuration(port: Port, tmp_path: Any) -> None:
    config = tmp_path / "robot.yaml"
    config.write_text(ROBOT)
    options = BringUp(str(tmp_path), simulated=False, config_file=str(config))
    assert stop_base(options, port.open) == "the base was sent a stop command"
    assert port.opened == [("/dev/base", 115200)]


def test_parameters_are_read_as_the_driver_reads_them(port: Port, tmp_path: Any) -> None:
    """``null`` leaves one out, and a whole number is a number."""
    config = tmp_path / "robot.yaml"
    config.write_text(
        "turtlebot_node: {port: /dev/base, operation_mode: null, cmd_vel_timeout: 1, drive_mode: turtle}"
    )
    options = BringUp(str(tmp_path), simulated=False, config_file=str(config))
    assert stop_base(options, port.open) == "the base was sent a stop command"
    assert port.opened == [("/dev/base", 57600)]


def test_a_base_that_cannot_be_told_is_said_to_be_driving(tmp_path: Any) -> None:
    def gone(path: str, baud_rate: int) -> Any:
        raise DeviceLost(f"cannot open {path}")

    said = stop_base(BringUp(str(tmp_path)), gone)
    assert "may still be driving" in said and "cannot open" in said


def test_a_configuration_that_cannot_be_read_any_more_is_said_too(tmp_path: Any) -> None:
    options = BringUp(str(tmp_path), simulated=False, config_file=str(tmp_path / "gone.yaml"))
    assert "may still be driving" in stop_base(options)


# -- a driver that has the port open and does not answer -----------------------------------------------------

HUNG_DRIVER = """
import os, signal, sys
from florence_bt.drivers.serial_port import SerialPort, WRITE_TIMEOUT_S
from florence_bt.core.errors import DeviceTimeout
port = SerialPort(sys.argv[1], 57600)
try:
    while True:  # nobody reads: until the line takes no more, amid a command
        port.write(bytes.fromhex(sys.argv[2]))
except DeviceTimeout:
    print("stands", flush=True)
    os.kill(os.getpid(), signal.SIGSTOP)
signal.pause()
"""


@pytest.fixture
def line(tmp_path: Path) -> Iterator[int]:
    """The base's end of a pseudo-terminal, whose other end a stopped process has open and has filled."""
    base_end, driver_end = os.openpty()
    tty.setraw(driver_end)
    (tmp_path / "ports").mkdir()
    (tmp_path / "ports" / "create").symlink_to(os.ttyname(driver_end))
    command = [sys.executable, "-c", HUNG_DRIVER, str(tmp_path / "ports" / "create"), DRIVING.hex()]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as driver:
        try:
            assert driver.stdout is not None and driver.stdout.readline() == "stands\n"
            os.waitid(os.P_PID, driver.pid, os.WSTOPPED)
            yield base_end
        finally:
            driver.kill()
            os.close(driver_end)
            os.close(base_end)


def hear(create: CreateEmulator, line: int) -> None:
    while select.select([line], [], [], 0.0)[0]:
        create.receive(os.read(line, 1 << 16), 1.0)


def test_the_base_is_stopped_past_a_driver_that_does_not_answer(
    base: Any, port: Port, line: int, tmp_path: Path
) -> None:
    stop = HungDriverStop(BringUp(str(tmp_path)))
    assert stop.stop() == ""
    # It comes after what has gone out already, and is not kept waiting by what has not.
    hear(port.create, line)
    assert base.wheels == (0.0, 0.0)
    assert stop.stop() == ""
    hear(port.create, line)
    assert base.wheels == (0.0, 0.0) and port.create.mode is Mode.FULL


def test_a_base_that_is_unplugged_cannot_be_stopped_and_that_is_said(tmp_path: Path) -> None:
    assert "there is no such port" in HungDriverStop(BringUp(str(tmp_path))).stop()
