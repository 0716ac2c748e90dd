"""From reports of home sensors to the user's room; stale, stuck and contradicting sensors."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.diagnosis import Severity
from florence_bt.skills.home_sensors.home_sensors import (
    CONTRADICTION_S,
    HOLD_S,
    PRESS_S,
    SENSOR_AHEAD_S,
    BadReport,
    HomeSensors,
    Report,
    SensedRoom,
)
from florence_bt.skills.home_sensors.settings import HomeSensor, SensorKind

STALE, STUCK = 3600.0, 1800.0
SENSORS = {
    "kitchen_pir": HomeSensor("kitchen"),
    "hall_pir": HomeSensor("hall"),
    "hall_pir_2": HomeSensor("hall"),
    "door": HomeSensor("hall", SensorKind.DEVICE),
    "tv": HomeSensor("living_room", SensorKind.DEVICE),
    "button": HomeSensor("bedroom", SensorKind.BUTTON),
}


class House:
    """Sensors that report at given moments."""

    def __init__(self) -> None:
        self.sensors = HomeSensors(SENSORS, 0.0)

    def says(self, sensor: str, active: bool, now: float) -> SensedRoom | None:
        return self.late(sensor, active, now, now)

    def late(self, sensor: str, active: bool, at: float | None, now: float) -> SensedRoom | None:
        self.sensors.take(Report(sensor, active, at), now)
        return self.sensors.locate(now)

    def room(self, now: float) -> str:
        seen = self.sensors.locate(now)
        return seen.room if seen else ""

    def level(self, name: str, now: float) -> Severity:
        return self.sensors.diagnoses(now)[name].level


@pytest.fixture
def house() -> House:
    return House()


def test_nothing_is_known_before_the_first_report(house: House) -> None:
    assert house.sensors.locate(1.0) is None
    assert house.says("kitchen_pir", False, 2.0) is None, "no motion says nothing about where the user is"


def test_motion_that_began_last_says_where_the_user_is(house: House) -> None:
    assert house.says("kitchen_pir", True, 10.0) == SensedRoom("kitchen", "kitchen_pir", 10.0, 10.0)
    assert house.says("hall_pir", True, 20.0) == SensedRoom("hall", "hall_pir", 20.0, 20.0)
    house.says("kitchen_pir", True, 21.0)
    assert house.room(21.0) == "hall", "the same motion once more is not the beginning of it"
    house.says("kitchen_pir", False, 70.0)
    house.says("hall_pir", False, 80.0)
    assert house.room(9_000.0) == "hall", "the user stays where they were seen last"


def test_motion_lasts_until_it_is_over(house: House) -> None:
    house.says("kitchen_pir", True, 10.0)
    assert house.sensors.locate(300.0) == SensedRoom("kitchen", "kitchen_pir", 10.0, 300.0)
    house.says("kitchen_pir", False, 301.0)
    house.says("kitchen_pir", False, 400.0)
    assert house.sensors.locate(500.0) == SensedRoom("kitchen", "kitchen_pir", 10.0, 301.0)
    house.says("kitchen_pir", True, 600.0)
    assert house.sensors.locate(5_000.0) == SensedRoom("kitchen", "kitchen_pir", 600.0, 600.0), "silent since"


def test_who_walks_back_before_the_first_sensor_noticed_is_back(house: House) -> None:
    house.says("kitchen_pir", True, 10.0)
    house.says("hall_pir", True, 20.0)
    # Back in the kitchen at 30, whose motion never ended.
    assert house.says("hall_pir", False, 80.0) == SensedRoom("kitchen", "kitchen_pir", 80.0, 80.0)
    house.says("kitchen_pir", False, 90.0)
    assert house.room(200.0) == "kitchen", "and not in the hall, which was seen earlier"


def test_a_device_says_where_the_user_is_when_its_state_changes(house: House) -> None:
    assert house.says("door", True, 1.0) == SensedRoom("hall", "door", 1.0, 1.0)
    house.says("kitchen_pir", True, 5.0)
    house.says("kitchen_pir", False, 6.0)
    house.says("door", True, 100.0)
    assert house.room(100.0) == "kitchen", "it says once more that it is open"
    assert house.says("door", False, 110.0) == SensedRoom("hall", "door", 110.0, 110.0)


def test_the_first_report_of_a_device_that_is_off_is_not_a_change(house: House) -> None:
    assert house.says("tv", False, 1.0) is None


def test_a_button_says_so_with_each_press(house: House) -> None:
    house.says("button", True, 1.0)
    assert house.says("button", True, 50.0) == SensedRoom("bedroom", "button", 50.0, 50.0)
    house.says("button", False, 51.0)
    assert house.sensors.locate(51.0) == SensedRoom("bedroom", "button", 50.0, 50.0)


def test_a_press_is_a_button_that_reports_now(house: House) -> None:
    presses = [
        Report(sensor, active, at)
        for sensor in ("button", "door")
        for active in (True, False)
        for at in (100.0, 100.0 - PRESS_S, 99.9 - PRESS_S, None)
        if house.sensors.is_press(Report(sensor, active, at), 100.0)
    ]
    assert presses == [Report("button", True, 100.0), Report("button", True, 100.0 - PRESS_S)]


def test_motion_that_goes_on_takes_over_from_a_device(house: House) -> None:
    house.says("kitchen_pir", True, 10.0)
    house.says("tv", True, 20.0)
    assert house.room(20.0 + HOLD_S) == "living_room"
    assert house.room(21.0 + HOLD_S) == "kitchen"


def test_a_device_that_was_operated_counts_although_motion_ended_after_it(house: House) -> None:
    house.says("kitchen_pir", True, 10.0)
    house.says("tv", True, 20.0)
    house.says("kitchen_pir", False, 40.0)
    assert house.room(1_000.0) == "living_room"


def test_a_detector_that_is_stuck_does_not_win_for_ever(house: House) -> None:
    house.says("kitchen_pir", True, 10.0)
    house.says("hall_pir", True, 20.0)
    for now in range(30, 2_000, 10):
        house.says("hall_pir", True, float(now))
        house.says("kitchen_pir", now % 600 < 300, float(now))
    assert house.level("hall_pir", 2_000.0) is Severity.WARN
    assert house.room(2_000.0) == "kitchen"
    house.says("kitchen_pir", False, 2_100.0)
    house.says("hall_pir", True, 2_110.0)
    assert house.room(2_110.0) == "kitchen", "it is not believed while it is stuck"
    house.says("hall_pir", False, 2_120.0)
    house.says("hall_pir", True, 2_130.0)
    assert house.room(2_130.0) == "hall", "it works again"
    assert house.level("hall_pir", 2_130.0) is Severity.OK


def test_a_detector_that_is_stuck_from_the_start_lets_others_win(house: House) -> None:
    house.says("hall_pir", True, 1.0)
    assert house.says("tv", True, 10.0).room == "living_room"
    assert house.says("kitchen_pir", True, 20.0).room == "kitchen"


def test_a_detector_that_fell_silent_with_motion_is_stale() -> None:
    sensors = HomeSensors({"old": HomeSensor("hall", stale_after=100.0), "new": HomeSensor("kitchen")}, 0.0)
    sensors.take(Report("new", True, 10.0), 10.0)
    sensors.take(Report("old", True, 20.0), 20.0)
    assert sensors.locate(120.0) == SensedRoom("hall", "old", 20.0, 120.0)
    assert sensors.diagnoses(120.0)["old"].level is Severity.OK
    assert sensors.locate(121.0) == SensedRoom("kitchen", "new", 121.0, 121.0), "what still speaks takes over"
    assert sensors.diagnoses(121.0)["old"].level is Severity.WARN
    sensors.take(Report("old", True, 130.0), 130.0)
    assert sensors.locate(130.0) == SensedRoom("hall", "old", 130.0, 130.0), "motion begins again"


def test_a_detector_that_never_reported_is_stale_in_the_end(house: House) -> None:
    assert house.level("hall_pir", STALE) is Severity.OK
    assert house.level("hall_pir", STALE + 1.0) is Severity.WARN
    assert house.level("door", STALE + 1.0) is Severity.OK, "a door that nobody opens has nothing to say"


def test_motion_in_two_rooms_is_reported_when_it_lasts(house: House) -> None:
    house.says("hall_pir", True, 10.0)
    house.says("hall_pir_2", True, 10.0)
    assert house.level("user", 500.0) is Severity.OK, "two sensors in one room agree"
    house.says("kitchen_pir", True, 500.0)
    found = house.sensors.diagnoses(500.0)["user"]
    assert (found.level, found.values["motion in"]) == (Severity.OK, "hall, kitchen"), (
        "somebody walks through"
    )
    house.sensors.locate(500.0)
    found = house.sensors.diagnoses(501.0 + CONTRADICTION_S)["user"]
    assert found.level is Severity.WARN
    assert "hall and kitchen" in found.message and "in kitchen, where it began last" in found.message
    house.says("hall_pir", False, 700.0)
    house.says("hall_pir_2", False, 700.0)
    assert house.level("user", 700.0) is Severity.OK


def test_a_late_report_counts_with_its_own_time(house: House) -> None:
    house.says("kitchen_pir", True, 100.0)
    house.says("kitchen_pir", False, 110.0)
    assert house.late("tv", True, 50.0, 120.0).room == "kitchen", "the TV was operated before"
    assert house.late("button", True, 115.0, 120.0) == SensedRoom("bedroom", "button", 115.0, 115.0)


def test_of_one_sensor_an_older_report_does_not_undo_a_newer_one(house: House) -> None:
    house.says("kitchen_pir", True, 100.0)
    house.late("kitchen_pir", False, 90.0, 101.0)
    assert house.sensors.locate(101.0).at == 101.0, "motion goes on"
    assert house.sensors.diagnoses(101.0)["kitchen_pir"].values["reports that came too late"] == "1"


def test_an_old_report_says_nothing(house: House) -> None:
    assert house.late("kitchen_pir", True, 100.0, 101.0 + STALE) is None
    assert house.late("kitchen_pir", True, 101.0, 101.0 + STALE) is not None


def test_a_retained_report_without_a_time_says_nothing_but_the_state(house: House) -> None:
    assert house.late("kitchen_pir", True, None, 10.0) is None
    assert house.says("kitchen_pir", True, 20.0).since == 20.0, "motion that is reported now begins now"
    house.late("tv", True, None, 30.0)
    assert house.room(30.0) == "kitchen"
    house.says("tv", True, 31.0)
    assert house.room(31.0) == "kitchen", "it was on already"
    assert house.says("tv", False, 32.0).room == "living_room"


@pytest.mark.parametrize("at", [math.nan, math.inf, -math.inf, 11.0 + SENSOR_AHEAD_S])
def test_a_time_that_cannot_be_meant_is_refused(house: House, at: float) -> None:
    with pytest.raises(BadReport, match="would have worked"):
        house.late("kitchen_pir", True, at, 10.0)
    assert house.sensors.locate(10.0) is None


def test_a_clock_that_is_a_little_ahead_means_now(house: House) -> None:
    assert house.late("kitchen_pir", True, 12.0, 10.0) == SensedRoom("kitchen", "kitchen_pir", 10.0, 10.0)


def test_an_unknown_sensor_is_refused_with_those_that_exist(house: House) -> None:
    with pytest.raises(BadReport, match=r"'kitchen_pri' \(would have worked: kitchen_pir"):
        house.says("kitchen_pri", True, 1.0)


@given(
    st.lists(
        st.tuples(
            st.sampled_from(sorted(SENSORS)), st.booleans(), st.floats(0.0, 900.0), st.floats(0.0, 30.0)
        )
    )
)
def test_whatever_is_reported_the_times_make_sense(reports: list[tuple[str, bool, float, float]]) -> None:
    house, now, before = House(), 0.0, None
    for sensor, active, pause, delay in reports:
        now += pause
        seen = house.late(sensor, active, now - delay, now)
        house.sensors.diagnoses(now)
        if seen is None:
            assert before is None
            continue
        assert seen.since <= seen.at <= now
        assert SENSORS[seen.source].room == seen.room
        assert before is None or seen.since >= before.since, "nothing takes over with an earlier beginning"
        assert house.sensors.locate(now) == seen, "asking does not change the answer"
        before = seen


def test_motion_that_is_over_after_a_long_silence_was_believed_until_the_silence(house: House) -> None:
    house.says("kitchen_pir", True, 10.0)
    house.says("kitchen_pir", True, 20.0)
    seen = house.says("kitchen_pir", False, 21.0 + STALE)
    assert seen == SensedRoom("kitchen", "kitchen_pir", 10.0, 20.0)
