"""The base's judgements at their limits: fractions, gyro, acknowledgement, charging, what is diagnosed."""

from __future__ import annotations

import math

import pytest

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.sensing import Odometry
from florence_bt.drivers.turtlebot import diagnosis, fractions, gyro
from florence_bt.drivers.turtlebot.battery import battery_of
from florence_bt.drivers.turtlebot.codec.models import CREATE, CREATE_2
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.drive_control import ACKNOWLEDGEMENT_TIMEOUT_S, CommandAcknowledgement
from florence_bt.drivers.turtlebot.driver import LET_GO_S, BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.fractions import (
    READING_S,
    DistanceEvidence,
    FractionWatch,
    TurnEvidence,
    most_likely,
)
from florence_bt.drivers.turtlebot.gyro import GyroParameters, GyroWatch, RestOffset, rate_from_adc
from florence_bt.drivers.turtlebot.hazards import (
    CHARGING_TIMEOUT_S,
    OVERCURRENT_REST_S,
    OVERCURRENT_TIMEOUT_S,
    RESET_PAUSE_S,
    ChargeWatch,
    OvercurrentWatch,
    StopReason,
    hold_forward,
)
from florence_bt.drivers.turtlebot.odometry import (
    LONGEST_GYRO_STEP_S,
    MOST_TICKS_TO_ZERO,
    EncoderTravel,
    WheelOdometry,
)
from florence_bt.drivers.turtlebot.wheels import STOPPED, WheelSpeeds

# ---- fractions that are dropped ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("counted", "commanded", "likely"),
    [
        (3.0, 3.4, 3.4),
        (3.0, 4.7, 4.0),
        (3.0, 2.9, 3.0),
        (-3.0, -3.4, -3.4),
        (-3.0, -4.7, -4.0),
        (-3.0, -2.0, -3.0),
        (0.0, 0.6, 0.6),
        (0.0, -0.6, -0.6),
        (0.0, 5.0, 1.0),
        (0.0, -5.0, -1.0),
    ],
)
def test_what_was_driven_lies_within_a_unit_of_the_count(
    counted: float, commanded: float, likely: float
) -> None:
    assert most_likely(counted, commanded) == pytest.approx(likely)


def drive(evidence: DistanceEvidence, speed: float, share: float, metres: float) -> list[bool | None]:
    """Drive at a speed (mm/s) of which a share is counted; what was found at each reading."""
    step = speed * READING_S
    return [evidence.look(step * share, speed) for _ in range(math.ceil(1000.0 * metres / abs(step)))]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_base_that_counts_a_little_less_than_a_metre_a_metre_drops_fractions(sign: float) -> None:
    found = drive(DistanceEvidence(), sign * 300.0, 0.9, 1.3)
    assert found[-1] is None and found.count(True) == 1 and False not in found
    assert found.index(True) == pytest.approx((1000.0 + 300.0 * 0.3) / (300.0 * READING_S), abs=3)


def test_a_base_that_counts_all_is_whole_after_three_times_the_way() -> None:
    found = drive(DistanceEvidence(), 300.0, 0.99, 3.3)
    assert found.count(False) == 1 and True not in found
    assert found.index(False) * 300.0 * READING_S == pytest.approx(3000.0 + 90.0, abs=20.0)


@pytest.mark.parametrize("share", [0.0, 0.4, 0.955])
def test_a_base_that_is_blocked_or_not_clear_is_judged_neither_way(share: float) -> None:
    assert set(drive(DistanceEvidence(), 300.0, share, 9.0)) == {None}


def test_what_is_not_clear_is_forgotten_after_ten_metres() -> None:
    evidence = DistanceEvidence()
    drive(evidence, 300.0, 0.0, 9.5)
    assert True not in drive(evidence, 300.0, 0.9, 1.5)
    assert True in drive(evidence, 300.0, 0.9, 1.5), "without what was blocked before"


@pytest.mark.parametrize("speed", [0.0, 66.0])
def test_a_step_of_less_than_a_millimetre_says_nothing(speed: float) -> None:
    evidence = DistanceEvidence()
    assert {evidence.look(0.0, speed) for _ in range(3000)} == {None}


def test_only_steady_speeds_count() -> None:
    evidence = DistanceEvidence()
    for number in range(2000):
        speed = 250.0 if number // 15 % 2 else 350.0
        assert evidence.look(0.9 * speed * READING_S, speed) is None
    assert True in [evidence.look(0.9 * 300.0 * READING_S, 300.0 + number % 2) for number in range(400)]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("counts", "found"), [(0.0, True), (0.25, True), (0.45, None), (0.65, False), (1.0, False)]
)
def test_a_slow_turn_tells_by_the_gyro_what_is_counted(
    sign: float, counts: float, found: bool | None
) -> None:
    evidence = TurnEvidence()
    rate = sign * 30.0
    readings = math.ceil(fractions.LEAST_DEG / (30.0 * READING_S))
    said = [evidence.look(counts * rate * READING_S, rate, rate) for _ in range(readings + 1)]
    assert [each for each in said if each is not None] == ([] if found is None else [found])
    assert said[0] is None


@pytest.mark.parametrize(
    ("rate", "turned"), [(61.0, 61.0), (30.0, 61.0), (30.0, 14.0), (20.0, 41.0), (0.0, 10.0)]
)
def test_turns_that_are_fast_or_that_the_gyro_contradicts_tell_nothing(rate: float, turned: float) -> None:
    evidence = TurnEvidence()
    assert {evidence.look(0.0, rate, turned) for _ in range(500)} == {None}


@pytest.mark.parametrize(("rate", "turned"), [(59.0, 59.0), (30.0, 16.0), (20.0, 39.0)])
def test_a_gyro_whose_scale_is_wrong_still_tells(rate: float, turned: float) -> None:
    evidence = TurnEvidence()
    assert True in [evidence.look(0.0, rate, turned) for _ in range(500)]


def test_counts_are_corrected_only_of_a_base_that_drops_fractions_and_over_short_gaps() -> None:
    watch = FractionWatch()
    speed = (300.0, 20.0)
    assert watch.corrected(0.0, 4.0, 0.0, speed) == (4.0, 0.0)
    assert watch.corrected(0.015, 4.0, 0.0, speed) == (4.0, 0.0), "it keeps what it does not report"
    for _ in range(400):
        watch.look(4.0, 0.0, speed, None)
    assert watch.drops
    assert watch.corrected(0.030, 4.0, 0.0, speed) == pytest.approx((4.5, 0.3))
    gap = 0.030 + fractions.LONGEST_STEP_S + 0.001
    assert watch.corrected(gap, 4.0, 0.0, speed) == (4.0, 0.0)
    assert watch.corrected(gap - 1.0, 4.0, 0.0, speed) == (4.0, 0.0), "the clock was set back"
    assert watch.corrected(gap - 1.0 + 0.015, 4.0, 0.0, speed) == pytest.approx((4.5, 0.3))
    fresh = FractionWatch()
    fresh.drops = True
    assert fresh.corrected(5.0, 4.0, 0.0, speed) == (4.0, 0.0), "nothing is known before the first"


def test_a_turn_is_judged_by_the_gyro_when_the_way_says_nothing() -> None:
    for gyro_degps, drops in ((30.0, True), (None, False)):
        watch = FractionWatch()
        for _ in range(60):
            watch.look(0.0, 0.0, (0.0, 30.0), gyro_degps)
        assert watch.drops is drops
    watch = FractionWatch()
    for number in range(60):
        if number % 20 == 0:
            watch.clear()
        watch.look(0.0, 0.0, (0.0, 30.0), 30.0)
    assert not watch.drops, "something else held the base meanwhile"


# ---- gyro ----------------------------------------------------------------------------------------------


def test_a_turn_to_the_left_lowers_the_reading() -> None:
    parameters = GyroParameters(measurement_range_degps=150.0, scale_correction=1.35)
    assert rate_from_adc(450.0, 500.0, parameters) == pytest.approx(0.1 * math.radians(150.0) * 1.35)
    assert rate_from_adc(550.0, 500.0, parameters) == pytest.approx(-0.1 * math.radians(150.0) * 1.35)


def test_the_offset_is_the_mean_of_the_newest_samples_at_rest() -> None:
    rest = RestOffset(GyroParameters(rest_samples=6, first_offset_after=4, settle_s=0.5, drift_counts=4.0))
    for number in range(5):
        rest.update(0.1 * number, 900, True)
        assert not rest.resting
    for number, adc in enumerate((500, 501, 502)):
        rest.update(0.5 + 0.1 * number, adc, True)
        assert rest.resting and rest.value() is None and rest.samples == number + 1
    rest.update(0.8, 503, True)
    assert rest.value() == 501.5
    for number, adc in enumerate((503, 503, 503)):
        rest.update(0.9 + 0.1 * number, adc, True)
    assert (rest.samples, rest.value()) == (6, pytest.approx((501 + 502 + 4 * 503) / 6))
    rest.update(1.3, 600, False)
    assert not rest.resting and rest.samples == 6, "moving adds nothing"
    rest.forget()
    assert (rest.samples, rest.value()) == (0, None)


def test_a_drift_of_more_than_so_many_counts_is_followed_at_once() -> None:
    for moved, followed in ((4, False), (14, True)):
        rest = RestOffset(GyroParameters(rest_samples=100, first_offset_after=4, settle_s=0.0))
        for number in range(20):
            rest.update(0.1 * number, 500, True)
        for number in range(4):
            rest.update(2.0 + 0.1 * number, 500 + moved, True)
        assert (rest.samples < 24) is followed
        if followed:
            assert rest.value() == pytest.approx(500 + moved, abs=0.75 * moved)


def watched(
    watch: GyroWatch, seconds: float, gyro_radps: float, wheels_radps: float, step_s: float = 0.1
) -> bool:
    count = round(seconds / step_s)
    return any(
        watch.disagrees(step_s * number, gyro_radps, wheels_radps * step_s) for number in range(count + 1)
    )


@pytest.mark.parametrize(
    ("gyro_radps", "wheels_radps", "disagrees"),
    [(0.25, 0.0, True), (0.15, 0.0, False), (0.35, 0.08, True), (0.4, 0.12, False), (-0.25, 0.0, True)],
)
def test_a_gyro_may_differ_by_its_limit_in_straight_driving(
    gyro_radps: float, wheels_radps: float, disagrees: bool
) -> None:
    assert watched(GyroWatch(0.2), 3.5, gyro_radps, wheels_radps) is disagrees
    assert not watched(GyroWatch(0.2), 0.85 * gyro.WATCH_WINDOW_S, gyro_radps, wheels_radps), "too short"
    assert not watched(GyroWatch(0.0), 3.5, gyro_radps, wheels_radps), "0 is any difference"


@pytest.mark.parametrize(
    ("gyro_radps", "wheels_radps", "disagrees"),
    [(2.2, 0.0, True), (1.9, 0.0, False), (6.0, 2.4, True), (4.5, 2.4, False), (-2.0, 2.2, True)],
)
def test_a_gyro_that_is_far_off_is_broken_at_once(
    gyro_radps: float, wheels_radps: float, disagrees: bool
) -> None:
    assert watched(GyroWatch(0.2), 0.6, gyro_radps, wheels_radps) is disagrees
    assert not watched(GyroWatch(0.2), 0.4, gyro_radps, wheels_radps)


# ---- overcurrent, charging, acknowledgement ------------------------------------------------------------


def test_overcurrent_of_half_a_second_blocks_until_the_motor_has_rested_a_second() -> None:
    watch, blocked, free = OvercurrentWatch(), SensorState(motor_overcurrents=8), SensorState()
    assert not watch.look(blocked, 10.0)
    assert not watch.look(blocked, 10.0 + OVERCURRENT_TIMEOUT_S - 0.01)
    assert watch.look(blocked, 10.0 + OVERCURRENT_TIMEOUT_S)
    assert watch.look(free, 10.5 + OVERCURRENT_REST_S - 0.01)
    assert not watch.look(free, 10.5 + OVERCURRENT_REST_S)
    assert not watch.look(blocked, 12.0), "it counts anew"
    assert not watch.look(blocked, 11.7), "the clock was set back"
    assert not watch.look(blocked, 12.1) and watch.look(blocked, 12.2)
    assert not OvercurrentWatch().look(SensorState(motor_overcurrents=1), 0.0), "a brush is no wheel"


def test_a_base_is_reset_after_ten_seconds_and_not_again_for_five_minutes() -> None:
    state = SensorState(
        charging_sources_available=2, oi_mode=1, charge=1000, capacity=2700, voltage=15000, temperature=20
    )
    watch = ChargeWatch()
    due = [n for n in range(700) if watch.is_due(state, float(n), standing=True)]
    assert due == [round(CHARGING_TIMEOUT_S), round(CHARGING_TIMEOUT_S + RESET_PAUSE_S), 610]
    assert not watch.is_due(state, 1000.0, standing=False)
    assert not watch.is_due(state, 1001.0, standing=True), "it has to stand there again first"
    assert watch.is_due(state, 1011.0, standing=True)


def test_a_base_that_does_not_acknowledge_for_a_second_is_unresponsive() -> None:
    def said(speed: int) -> SensorState:
        return SensorState(requested_left_velocity=speed / 1000, requested_right_velocity=speed / 1000)

    for near, far in ((10, 11), (-10, -11)):
        watch = CommandAcknowledgement()
        watch.sent(WheelSpeeds(100, 100), 0.0)
        watch.look(said(100 + far), 0.0)
        watch.look(said(100 + far), ACKNOWLEDGEMENT_TIMEOUT_S)
        assert not watch.unresponsive
        watch.look(said(100 + far), ACKNOWLEDGEMENT_TIMEOUT_S + 0.01)
        assert watch.unresponsive
        watch.look(said(100 + near), 1.1)
        assert not watch.unresponsive
    watch.look(said(0), 1.2)
    watch.clear()
    watch.look(said(0), 9.0)
    watch.look(said(0), 19.0)
    assert not watch.unresponsive, "nothing was sent since"


def test_speeds_of_up_to_a_second_ago_are_acknowledged_too() -> None:
    watch = CommandAcknowledgement()
    old = SensorState(requested_left_velocity=0.1, requested_right_velocity=0.1)
    watch.sent(WheelSpeeds(100, 100), 0.0)
    watch.sent(WheelSpeeds(300, 300), 5.0)
    watch.sent(WheelSpeeds(300, 300), 5.9)
    watch.look(old, 5.9)
    watch.look(old, 6.0)
    watch.sent(WheelSpeeds(300, 300), 6.1)
    watch.look(old, 6.1)
    watch.look(old, 7.2)
    assert watch.unresponsive


@pytest.mark.parametrize("reason", list(StopReason))
def test_what_holds_all_holds_the_way_back_too(reason: StopReason) -> None:
    ahead, back, turn = WheelSpeeds(100, 100), WheelSpeeds(-100, -100), WheelSpeeds(-100, 100)
    assert hold_forward(ahead, None) == ahead
    assert hold_forward(ahead, reason) == STOPPED
    everything = {"CHARGER", "BATTERY", "GYRO", "OVERCURRENT", "NO_RESPONSE"}
    for allowed in (back, turn):
        assert hold_forward(allowed, reason) == (STOPPED if reason.name in everything else allowed)
    assert reason.code == reason.name.lower()


def test_a_hand_has_to_let_go_after_a_stop() -> None:
    driver, forward = TurtlebotDriver(), Twist2(0.1, 0.0)
    driver.set_manual_override(True, 0.0)
    driver.command(forward, 0.0, manual=True)
    assert driver.driven_by_hand(0.0), "a hand that was silent before begins anew"
    driver.set_manual_override(True, 0.1)
    for now in (0.2, 0.2 + LET_GO_S, 1.3):
        driver.command(forward, now, manual=True)
        assert not driver.driven_by_hand(now), "it has held the key all along"
    driver.command(forward, 1.3 + LET_GO_S + 0.01, manual=True)
    assert driver.driven_by_hand(2.31)
    driver.set_manual_override(True, 2.4)
    driver.command(Twist2(0.0, 0.0), 2.5, manual=True)
    driver.command(forward, 2.6, manual=True)
    assert driver.driven_by_hand(2.6), "a zero lets go"
    driver.command(Twist2(0.2, 0.0), 2.7)
    assert driver.driven_by_hand(2.7), "a mission's command is not the hand's"
    driver.set_manual_override(False, 2.8)
    assert not driver.driven_by_hand(2.8)


# ---- odometry ------------------------------------------------------------------------------------------


def test_over_a_longer_gap_the_wheels_tell_the_turn() -> None:
    for gap, yaw in ((LONGEST_GYRO_STEP_S, 0.25 * 0.4), (LONGEST_GYRO_STEP_S + 0.01, 0.3)):
        odometry = WheelOdometry()
        odometry.update(0.0, 0.0, 0.0)
        assert odometry.update(gap, 0.0, 0.3, 0.4).pose.yaw == pytest.approx(yaw)


def test_two_wheels_that_come_to_zero_from_afar_did_not_roll_there() -> None:
    for ticks, rolled in ((MOST_TICKS_TO_ZERO, True), (MOST_TICKS_TO_ZERO + 1, False)):
        travel = EncoderTravel(0.001, 0.2)
        travel.update(ticks, 0)
        distance, angle = travel.update(0, 0)
        assert (distance, angle) == pytest.approx((-0.0005 * ticks, 0.005 * ticks) if rolled else (0.0, 0.0))


def test_groups_of_packets_are_those_of_the_manual() -> None:
    """REFERENCE 1.5: the first packet and the last one of each group."""
    ends = {number: (group[0], group[-1]) for number, group in CREATE_2.groups.items()}
    common = {0: (7, 26), 1: (7, 16), 2: (17, 20), 3: (21, 26), 4: (27, 34), 5: (35, 42), 6: (7, 42)}
    assert {number: (group[0], group[-1]) for number, group in CREATE.groups.items()} == common
    assert ends == common | {100: (7, 58), 101: (43, 58), 106: (46, 51), 107: (54, 58)}
    for model, last, baud_rate in ((CREATE, 42, 57600), (CREATE_2, 58, 115200)):
        assert (model.packets[0], model.packets[-1], model.baud_rate) == (7, last, baud_rate)


# ---- what is diagnosed ---------------------------------------------------------------------------------

WELL: dict[str, int] = {
    "voltage": 15_000,
    "current": -400,
    "temperature": 25,
    "charge": 2000,
    "capacity": 2696,
    "oi_mode": 3,
}


def diagnosed(
    stamp: float = 1000.0, driver: TurtlebotDriver | None = None, **fields: int
) -> dict[str, Diagnosis]:
    state = SensorState(**(WELL | fields))  # type: ignore[arg-type]
    reading = BaseReading(stamp, state, Odometry(stamp, Pose2()), None, True, None)
    return diagnosis.diagnose(driver or TurtlebotDriver(), reading, "/dev/ttyUSB0", "")


def test_each_cliff_sensor_is_told_with_its_signal() -> None:
    found = diagnosed(
        cliff_left=True,
        cliff_left_signal=1,
        cliff_front_left_signal=2,
        cliff_front_right=True,
        cliff_front_right_signal=3,
        cliff_right_signal=4,
    )["Cliff Sensor"]
    assert found.values == {
        "Left": "True", "Left Signal": "1", "Front Left": "False",
        "Front Left Signal": "2", "Front Right": "True", "Front Right Signal": "3", "Right": "False",
        "Right Signal": "4",
    }  # fmt: skip
    assert (found.level, found.message) == (Severity.WARN, "near a cliff")
    charging = diagnosed(cliff_right=True, current=1)["Cliff Sensor"]
    assert charging.level is Severity.OK and "plate of the dock" in charging.message
    assert diagnosed(cliff_right=True, current=0)["Cliff Sensor"].level is Severity.WARN


def test_the_battery_is_told_in_volts_amperes_and_ampere_hours() -> None:
    found = diagnosed(voltage=15_123, current=-456)["Battery"]
    assert found.values == {
        "Voltage (V)": "15.123",
        "Current (A)": "-0.456",
        "Temperature (C)": "25",
        "Charge (Ah)": "2.000",
        "Capacity (Ah)": "2.696",
    }
    battery = battery_of(SensorState(**(WELL | {"voltage": 15_123, "current": -456})))  # type: ignore[arg-type]
    assert (battery.voltage_v, battery.current_a, battery.charge_ah, battery.capacity_ah) == (
        15.123,
        -0.456,
        2.0,
        2.696,
    )


@pytest.mark.parametrize(
    ("fields", "level", "message"),
    [
        ({"charge": 150, "capacity": 1000, "current": -1}, Severity.OK, "OK"),
        ({"charge": 149, "capacity": 1000, "current": -1}, Severity.WARN, "the battery is low"),
        ({"charge": 149, "capacity": 1000, "current": 0}, Severity.WARN, "the battery is low"),
        ({"charge": 149, "capacity": 1000, "current": 1}, Severity.OK, "OK"),
        ({"charging_state": 5}, Severity.ERROR, "charging fault"),
        ({"charge": 1101, "capacity": 1000}, Severity.WARN, "the base says 1.101 Ah of 1 for the charge"),
        ({"charge": 1100, "capacity": 1000}, Severity.OK, "OK"),
        ({"capacity": 10_001}, Severity.WARN, "the base says 10.001 Ah for the capacity"),
        ({"capacity": 10_000}, Severity.OK, "OK"),
        ({"voltage": 5_999}, Severity.WARN, "the base says 5.999 V for the voltage"),
        ({"voltage": 6_000}, Severity.OK, "OK"),
        ({"voltage": 22_000}, Severity.OK, "OK"),
        ({"voltage": 22_001}, Severity.WARN, "22.001 V"),
        ({"current": -10_001}, Severity.WARN, "-10.001 A for the current"),
        ({"current": -10_000}, Severity.OK, "OK"),
        ({"temperature": -31}, Severity.WARN, "-31 C for the temperature"),
        ({"temperature": -30}, Severity.OK, "OK"),
        ({"temperature": 90}, Severity.OK, "OK"),
        ({"temperature": 91}, Severity.WARN, "91 C"),
    ],
)
def test_the_battery_at_its_limits(fields: dict[str, int], level: Severity, message: str) -> None:
    found = diagnosed(**fields)["Battery"]
    assert found.level is level and message in found.message


@pytest.mark.parametrize(
    ("sources", "level", "message"),
    [
        (0, Severity.OK, "None"),
        (1, Severity.OK, "Internal Charger"),
        (2, Severity.OK, "Base Dock"),
        (3, Severity.ERROR, "Internal Charger and Base Dock at once"),
        (4, Severity.ERROR, "unknown sources 4"),
    ],
)
def test_charging_sources(sources: int, level: Severity, message: str) -> None:
    found = diagnosed(charging_sources_available=sources, charging_state=3)["Charging Sources"]
    assert (found.level, found.message) == (level, message)
    assert found.values == {"Charging State": "Trickle Charging"}
    assert diagnosed(charging_state=5)["Charging Sources"].values == {"Charging State": "Fault"}
    assert diagnosed(charging_state=6)["Charging Sources"].values == {"Charging State": "unknown state 6"}


@pytest.mark.parametrize("after", [0.0, diagnosis.REFUSED_S - 0.1, diagnosis.REFUSED_S])
def test_a_refused_reading_is_told_for_a_minute(after: float) -> None:
    driver = TurtlebotDriver()
    driver.refused_at = 1000.0
    found = diagnosed(1000.0 + after, driver)["TurtleBot Node"]
    assert (found.message == diagnosis.REFUSED) is (after < 60.0)


@pytest.mark.parametrize(("bits", "on"), [(0, ""), (1, "0"), (2, "1"), (4, "2"), (5, "02"), (7, "012")])
def test_digital_outputs_by_their_numbers(bits: int, on: str) -> None:
    found = diagnosed(user_digital_outputs=bits)["Digital Outputs"]
    assert found.values == {"Raw Byte": str(bits)} | {
        f"Digital Out {place}": "ON" if str(place) in on else "OFF" for place in range(3)
    }


def test_the_operating_mode_by_name() -> None:
    for code, name, level in (
        (1, "Passive", Severity.OK),
        (2, "Safe", Severity.OK),
        (3, "Full", Severity.OK),
        (0, "unknown mode 0", Severity.ERROR),
        (4, "unknown mode 4", Severity.ERROR),
    ):
        found = diagnosed(oi_mode=code)["Operating Mode"]
        assert (found.values["Mode"], found.level) == (name, level)
        assert found.values["Wanted Mode"] == "Full"
    assert diagnosed(wall=True)["Wall Sensor"].level is Severity.ERROR
    assert diagnosed(wall=False, virtual_wall=True)["Wall Sensor"].level is Severity.OK
