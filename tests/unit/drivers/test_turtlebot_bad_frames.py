"""Frames with a checksum that fits and values that cannot be true: told, never taken for good, then over."""

from __future__ import annotations

import math
import struct

import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import DeviceTimeout
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.drivers.diagnosis import DAMAGE_WINDOW_S, TOLERATED_DAMAGE, LineQuality
from florence_bt.drivers.turtlebot.codec.packets import members
from florence_bt.drivers.turtlebot.diagnosis import diagnose
from florence_bt.drivers.turtlebot.driver import STREAM_PERIOD_S, BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.hazards import StopReason
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from florence_bt.drivers.turtlebot.sequences import streamed_packets

FORWARD = Twist2(0.2, 0.0)
GOOD = {
    "voltage": 15_000,
    "current": -400,
    "temperature": 25,
    "charge": 2000,
    "capacity": 2696,
    "oi_mode": 3,
    "user_analog_input": 512,
    "left_encoder": 5000,
    "right_encoder": 5000,
}
DRIVE_DIRECT, STOP = 145, bytes([145, 0, 0, 0, 0])


class Line:
    """A driver that is given frames, one each 15 ms; its speeds are acknowledged by them."""

    def __init__(self, model: str = "create") -> None:
        parameters = TurtlebotParameters(robot_type=model, operation_mode=3)
        self.driver = TurtlebotDriver(parameters)
        self.packets = streamed_packets(parameters.model, parameters.drive_mode)
        self.now = 0.0
        self.reading: BaseReading | None = None
        self.sent = b""
        self.right, self.left = 0, 0
        self.driver.start(self.now)
        self.run(150)

    def run(self, frames: int, twist: Twist2 | None = None, **counts: int) -> None:
        """Send the same frame again and again, and a velocity command with each."""
        for _ in range(frames):
            self.take(self.frame(**counts), twist)

    def take(self, data: bytes, twist: Twist2 | None = None) -> None:
        self.now += STREAM_PERIOD_S
        if twist is not None:
            self.driver.command(twist, self.now)
        if readings := self.driver.receive(data, self.now):
            self.reading = readings[-1]
        self.sent = self.driver.poll(self.now) or self.sent
        if self.sent[:1] == bytes([DRIVE_DIRECT]) and len(self.sent) == 5:
            self.right, self.left = struct.unpack(">xhh", self.sent)

    def frame(self, **counts: int) -> bytes:
        """Make a frame of what the base says, with the checksum that fits."""
        known = {
            **GOOD,
            "requested_right_velocity": self.right,
            "requested_left_velocity": self.left,
            **counts,
        }
        body = b""
        for number in self.packets:
            values = [struct.pack(f">{part.wire_code}", known.get(part.name, 0)) for part in members(number)]
            body += bytes([number]) + b"".join(values)
        summed = bytes([len(body)]) + body
        return bytes([19]) + summed + bytes([-sum(summed) % 256])

    def said(self, name: str) -> tuple[Severity, str]:
        found = diagnose(self.driver, self.reading, "/dev/ttyUSB0", "")[name]
        return found.level, found.message

    @property
    def pose(self) -> Pose2:
        assert self.reading is not None
        return self.reading.odometry.pose


@pytest.mark.parametrize(
    "counts", [{"distance": 900}, {"distance": -260}, {"distance": 32767}, {"angle": 40}, {"angle": -32768}]
)
def test_a_way_that_no_base_goes_in_a_frame_is_left_out_and_told(counts: dict[str, int]) -> None:
    line = Line()
    line.run(10, FORWARD, distance=3)
    before = line.pose
    line.run(1, FORWARD, **counts)
    line.run(1, FORWARD)
    assert line.pose == before
    level, message = line.said("TurtleBot Node")
    assert level is Severity.WARN and "more way than it can drive" in message


@pytest.mark.parametrize("ticks", [(6000, 6000), (5000, 64_000), (4200, 5000)])
def test_encoders_that_jump_and_come_back_leave_the_place_as_it_is(ticks: tuple[int, int]) -> None:
    line = Line("create2")
    line.run(1, left_encoder=ticks[0], right_encoder=ticks[1])
    line.run(2)
    assert line.pose == Pose2() and line.driver.refused_readings == 2


def test_a_base_that_never_says_a_possible_way_is_lost_and_stands() -> None:
    """Drop the guard, and it drives on for ever without anybody knowing where."""
    line = Line()
    line.run(10, FORWARD, distance=3)
    with pytest.raises(DeviceTimeout, match="only ways that no base can go"):
        line.run(100, FORWARD, distance=20_000)
    assert line.driver.shutdown().startswith(STOP)
    line.driver.start(line.now)
    line.run(150)
    line.run(10, FORWARD, distance=3)
    assert line.reading is not None and line.reading.stamp == pytest.approx(line.now)


def test_one_frame_with_an_impossible_way_stops_nothing() -> None:
    line = Line()
    for _ in range(100):
        line.run(1, FORWARD, distance=20_000)
        line.run(1, FORWARD, distance=3)
    assert line.right == line.left == 200


@pytest.mark.parametrize("mode", [4, 200, 255])
def test_a_base_in_a_mode_that_nobody_knows_is_not_driven(mode: int) -> None:
    line = Line()
    line.run(20, FORWARD, distance=3)
    assert line.right == 200
    line.run(1, oi_mode=mode)
    assert line.reading is not None and line.reading.stop_reason is StopReason.MODE_LOST
    line.sent = b""
    line.run(10, FORWARD, oi_mode=mode)
    assert DRIVE_DIRECT not in line.sent[:1]
    level, message = line.said("Operating Mode")
    assert level is Severity.ERROR and str(mode) in message
    assert str(mode) in line.said("TurtleBot Node")[1]


@pytest.mark.parametrize("field", ["wall", "cliff_left", "cliff_front_right", "virtual_wall"])
@pytest.mark.parametrize("count", [2, 0x55, 255])
def test_a_flag_is_0_or_1_and_any_other_byte_is_told_as_it_came(field: str, count: int) -> None:
    line = Line()
    line.run(1, **{field: count})
    assert line.driver.implausible == {field: count}
    assert line.reading is not None and getattr(line.reading.state, field) is True, "the safe side"
    level, message = line.said("TurtleBot Node")
    assert level is Severity.WARN and f"{field} {count}" in message
    line.run(1)
    assert line.said("TurtleBot Node") == (Severity.OK, "RUNNING")


def test_a_gyro_beyond_its_counts_turns_nobody() -> None:
    line = Line()
    line.run(100)
    line.run(20, FORWARD, distance=3)
    heading = line.pose.yaw
    line.run(1, FORWARD, distance=3, user_analog_input=65_535)
    line.run(5, FORWARD, distance=3)
    assert line.pose.yaw == pytest.approx(heading, abs=math.radians(0.1))


# -- a process that was held up -----------------------------------------------------------------------------


@pytest.mark.parametrize("manual", [False, True])
def test_a_command_that_waited_while_the_process_was_held_up_is_not_driven(manual: bool) -> None:
    """Five seconds without the processor (SIGSTOP): what then comes out of the queue is of before."""
    line = Line()
    if manual:
        line.driver.set_manual_override(True, line.now)
    line.run(1)
    line.driver.command(FORWARD, line.now, manual=manual)
    line.run(5)
    assert line.right == 200
    line.now += 5.0
    for _ in range(3):
        line.driver.command(FORWARD, line.now, manual=manual)
    line.run(40)
    assert line.right == line.left == 0 and line.driver.late_commands == 3
    line.driver.command(FORWARD, line.now, manual=manual)
    line.run(5)
    assert line.right == 200, "who still drives sends the next one"


def test_a_hand_does_not_let_go_because_the_process_was_held_up() -> None:
    line = Line()
    line.driver.set_manual_override(True, line.now)
    line.driver.command(FORWARD, line.now, manual=True)
    line.run(2)
    line.driver.set_manual_override(True, line.now)  # a stop counts for the hand, too
    line.now += 5.0
    for _ in range(40):
        line.driver.command(FORWARD, line.now, manual=True)
        line.run(1)
        assert line.right == line.left == 0, "it has not let go"
    line.driver.command(Twist2(), line.now, manual=True)
    line.driver.command(FORWARD, line.now, manual=True)
    line.run(5)
    assert line.right == 200


def test_a_stop_that_waited_while_the_process_was_held_up_counts() -> None:
    line = Line()
    line.run(20, FORWARD, distance=3)
    line.now += 0.55  # shorter than the time-out: the command of before still counts
    line.driver.command(Twist2(), line.now)
    line.run(2)
    assert line.right == line.left == 0
    line.now += 5.0
    line.driver.command(Twist2(), line.now)
    line.run(5)
    assert line.right == line.left == 0 and line.driver.late_commands == 0


# -- a line that damages -------------------------------------------------------------------------------------


def test_a_line_that_damages_every_fifth_frame_is_told_and_its_frames_are_not_taken() -> None:
    line = Line()
    for number in range(400):
        frame = bytearray(line.frame(distance=3 if number % 5 else 30))
        frame[-1] ^= 0 if number % 5 else 1
        line.take(bytes(frame))
    level, message = line.said("TurtleBot Node")
    assert level is Severity.WARN and "was damaged: check the cable" in message
    assert line.pose.x == pytest.approx(320 * 0.003)
    line.run(round(DAMAGE_WINDOW_S / STREAM_PERIOD_S) + 10)
    assert line.said("TurtleBot Node") == (Severity.OK, "RUNNING")


def test_what_a_start_within_a_frame_costs_is_no_complaint() -> None:
    quality = LineQuality()
    quality.note(0.0, 0, 70)
    for number in range(1, 100):
        quality.note(number * 0.015, 70, 0)
    assert 0.0 < quality.damage(1.5) < TOLERATED_DAMAGE and quality.complaint(1.5) == ""


def test_the_quality_of_a_line_is_that_of_the_last_seconds_and_takes_no_more_memory() -> None:
    quality = LineQuality()
    for number in range(100_000):
        quality.note(number * 0.01, 0 if number % 2 else 10, 10 if number % 2 else 0)
    assert quality.damage(1000.0) == pytest.approx(0.5, abs=0.01)
    assert len(quality._slices) <= 10 * DAMAGE_WINDOW_S + 1
    assert quality.damage(1000.0 + 2 * DAMAGE_WINDOW_S) == 0.0
    assert quality.damage(0.0) == 0.0, "a clock that was set back"
