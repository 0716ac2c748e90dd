"""A Create through its real driver: the one of ``--device``, or the emulated one in a time driven by hand.

The robot moves by centimetres, and only with ``--may-drive``.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator

import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.core.geometry import Twist2
from florence_bt.drivers.serial_port import SerialPort
from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.drivers.turtlebot.codec.packets import PACKETS, OiMode, decode_packets, implausible
from florence_bt.drivers.turtlebot.diagnosis import diagnose
from florence_bt.drivers.turtlebot.driver import BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from tests.hardware.hand_driven import Emulated, HandPort
from tools.emulators.create_program import CreateOptions, CreateProgram

pytestmark = pytest.mark.slow

KINDS = ("create", "create2", "roomba")
READY_S = 10.0


class Robot:
    """Port and driver, served for as long as somebody waits."""

    def __init__(self, kind: str, device: str | Emulated) -> None:
        self.parameters = TurtlebotParameters(robot_type=kind)
        rate = self.parameters.model.baud_rate
        emulated = isinstance(device, Emulated)
        self.clock = device.clock if emulated else time.monotonic
        self.port = HandPort(device, rate) if emulated else SerialPort(device, rate)
        self.driver = TurtlebotDriver(self.parameters)
        self.readings: list[BaseReading] = []
        self.driver.start(self.clock())

    def run(
        self, seconds: float, twist: Twist2 | None = None, until: Callable[[], bool] | None = None
    ) -> list[BaseReading]:
        """Serve the driver; gives the readings of that time."""
        before = len(self.readings)
        end = self.clock() + seconds
        while self.clock() < end and not (until is not None and until()):
            if twist is not None:
                self.driver.command(twist, self.clock())
            self.port.write(self.driver.poll(self.clock()))
            data = self.port.read(0.005)
            self.readings += self.driver.receive(data, self.clock())
        return self.readings[before:]

    def ready(self) -> None:
        self.run(READY_S, until=lambda: len(self.readings) > 10)
        assert self.readings, "the base is silent: is it switched on, and is it the right port?"

    def close(self) -> None:
        self.port.write(self.driver.shutdown())
        self.port.close()


@pytest.fixture(scope="module")
def robot(
    device_path: Callable[..., tuple[str, str] | None], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Robot]:
    found = device_path(*KINDS)
    options = CreateOptions(link=tmp_path_factory.mktemp("create") / "line")
    emulated = Emulated(lambda clock: CreateProgram(options, clock)) if found is None else None
    made = Robot(*found) if found is not None else Robot("create", emulated)
    made.ready()
    yield made
    made.close()
    if emulated is not None:
        emulated.program.close()


@pytest.fixture
def moving(robot: Robot, may_drive: bool, device_path: Callable[..., tuple[str, str] | None]) -> Robot:
    if device_path(*KINDS) is not None and not may_drive:
        pytest.skip("the robot may not move: give --may-drive when there is a metre of room around it")
    return robot


def test_frames_come_at_their_rate_and_whole(robot: Robot) -> None:
    robot.run(1.0)
    good, bad = robot.driver.decoder.good_frames, robot.driver.decoder.bad_frames
    robot.run(2.0)
    rate = (robot.driver.decoder.good_frames - good) / 2.0
    assert rate == pytest.approx(1 / 0.015, rel=0.1)
    assert robot.driver.decoder.bad_frames - bad <= 1
    assert robot.driver.decoder.checksum_form is not None


def test_the_battery_and_every_packet_are_plausible(robot: Robot) -> None:
    state = robot.run(1.0)[-1].state
    assert 10_000 < state.voltage < 20_000
    assert 0 < state.charge <= state.capacity * 1.05
    assert -20 < state.temperature < 70
    values = {
        packet.id: int(getattr(state, packet.name))
        for packet in PACKETS.values()
        if packet.scale is None and packet.id in robot.parameters.model.packets
    }
    assert implausible(values) == {}


def test_modes_are_reached_and_told(robot: Robot) -> None:
    for mode in (OiMode.PASSIVE, OiMode.SAFE, OiMode.FULL):
        robot.driver.set_mode(mode, robot.clock())
        robot.run(READY_S, until=lambda: not robot.driver.starting)
        state = robot.run(0.5)[-1].state
        if not state.charging_sources_available:
            assert state.oi_mode == mode
    assert diagnose(robot.driver, robot.readings[-1], "", "")["TurtleBot Node"].level is Severity.OK


def test_a_query_is_answered(robot: Robot) -> None:
    # All of it within the silence that the driver bears (data_timeout).
    robot.port.write(commands.pause_stream())
    robot.run(0.1)
    robot.port.read(0.05)
    robot.port.write(commands.sensors(6))
    answer = b""
    end = robot.clock() + 2.0
    while len(answer) < 52 and robot.clock() < end:
        answer += robot.port.read(0.1)
    assert decode_packets([6], answer)[22] > 10_000
    robot.port.write(commands.resume_stream())
    assert robot.run(0.5)


def test_the_gyro_rests(robot: Robot) -> None:
    robot.run(2.0)
    gyro = robot.readings[-1].gyro
    if robot.driver.gyro is None or gyro is None:
        pytest.skip("this base has no gyro")
    assert 425 <= gyro.offset <= 575
    assert abs(gyro.rate) < math.radians(3)


def test_ten_centimetres_there_and_back(moving: Robot) -> None:
    start = moving.readings[-1].odometry.pose
    moving.run(1.0, Twist2(0.1, 0.0))
    there = moving.run(1.5)[-1]
    assert there.odometry.pose.distance_to(start) == pytest.approx(0.16, abs=0.08)
    assert there.at_rest
    moving.run(1.0, Twist2(-0.1, 0.0))
    back = moving.run(1.5)[-1]
    assert back.odometry.pose.distance_to(start) < 0.08


def test_a_quarter_turn(moving: Robot) -> None:
    start = moving.readings[-1].odometry.pose.yaw
    moving.run(1.0, Twist2(0.0, 0.7))
    turned = moving.run(1.5)[-1].odometry.pose.yaw - start
    assert math.remainder(turned, math.tau) == pytest.approx(1.1, abs=0.4)


def test_silence_of_commands_stops_the_base(moving: Robot) -> None:
    moving.run(0.4, Twist2(0.05, 0.0))
    moving.run(moving.parameters.cmd_vel_timeout + 0.2)
    assert moving.run(0.3)[-1].state.wheels_stopped
