"""The real TurtleBot driver against the emulated Create, through bytes, with the time driven by hand."""

import math
from typing import Any

import pytest

from florence_bt.core.errors import ConfigError, DeviceTimeout
from florence_bt.core.geometry import Twist2
from florence_bt.drivers.turtlebot.codec.packets import OiMode
from florence_bt.drivers.turtlebot.driver import TurtlebotDriver
from florence_bt.drivers.turtlebot.hazards import StopReason
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from florence_bt.simulation.emulators.create import Mode
from tests.emulators.line_bench import STEP, Bench, ready
from tests.sweeps import sweep


def test_start_up_sequence(base: Any) -> None:
    bench = Bench(base, operation_mode=2)
    bench.run(1.2)
    stream = bytes([148, 29, *range(7, 15), *range(17, 36), 41, 42])
    stop = bytes([145, 0, 0, 0, 0])
    start, safe, rest, *drives = bench.sent
    assert start == (0.0, bytes([128] * 5))
    assert safe == (pytest.approx(0.5), bytes([131]))
    # The first speeds wait for the first frame, which tells the mode.
    assert rest == (pytest.approx(1.0), bytes([147, 1]) + stream)
    assert drives
    assert {data for _, data in drives} == {stop}
    assert bench.create.mode is Mode.SAFE
    assert bench.create.digital_outputs == 1


def test_full_mode_and_passive_mode(base: Any) -> None:
    full = Bench(base)
    full.run(1.1)
    assert full.create.mode is Mode.FULL
    passive = Bench(type(base)(), operation_mode=1)
    readings = passive.run(1.1, Twist2(0.2, 0.0))
    assert passive.create.mode is Mode.PASSIVE
    assert readings[-1].stop_reason is None
    assert not any(data[0] == 145 for _, data in passive.sent)


def test_a_reading_every_15_ms(base: Any) -> None:
    bench = ready(base)
    readings = bench.run(3.0)
    assert len(readings) == 200
    assert bench.now - readings[-1].stamp < 0.015
    assert bench.driver.decoder.noise_bytes == 0


@pytest.mark.parametrize("how", [{}, {"piece": 1}, {"header_in_checksum": True}, {"has_gyro": False}])
def test_drive_one_metre_and_turn_90_degrees(base: Any, how: dict[str, Any]) -> None:
    bench = ready(base, **how)
    bench.run(4.0, Twist2(0.25, 0.0))
    bench.run(1.0)
    pose = bench.latest.odometry.pose
    assert base.advanced == pytest.approx(1.0, abs=0.16)  # drives on for the time-out of 0.6 s
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((base.advanced, 0.0, 0.0), abs=0.002)
    bench.run(2.0, Twist2(0.0, math.pi / 4))
    bench.run(1.0)
    assert bench.latest.odometry.pose.yaw == pytest.approx(base.turned, abs=math.radians(1.1))
    assert base.turned == pytest.approx(math.radians(90), abs=math.radians(30))


def test_velocity_and_command_arrive(base: Any) -> None:
    bench = ready(base)
    bench.run(1.0, Twist2(0.2, 0.5))
    assert base.wheels == (0.135, 0.265)
    twist = bench.latest.odometry.twist
    assert (twist.linear, twist.angular) == pytest.approx((0.2, 0.5), abs=0.02)
    assert bench.latest.state.requested_right_velocity == pytest.approx(0.265)


@pytest.mark.parametrize("seed", sweep(range(4), every=4))
def test_with_noise_the_gyro_keeps_the_heading(base: Any, seed: int) -> None:
    bench = ready(base, None, seed=seed)
    for _ in range(4):
        bench.run(2.0, Twist2(0.2, 0.0))
        bench.run(2.0, Twist2(0.0, math.pi / 4))
    bench.run(1.0)
    assert bench.latest.odometry.pose.yaw == pytest.approx(
        math.remainder(base.turned, math.tau), abs=math.radians(4)
    )
    assert bench.latest.gyro is not None
    assert bench.latest.gyro.offset == pytest.approx(512, abs=1)


def test_the_base_stops_when_commands_stop(base: Any) -> None:
    bench = ready(base)
    bench.driver.command(Twist2(0.2, 0.0), bench.now)
    bench.run(0.5)
    assert base.wheels == (0.2, 0.2)
    bench.run(0.15)
    assert base.wheels == (0.0, 0.0)


def test_silence_is_found_and_a_new_start_recovers(base: Any) -> None:
    bench = ready(base)
    bench.run(1.0, Twist2(0.2, 0.0))
    bench.create.faults.silent = True
    silent_from = bench.now
    with pytest.raises(DeviceTimeout, match="no good frame"):
        bench.run(5.0, Twist2(0.2, 0.0))
    parameters = TurtlebotParameters()
    assert bench.now - silent_from == pytest.approx(parameters.data_timeout, abs=0.03)
    assert parameters.data_timeout <= parameters.cmd_vel_timeout
    bench.create.faults.silent = False
    bench.driver.start(bench.now)
    readings = bench.run(1.5)
    assert base.wheels == (0.0, 0.0)
    assert len(readings) > 20
    # The pose goes on where it was known last; what the base rolled in silence is lost with the frames.
    assert bench.latest.odometry.pose.x == pytest.approx(0.2, abs=0.01)
    lost = base.advanced - bench.latest.odometry.pose.x
    bench.run(1.0, Twist2(0.2, 0.0))
    assert bench.latest.odometry.pose.x == pytest.approx(base.advanced - lost, abs=0.002)


def test_a_deadline_for_everything(base: Any) -> None:
    bench = Bench(base)
    assert bench.driver.next_deadline() == 0.0
    bench.run(0.1)
    assert bench.driver.next_deadline() == pytest.approx(0.5)
    bench.run(2.0)
    deadline = bench.driver.next_deadline()
    assert deadline is not None
    assert bench.now - STEP <= deadline <= bench.now + 1.0 / 30.0
    bench.driver.shutdown()
    assert bench.driver.next_deadline() is None
    assert bench.driver.poll(bench.now) == b""


def test_bad_checksums_and_cut_frames_are_counted(base: Any) -> None:
    bench = ready(base)
    bench.create.faults.bad_checksums = 3
    bench.create.faults.noise = bytes([0x13, 72, 7, 0xFF] * 5)
    good = len(bench.run(0.3))
    assert bench.driver.decoder.bad_frames == 3
    assert good == 17
    bench.create.faults.partial_frames = 2
    assert len(bench.run(0.3)) == 18


def test_wheel_drop_in_safe_mode_stops_is_reported_and_is_recovered(base: Any) -> None:
    bench = ready(base, operation_mode=2)
    forward = Twist2(0.2, 0.0)
    bench.run(0.5, forward)
    bench.create.faults.wheel_drops = 8
    bench.run(0.5, forward)
    assert (bench.create.mode, base.wheels) == (Mode.PASSIVE, (0.0, 0.0))
    assert bench.latest.stop_reason is StopReason.WHEEL_DROP
    bench.create.faults.wheel_drops = 0
    bench.run(0.5)
    assert bench.latest.stop_reason is StopReason.MODE_LOST
    assert bench.create.mode is Mode.PASSIVE
    bench.run(2.0)
    assert bench.create.mode is Mode.PASSIVE  # nobody wants to drive
    bench.run(1.0, forward)
    assert (bench.create.mode, base.wheels) == (Mode.SAFE, (0.2, 0.2))
    assert bench.latest.stop_reason is None
    assert bench.create.digital_outputs == 1


def test_the_charger_is_no_way_back_until_unplugged(base: Any) -> None:
    bench = ready(base, operation_mode=2)
    bench.create.faults.charger = True
    bench.run(4.0, Twist2(0.2, 0.0))
    assert bench.latest.stop_reason is StopReason.CHARGER
    assert (bench.create.mode, base.wheels) == (Mode.PASSIVE, (0.0, 0.0))
    bench.create.faults.charger = False
    bench.run(4.0, Twist2(0.2, 0.0))
    assert (bench.create.mode, base.wheels) == (Mode.SAFE, (0.2, 0.2))


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ({"left_bumper": True}, StopReason.BUMPER),
        ({"cliffs": (False, False, True, False)}, StopReason.CLIFF),
        ({"wheel_drops": 16}, StopReason.WHEEL_DROP),
    ],
)
def test_contact_in_full_mode_holds_forward_motion_only(
    base: Any, fault: dict[str, Any], reason: StopReason
) -> None:
    bench = ready(base)
    bench.run(0.5, Twist2(0.2, 0.0))
    for name, value in fault.items():
        setattr(bench.create.faults, name, value)
    moved = base.advanced
    bench.run(0.5, Twist2(0.2, 0.0))
    assert bench.latest.stop_reason is reason
    assert base.advanced - moved < 0.2 * 0.03  # two frames
    bench.run(0.5, Twist2(-0.2, 0.0))
    assert base.wheels == (-0.2, -0.2)
    bench.run(0.5, Twist2(0.0, 1.0))
    assert base.wheels == (-0.13, 0.13)
    # The press is gone, but only a new command moves the base forward again.
    bench.run(0.5, Twist2(0.2, 0.0))
    bench.create.faults.left_bumper = False
    bench.create.faults.wheel_drops = 0
    bench.create.faults.cliffs = (False,) * 4
    bench.run(0.05)
    assert base.wheels == (0.0, 0.0)
    bench.run(0.1, Twist2(0.2, 0.0))
    assert base.wheels == (0.2, 0.2)


def test_a_blocked_wheel_holds_the_base_and_is_named(base: Any) -> None:
    bench = ready(base)
    bench.run(0.5, Twist2(0.2, 0.0))
    bench.create.faults.overcurrents = 16
    bench.run(0.3, Twist2(0.2, 0.0))
    assert bench.latest.stop_reason is None
    bench.run(0.4, Twist2(0.2, 0.0))
    assert bench.latest.stop_reason is StopReason.OVERCURRENT
    assert bench.latest.stop_text.startswith("the left wheel draws too much current")
    assert base.wheels == (0.0, 0.0)
    bench.create.faults.overcurrents = 0
    bench.run(1.5, Twist2(0.2, 0.0))
    assert base.wheels == (0.2, 0.2)


def test_bumpers_may_be_ignored(base: Any) -> None:
    bench = ready(base, stop_motors_on_bump=False)
    bench.create.faults.left_bumper = True
    bench.run(0.5, Twist2(0.2, 0.0))
    assert base.wheels == (0.2, 0.2)


def test_change_of_mode_stops_and_sets_the_outputs_again(base: Any) -> None:
    bench = ready(base)
    bench.driver.set_digital_outputs(6)
    bench.run(0.5, Twist2(0.2, 0.0))
    assert bench.create.digital_outputs == 6
    assert bench.latest.state.user_digital_outputs == 6
    bench.driver.set_mode(2, bench.now)
    bench.run(0.1)
    assert base.wheels == (0.0, 0.0)
    bench.run(1.1)
    assert (bench.create.mode, bench.create.digital_outputs) == (Mode.SAFE, 6)
    bench.driver.set_mode(1, bench.now)
    bench.run(0.6)
    assert (bench.create.mode, bench.create.digital_outputs) == (Mode.PASSIVE, 0)
    assert bench.latest.stop_reason is None
    with pytest.raises(ConfigError, match="drive mode"):
        bench.driver.set_digital_outputs(1)
    bench.driver.set_mode(3, bench.now)
    bench.run(1.2)
    assert bench.latest.state.oi_mode == OiMode.FULL


@pytest.mark.parametrize("mode", [0, 4, 255, -1])
def test_modes_that_do_not_exist(base: Any, mode: int) -> None:
    bench = ready(base)
    with pytest.raises(ConfigError, match="no operating mode"):
        bench.driver.set_mode(mode, bench.now)
    bench.run(0.1, Twist2(0.2, 0.0))
    assert base.wheels == (0.2, 0.2)


def test_shutdown_stops_and_silences(base: Any) -> None:
    bench = ready(base)
    bench.run(0.5, Twist2(0.2, 0.3))
    bench.create.receive(bench.driver.shutdown(), bench.now)
    assert base.wheels == (0.0, 0.0)
    assert bench.create.poll(bench.now + 1.0) == b""


@pytest.mark.parametrize("sent", range(5))
def test_half_a_command_of_an_earlier_program_does_not_eat_ours(base: Any, sent: int) -> None:
    bench = Bench(base)
    bench.create.receive(bytes([128, 132, 145, 0, 200, 0, 200]), 0.0)
    bench.create.receive(bytes([145, 1, 44, 1])[:sent], 0.0)
    bench.run(0.01)
    assert (base.wheels, bench.create.mode) == ((0.0, 0.0), Mode.PASSIVE)
    bench.run(1.2)
    assert bench.create.mode is Mode.FULL
    assert bench.readings


@pytest.mark.parametrize(
    ("sent", "hint"),
    [(b"", "is it switched on"), (b"99b\n00P\n" * 20, "are the port and its baud rate right")],
)
def test_what_came_instead_of_frames_is_told(sent: bytes, hint: str) -> None:
    driver = TurtlebotDriver(TurtlebotParameters())
    driver.start(0.0)
    with pytest.raises(DeviceTimeout, match=hint):
        for step in range(300):
            driver.receive(sent, step / 100.0)
            driver.poll(step / 100.0)


def test_outputs_that_the_base_ignores_are_refused(base: Any) -> None:
    bench = ready(base, operation_mode=2)
    bench.create.faults.charger = True
    bench.run(0.1)
    with pytest.raises(ConfigError, match="not in its drive mode now: the charger"):
        bench.driver.set_digital_outputs(3)
    assert bench.driver.digital_outputs == 1


def test_a_power_cycle_is_found_as_silence_and_survived(base: Any) -> None:
    bench = ready(base)
    bench.create.receive(bytes([7]), bench.now)
    with pytest.raises(DeviceTimeout):
        bench.run(2.0)
    # The boot loader hears nothing for 3 s: start again as often as it takes.
    for _ in range(4):
        bench.driver.start(bench.now)
        try:
            bench.run(2.5)
        except DeviceTimeout:
            continue
        break
    assert bench.create.mode is Mode.FULL
    assert bench.latest.stamp > bench.now - 0.02


def test_a_first_frame_with_an_old_distance_is_left_out(base: Any) -> None:
    bench = Bench(base)
    base.rolled = (30.0, 30.0)  # pushed while nobody listened
    bench.run(1.5)
    assert bench.latest.odometry.pose.x == 0.0
    assert bench.driver.refused_readings == 0


def test_an_impossible_step_is_left_out_and_counted(base: Any) -> None:
    bench = ready(base)
    base.rolled = (5.0, 5.0)
    bench.run(0.1)
    assert bench.latest.odometry.pose.x == 0.0
    assert bench.driver.refused_readings == 1


def test_a_base_that_is_carried_follows_its_gyro(base: Any) -> None:
    bench = ready(base)
    bench.create.faults.wheel_drops = 12
    bench.run(0.1)
    before = bench.latest.gyro
    base.yaw_rate = lambda: 1.0
    bench.run(1.0)
    base.yaw_rate = lambda: 0.0
    bench.create.faults.wheel_drops = 0
    bench.run(2.0)
    assert before is not None
    assert bench.latest.gyro is not None
    assert bench.latest.gyro.offset == before.offset
    assert bench.latest.odometry.pose.yaw == pytest.approx(1.0, abs=0.03)


# -- lights, songs, docking ----------------------------------------------------------------------------------


def test_lights_and_songs(base: Any) -> None:
    bench = ready(base)
    bench.driver.set_leds(2, 255, 128)
    bench.driver.play_song([69, 0, 72], [0.5, 0.25, 1.0])
    bench.run(0.1)
    assert bench.create.leds == (2, 255, 128)
    assert bench.create.songs.playing


@pytest.mark.parametrize(
    ("notes", "durations", "why"),
    [
        ([60], [], "0 durations"),
        ([60], [4.0], "too long"),
        ([60], [float("nan")], "not a number"),
        ([], [], "16"),
    ],
)
def test_songs_that_cannot_be_played(base: Any, notes: list[int], durations: list[float], why: str) -> None:
    bench = ready(base)
    with pytest.raises(ConfigError, match=why):
        bench.driver.play_song(notes, durations)


def test_what_needs_a_drive_mode_is_refused_without_one(base: Any) -> None:
    bench = ready(base, operation_mode=1)
    for act in (
        lambda: bench.driver.set_leds(0, 0, 0),
        lambda: bench.driver.play_song([60], [1.0]),
        lambda: bench.driver.dock(bench.now),
    ):
        with pytest.raises(ConfigError, match="drive mode"):
            act()


def docking(base: Any, **how: Any) -> Any:
    bench = ready(base, **how)
    bench.driver.dock(bench.now)
    bench.run(0.5)
    assert bench.latest.stop_reason is StopReason.DOCKING
    assert bench.create.mode is Mode.PASSIVE
    assert base.wheels != (0.0, 0.0)
    return bench


def test_the_firmware_docks_and_charges(base: Any) -> None:
    bench = docking(base)
    bench.create.faults.dock = True
    bench.run(1.0)
    assert base.wheels == (0.0, 0.0)
    assert bench.latest.stop_reason is StopReason.MODE_LOST
    bench.run(4.0, Twist2(-0.1, 0.0))  # the way off the dock
    assert base.wheels == (-0.1, -0.1)


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("twist", [Twist2(0.0, 0.0), Twist2(0.2, 0.0)])
def test_any_velocity_command_ends_the_docking_at_once(base: Any, mode: int, twist: Twist2) -> None:
    bench = docking(base, operation_mode=mode)
    bench.driver.command(twist, bench.now)
    bench.run(0.05)
    assert base.wheels == (0.0, 0.0)
    bench.run(1.0, twist)
    assert bench.create.mode == mode
    assert bench.latest.stop_reason is None
    assert base.wheels == (twist.linear, twist.linear)


def test_the_end_of_the_driver_ends_the_docking(base: Any) -> None:
    bench = docking(base)
    bench.create.receive(bench.driver.shutdown(), bench.now)
    bench.create.poll(bench.now + 0.1)
    assert base.wheels == (0.0, 0.0)


def test_a_base_that_is_driven_or_held_does_not_dock(base: Any) -> None:
    bench = ready(base)
    bench.run(0.3, Twist2(0.2, 0.0))
    with pytest.raises(ConfigError, match="being driven"):
        bench.driver.dock(bench.now)
    bench.run(1.0)
    bench.create.faults.left_bumper = True
    bench.run(0.1)
    with pytest.raises(ConfigError, match="bumper"):
        bench.driver.dock(bench.now)
