"""Small parts of the base's driver: encoders, charging, gyro watch, raw gyro, joints, every diagnosis."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.sensing import Odometry
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.diagnosis import diagnose
from florence_bt.drivers.turtlebot.drive_control import CommandAcknowledgement
from florence_bt.drivers.turtlebot.driver import BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.gyro import Gyro, GyroParameters, GyroWatch
from florence_bt.drivers.turtlebot.hazards import (
    CHARGING_TIMEOUT_S,
    RESET_PAUSE_S,
    ChargeWatch,
    OvercurrentWatch,
    StopReason,
    contact,
    describe,
    hold_forward,
    needs_reset,
)
from florence_bt.drivers.turtlebot.odometry import JOINT_NAMES, EncoderTravel, WheelJoints, ticks_between
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters
from florence_bt.drivers.turtlebot.wheels import (
    STOPPED,
    WheelParameters,
    WheelSpeeds,
    arc_from_twist,
    wheels_one_by_one,
)

PLAIN = WheelParameters()


# -- encoders ------------------------------------------------------------------------------------------------


@given(st.integers(0, 65535), st.integers(-32768, 32767))
def test_ticks_across_the_wrap(before: int, ticks: int) -> None:
    assert ticks_between(before, (before + ticks) % 65536) == ticks


def test_travel_of_the_encoders() -> None:
    travel = EncoderTravel(0.000444565, 0.235)
    assert travel.update(65000, 100) == (0.0, 0.0)
    distance, angle = travel.update((65000 + 1000) % 65536, 1100)
    assert (distance, angle) == pytest.approx((0.444565, 0.0))
    distance, angle = travel.update(464, 1200)
    assert angle == pytest.approx(100 * 0.000444565 / 0.235)


def test_counters_that_begin_anew_are_no_motion() -> None:
    travel = EncoderTravel(0.000444565, 0.235)
    travel.update(1000, 65000)
    assert travel.update(0, 0) == (0.0, 0.0)  # the base was switched off and on
    assert travel.update(10, 10)[0] == pytest.approx(10 * 0.000444565)
    assert travel.update(0, 0)[0] == pytest.approx(-10 * 0.000444565)  # it rolled back


# -- waits, and whether the base obeys ---------------------------------------------------------------------


def test_command_acknowledgement() -> None:
    def said(left: int, right: int) -> SensorState:
        return SensorState(requested_left_velocity=left * 1e-3, requested_right_velocity=right * 1e-3)

    watch = CommandAcknowledgement()
    watch.look(said(7, 7), 0.0)  # nothing was sent: somebody else may have driven it
    for step in range(100):
        watch.sent(WheelSpeeds(step, -step), step / 50.0)
        watch.look(said(max(0, step - 3), -max(0, step - 3)), step / 50.0)  # it answers a little later
        assert not watch.unresponsive
    for step in range(100, 200):
        watch.sent(WheelSpeeds(0, 0), step / 50.0)
        watch.look(said(96, -96), step / 50.0)
        assert not watch.unresponsive or step > 190
    watch.look(said(96, -96), 4.1)
    assert watch.unresponsive
    watch.look(said(0, 0), 4.2)
    assert not watch.unresponsive


def test_a_firmware_that_rounds_obeys() -> None:
    watch = CommandAcknowledgement()
    for step in range(200):
        watch.sent(WheelSpeeds(204, -13), step / 50.0)
        watch.look(SensorState(requested_left_velocity=0.200, requested_right_velocity=-0.010), step / 50.0)
    assert not watch.unresponsive


# -- wheels --------------------------------------------------------------------------------------------------


def test_turtle_clamps_each_wheel() -> None:
    assert wheels_one_by_one(Twist2(0.5, 1.5), PLAIN) == WheelSpeeds(305, 500)


@given(st.floats(-1, 1), st.floats(-4, 4))
def test_arcs_are_what_the_command_can_say(linear: float, angular: float) -> None:
    velocity, radius = arc_from_twist(Twist2(linear, angular), PLAIN)
    assert abs(velocity) <= 500
    assert radius is None or radius in (-1, 1) or 2 <= abs(radius) <= 2000
    if radius is None:
        assert angular == 0.0


def test_arcs() -> None:
    assert arc_from_twist(Twist2(0.2, 0.5), PLAIN) == (200, 400)
    assert arc_from_twist(Twist2(-0.2, 0.5), PLAIN) == (-200, -400)
    assert arc_from_twist(Twist2(0.2, 0.01), PLAIN) == (200, 2000)
    assert arc_from_twist(Twist2(0.0, -1.0), PLAIN) == (130, -1)


# -- what holds the base -------------------------------------------------------------------------------------


def test_charger_dock_and_battery() -> None:
    def seen(**fields: int | bool) -> StopReason | None:
        state = SensorState(capacity=2700, **{"charge": 2000, **fields})  # type: ignore[arg-type]
        return contact(state, use_bumpers=True, use_cliffs=True, lowest_charge=0.02)

    assert seen(charging_sources_available=1) is StopReason.CHARGER
    assert seen(charging_sources_available=2) is StopReason.DOCK
    assert seen(charging_sources_available=2, cliff_left=True) is StopReason.DOCK
    assert seen(charging_sources_available=1, bumps_wheeldrops=4) is StopReason.WHEEL_DROP
    assert seen(charge=50) is StopReason.BATTERY
    assert seen(charge=54) is None
    assert contact(SensorState(charge=65_529, capacity=0), use_bumpers=True, use_cliffs=True) is None
    for reason in (StopReason.CHARGER, StopReason.BATTERY, StopReason.GYRO):
        assert hold_forward(WheelSpeeds(-100, 100), reason) == STOPPED
    assert hold_forward(WheelSpeeds(-100, -100), StopReason.DOCK) == WheelSpeeds(-100, -100)


@pytest.mark.parametrize(
    ("reason", "fields", "sentence"),
    [
        (StopReason.BUMPER, {"bumps_wheeldrops": 2}, "the left bumper is pressed: forward motion is held"),
        (
            StopReason.BUMPER,
            {"bumps_wheeldrops": 3},
            "the left bumper and the right bumper are pressed: forward motion is held",
        ),
        (
            StopReason.WHEEL_DROP,
            {"bumps_wheeldrops": 16},
            "the caster hangs in the air: put the base on the floor",
        ),
        (
            StopReason.CLIFF,
            {"cliff_front_right": True},
            "the front right cliff sensor misses the floor: forward motion is held",
        ),
        (
            StopReason.OVERCURRENT,
            {"motor_overcurrents": 8},
            "the right wheel draws too much current: see what blocks it",
        ),
        (StopReason.OVERCURRENT, {"motor_overcurrents": 0}, StopReason.OVERCURRENT.value),
        (StopReason.NO_RESPONSE, {}, StopReason.NO_RESPONSE.value),
    ],
)
def test_the_reason_names_the_sensor(reason: StopReason, fields: dict[str, int], sentence: str) -> None:
    assert describe(reason, SensorState(**fields)) == sentence  # type: ignore[arg-type]


def test_overcurrent_counts_when_it_lasts_and_holds_until_the_motor_has_rested() -> None:
    watch, blocked, free = OvercurrentWatch(), SensorState(motor_overcurrents=16), SensorState()
    assert not watch.look(blocked, 0.0)
    assert not watch.look(free, 0.4)
    assert not watch.look(blocked, 0.5)
    assert not watch.look(blocked, 0.9)
    assert watch.look(blocked, 1.0)
    assert watch.look(free, 1.9)
    assert not watch.look(free, 2.1)
    assert not watch.look(SensorState(motor_overcurrents=7), 3.0)  # the low side drivers are no wheels
    assert not watch.look(SensorState(motor_overcurrents=7), 4.0)
    assert not watch.look(blocked, -100.0)  # the clock was set back


@pytest.mark.parametrize(
    ("fields", "wanted"),
    [
        ({"charging_sources_available": 0}, False),
        ({}, True),
        ({"charging_state": 5}, True),
        ({"charging_state": 2}, False),
        ({"charge": 2520}, False),  # 0.93 of 2700 is 2511
        ({"oi_mode": 2}, False),
        ({"oi_mode": 3}, False),
        ({"oi_mode": 3, "charge": 400}, True),  # 0.15 of 2700 is 405
    ],
)
def test_charge_exits_of_the_old_node(fields: dict[str, int], wanted: bool) -> None:
    plain = {"charging_sources_available": 2, "oi_mode": 1, "charge": 2000, "capacity": 2700}
    assert needs_reset(SensorState(**{**plain, **fields})) is wanted  # type: ignore[arg-type]


def test_the_charge_watch_is_patient_and_does_not_nag() -> None:
    watch = ChargeWatch()
    low = SensorState(charging_sources_available=1, oi_mode=1, charge=100, capacity=2700)
    assert not watch.is_due(low, 0.0, standing=True)
    assert not watch.is_due(low, 5.0, standing=False)
    assert not watch.is_due(low, 6.0, standing=True)
    assert not watch.is_due(low, 5.9 + CHARGING_TIMEOUT_S, standing=True)
    assert watch.is_due(low, 6.0 + CHARGING_TIMEOUT_S, standing=True)
    assert not watch.is_due(low, 100.0, standing=True)
    assert watch.is_due(low, 6.0 + CHARGING_TIMEOUT_S + RESET_PAUSE_S, standing=True)


# -- gyro ----------------------------------------------------------------------------------------------------


def test_the_gyro_watch_looks_for_drift_in_straight_driving_only() -> None:
    def found(gyro: float, wheels: float, limit: float = 0.2, seconds: float = 3.1) -> bool:
        watch = GyroWatch(limit)
        return any(watch.disagrees(0.015 * n, gyro, 0.015 * wheels) for n in range(round(seconds / 0.015)))

    assert found(0.3, 0.0)
    assert found(-0.3, 0.05)
    assert not found(0.19, 0.0)
    assert not found(1.5, 1.0)  # a wrong scale is no drift
    assert not found(5.0, 0.0, limit=0.0)
    assert not found(0.5, 0.0, seconds=2.0)  # wheels that slip for a while
    assert found(3.5, 0.0, seconds=0.6)  # no power: nothing turns like that
    assert found(3.5, 0.3, seconds=0.6)
    assert found(3.5, -1.0, seconds=0.6)
    assert not found(3.9, 2.0, seconds=3.1)  # it may be the scale


def test_a_gap_begins_a_new_window() -> None:
    watch = GyroWatch(0.2)
    assert not any(watch.disagrees(0.3 * n, 1.0, 0.0) for n in range(20))


def test_raw_rate_keeps_the_first_offset_and_the_legacy_form_is_the_old_nodes() -> None:
    gyro = Gyro(GyroParameters(first_offset_after=1, settle_s=0.0, rest_samples=2))
    gyro.update(0.0, 512, True)
    for number in range(1, 4):
        gyro.update(number * 0.1, 514, True)
    reading = gyro.update(0.4, 500, False)
    assert reading is not None
    assert reading.offset == 514.0
    assert math.degrees(reading.rate) == pytest.approx(14 / 514 * 150 * 1.35)
    assert math.degrees(reading.raw_rate) == pytest.approx(12 / 512 * 150 * 1.35)
    assert reading.legacy_raw_rate == pytest.approx(-(500 / 150) * math.radians(1) * 1.35)
    assert reading.legacy_raw_yaw == pytest.approx(
        reading.yaw - 0.1 * reading.rate + 0.1 * reading.legacy_raw_rate
    )


def test_rest_offset_follows_a_jump_at_once() -> None:
    gyro = Gyro(GyroParameters(first_offset_after=10, settle_s=0.0))
    for number in range(500):
        gyro.update(number * 0.015, 512, True)
    for number in range(500, 520):
        gyro.update(number * 0.015, 530, True)
    assert gyro.offset == pytest.approx(530, abs=4)


def test_an_unpowered_gyro_gives_no_reading() -> None:
    gyro = Gyro(GyroParameters(first_offset_after=1, settle_s=0.0))
    assert gyro.update(0.0, 40, True) is None
    assert gyro.calibrated
    assert gyro.offset == 40.0


# -- joints --------------------------------------------------------------------------------------------------


def test_wheel_joints() -> None:
    joints = WheelJoints(0.033, 0.26)
    joints.add(SensorState(distance=0.033, angle=0.0))
    joints.add(SensorState(distance=0.0, angle=0.1))
    assert joints.positions == pytest.approx([1.0 - 0.013 / 0.033, 1.0 + 0.013 / 0.033, 0.0, 0.0])
    assert joints.velocities(0.2, 0.5) == pytest.approx([0.135 / 0.033, 0.265 / 0.033, 0.0, 0.0])
    assert len(JOINT_NAMES) == 4


# -- diagnostics ---------------------------------------------------------------------------------------------


def judged(name: str, driver: TurtlebotDriver | None = None, **fields: int | bool) -> tuple[Severity, str]:
    plain = {"oi_mode": 3, "charge": 2000, "capacity": 2700, "voltage": 15_000}
    state = SensorState(**{**plain, **fields})  # type: ignore[arg-type]
    reading = BaseReading(0.0, state, Odometry(0.0, Pose2()), None, True, None)
    found = diagnose(driver or TurtlebotDriver(), reading, "/dev/ttyUSB0", "")[name]
    return found.level, found.message


def test_every_line_of_the_reference() -> None:
    ok = (Severity.OK, "OK")
    assert [judged("Charging Sources", charging_sources_available=n) for n in range(3)] == [
        (Severity.OK, "None"),
        (Severity.OK, "Internal Charger"),
        (Severity.OK, "Base Dock"),
    ]
    assert judged("Charging Sources", charging_sources_available=3)[0] is Severity.ERROR
    assert judged("Cliff Sensor") == ok
    assert judged("Cliff Sensor", cliff_right=True) == (Severity.WARN, "near a cliff")
    assert judged("Cliff Sensor", cliff_right=True, current=500)[0] is Severity.OK
    assert judged("Wall Sensor") == ok
    assert judged("Wall Sensor", wall=True)[0] is Severity.ERROR
    assert judged("Battery", charge=400)[0] is Severity.WARN
    assert judged("Battery", charge=400, current=1000) == ok
    assert judged("Digital Outputs", user_digital_outputs=5) == ok


def test_values_stand_under_the_right_names() -> None:
    state = SensorState(cliff_right_signal=7, cliff_front_right_signal=8, user_digital_outputs=1)
    reading = BaseReading(0.0, state, Odometry(0.0, Pose2()), None, True, None)
    found = diagnose(TurtlebotDriver(), reading, "", "")
    assert found["Cliff Sensor"].values["Right Signal"] == "7"
    assert found["Cliff Sensor"].values["Front Right Signal"] == "8"
    outputs = found["Digital Outputs"].values
    assert outputs == {
        "Raw Byte": "1",
        "Digital Out 2": "OFF",
        "Digital Out 1": "OFF",
        "Digital Out 0": "ON",
    }


@pytest.mark.parametrize(
    ("counts", "level", "text"),
    [
        (512, Severity.OK, "OK"),
        (40, Severity.ERROR, "power"),
        (600, Severity.ERROR, "bad"),
        (0, Severity.ERROR, "no signal"),
    ],
)
def test_health_of_the_gyro(counts: int, level: Severity, text: str) -> None:
    driver = TurtlebotDriver()
    assert driver.gyro is not None
    for number in range(100):
        driver.gyro.update(number * 0.015, counts, True)
    found = judged("Gyro Sensor", driver)
    assert found[0] is level
    assert text in found[1]
    assert judged("Gyro Sensor", TurtlebotDriver(TurtlebotParameters(has_gyro=False)))[0] is Severity.WARN


@pytest.mark.parametrize(
    "wrong",
    [
        {"robot_type": "creat"},
        {"lowest_charge": 0.6},
        {"max_gyro_disagreement": -1.0},
        {"oi_mode_offset": 300},
    ],
)
def test_wrong_parameters_are_named(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        TurtlebotParameters(**wrong)  # type: ignore[arg-type]


def test_the_base_has_its_own_wheels_unless_told() -> None:
    assert TurtlebotParameters(robot_type="roomba").wheels().wheel_separation == 0.235
    assert TurtlebotParameters(robot_type="roomba", wheel_separation=0.24).wheels().wheel_separation == 0.24
