"""What the base says about its battery that cannot be true is not known, and counts as empty."""

import math

import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import Odometry
from florence_bt.drivers.turtlebot.battery import battery_of, is_full
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.diagnosis import REFUSED, diagnose
from florence_bt.drivers.turtlebot.driver import BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.gyro import Gyro, GyroParameters
from florence_bt.drivers.turtlebot.hazards import StopReason, contact, describe, needs_reset
from florence_bt.drivers.turtlebot.parameters import TurtlebotParameters

PLAIN = {
    "voltage": 15_000,
    "current": -400,
    "temperature": 25,
    "charge": 2000,
    "capacity": 2696,
    "oi_mode": 3,
}
LOWEST = TurtlebotParameters().lowest_charge


def state(**fields: int) -> SensorState:
    return SensorState(**{**PLAIN, **fields})  # type: ignore[arg-type]


def held(seen: SensorState, lowest_charge: float = LOWEST) -> StopReason | None:
    return contact(seen, use_bumpers=True, use_cliffs=True, lowest_charge=lowest_charge)


def diagnosed(seen: SensorState, driver: TurtlebotDriver | None = None, stamp: float = 0.0):
    reading = BaseReading(stamp, seen, Odometry(stamp, Pose2()), None, True, None)
    return diagnose(driver or TurtlebotDriver(), reading, "/dev/ttyUSB0", "")


def test_a_plain_battery_is_believed() -> None:
    battery = battery_of(state())
    assert battery.fraction == pytest.approx(2000 / 2696) and battery.doubts == ()
    assert battery_of(state(charge=2800)).fraction == 1.0, "the capacity is an estimate"
    assert is_full(state(charge=2696, charging_state=3))
    assert held(state()) is None and diagnosed(state())["Battery"].level is Severity.OK


@pytest.mark.parametrize(
    "fields",
    [
        {"charge": 65_529},  # a counter that wrapped below zero
        {"charge": 65_535, "capacity": 65_535},
        {"charge": 5_000},
        {"charge": 0, "capacity": 0},
        {"capacity": 60_000},
    ],
)
def test_a_charge_that_cannot_be_is_not_known_and_holds_the_base(fields: dict[str, int]) -> None:
    seen = state(**fields)
    assert battery_of(seen).fraction is None
    assert held(seen) is StopReason.BATTERY
    assert held(seen, lowest_charge=0.0) is None, "who sets it to 0 wants to drive"
    assert "not known" in describe(StopReason.BATTERY, seen)
    assert "not known" not in describe(StopReason.BATTERY, state(charge=0))
    assert diagnosed(seen)["Battery"].level is Severity.WARN
    assert not is_full(state(charging_state=3, **fields))
    assert needs_reset(state(charging_sources_available=2, oi_mode=1, **fields))


@pytest.mark.parametrize(
    ("field", "wrong"),
    [("voltage", 0), ("voltage", 65_535), ("current", 32_767), ("current", -32_768), ("temperature", -128)],
)
def test_other_numbers_of_a_battery_are_not_known_each_by_itself(field: str, wrong: int) -> None:
    battery = battery_of(state(**{field: wrong}))
    values = {
        "voltage": battery.voltage_v,
        "current": battery.current_a,
        "temperature": battery.temperature_c,
    }
    assert [name for name, value in values.items() if value is None] == [field]
    assert battery.fraction is not None and held(state(**{field: wrong})) is None
    found = diagnosed(state(**{field: wrong}))["Battery"]
    assert found.level is Severity.WARN and field in found.message


def test_a_count_that_the_manual_does_not_know_is_told() -> None:
    driver = TurtlebotDriver()
    driver.implausible = {"wall_signal": 5000}
    found = diagnosed(state(wall_signal=5000), driver)["TurtleBot Node"]
    assert found.level is Severity.WARN and "wall_signal 5000" in found.message


def test_a_refused_way_is_told_for_a_while() -> None:
    driver = TurtlebotDriver()
    driver.refused_at = 100.0
    assert diagnosed(state(), driver, 101.0)["TurtleBot Node"].message == REFUSED
    assert diagnosed(state(), driver, 1000.0)["TurtleBot Node"].message != REFUSED


def test_a_gyro_has_no_more_counts_than_1023() -> None:
    gyro = Gyro(GyroParameters(first_offset_after=1, settle_s=0.0))
    for number in range(5):
        gyro.update(number * 0.1, 512, True)
    before = gyro.update(0.5, 512, False)
    assert gyro.update(0.6, 40_000, False) is None
    after = gyro.update(0.7, 512, False)
    assert before is not None and after is not None and after.yaw == before.yaw
    assert math.isfinite(after.rate) and gyro.offset == 512.0
