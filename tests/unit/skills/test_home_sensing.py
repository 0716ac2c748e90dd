"""The home sensors as a component, together with the locator that hears them."""

from __future__ import annotations

from typing import Any

from florence_bt.core.clock import ManualClock
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.geometry import Pose2
from florence_bt.core.topics import DIAGNOSES
from florence_bt.simulation.rig.wires import Link, Wires
from florence_bt.skills.home_sensors.home_sensors import SENSOR_AHEAD_S, Report
from florence_bt.skills.home_sensors.sensing import PRESSES, REPORTS, HomeSensing
from florence_bt.skills.home_sensors.settings import HomeSensor, SensorKind
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots
from florence_bt.skills.locator.locating import SIGHTINGS, Locating, LocatorParameters

SENSORS = {
    "kitchen_pir": HomeSensor("kitchen", topic="home/kitchen"),
    "hall_pir": HomeSensor("hall"),
    "button": HomeSensor("hall", SensorKind.BUTTON),
}


class House:
    """A house with its sensors and the robot's locator."""

    def __init__(self, links: dict[str, Link] | None = None) -> None:
        self.clock = ManualClock(100.0)
        self.wires = Wires(self.clock, [], links)
        broker = {"MQTT broker": Diagnosis(Severity.WARN, "connecting")}
        self.sensing = HomeSensing(self.wires.ports("home_sensors"), SENSORS, lambda: broker)
        rooms = Hotspots([Hotspot("kitchen", Pose2(1.0, 1.0)), Hotspot("hall", Pose2(5.0, 1.0))])
        Locating(self.wires.ports("florenceLocator"), rooms, LocatorParameters())
        self.reports = self.wires.ports("house").output(REPORTS)
        self.heard: dict[str, list[Any]] = {}
        for topic in (SIGHTINGS, PRESSES, DIAGNOSES):
            self.wires.ports("listener").listen(topic, self.heard.setdefault(topic.name, []).append)

    def says(self, sensor: str, active: bool = True, ahead_s: float = 0.0) -> None:
        self.reports.send(Report(sensor, active, self.clock.now() + ahead_s))
        self.clock.advance(0.1)

    def user(self) -> Any:
        return self.wires.services["florenceLocator/getUserSeen"]({})


def test_the_locator_hears_where_the_user_is_and_until_when() -> None:
    house = House()
    assert not house.user().valid
    house.says("kitchen_pir")
    house.clock.advance(10.0)
    seen = house.user()
    assert (seen.room, seen.source) == ("kitchen", "kitchen_pir")
    assert seen.age <= 1.0, "motion goes on, and is told again each second"
    house.says("kitchen_pir", active=False)
    house.clock.advance(30.0)
    assert 29.0 < house.user().age < 31.0
    house.says("hall_pir")
    assert house.user().room == "hall"


def test_what_does_not_change_is_not_sent_again() -> None:
    house = House()
    house.says("kitchen_pir")
    house.says("kitchen_pir", active=False)
    sent = len(house.heard[SIGHTINGS.name])
    house.clock.advance(20.0)
    assert len(house.heard[SIGHTINGS.name]) == sent


def test_a_pressed_button_is_an_answer() -> None:
    house = House()
    house.says("button")
    assert house.heard[PRESSES.name] == ["button"]


def test_a_report_that_cannot_be_meant_is_refused_by_where_it_came_from() -> None:
    house = House()
    house.says("kitchn_pir")
    house.says("hall_pir", ahead_s=SENSOR_AHEAD_S + 1.0)
    house.sensing.take_payload("home/kitchen", b"\xff", retained=False, wall_now=1.8e9)
    assert house.wires.refused == {REPORTS.name: 2, "MQTT home/kitchen": 1}
    assert not house.user().valid


def test_a_message_of_mqtt_is_a_report() -> None:
    house = House()
    house.sensing.take_payload("home/kitchen", b"ON", retained=False, wall_now=1.8e9)
    house.clock.advance(0.1)
    assert house.user().room == "kitchen"


def test_the_diagnoses_have_each_sensor_and_the_broker() -> None:
    house = House()
    house.clock.advance(1.5)
    (told,) = house.heard[DIAGNOSES.name]
    assert {*told.found} >= {*SENSORS, "MQTT broker"}


def test_a_sighting_that_comes_late_has_the_time_of_the_motion() -> None:
    house = House({SIGHTINGS.name: Link(delay=3.0)})
    house.says("hall_pir")
    house.says("hall_pir", active=False)
    house.clock.advance(3.5)
    assert 3.0 < house.user().age < 4.0
