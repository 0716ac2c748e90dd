"""Home sensors over ROS: reports become the user's room in the locator; bad ones are counted and refused."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from florence_interfaces.msg import DetectedUser, HomeEvent, UserSeen
from florence_interfaces.srv import GetRoom, GetUserSeen, SetRoom

from florence_bt.core.errors import ConfigError
from florence_bt.ros.conversions import stamp_from_ros, stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.skills.home_sensors.node import HomeSensorsNode
from florence_bt.skills.locator.node import LocatorNode

pytestmark = pytest.mark.ros

HOTSPOTS = """\
hotspots:
- {label: kitchen, x: 1, y: 1}
- {label: bedroom, x: 5, y: 1}
"""
HOME = """\
sensors:
  kitchen_pir: {room: kitchen, stale_after: 600}
  bedroom_pir: {room: bedroom}
  radio: {room: bedroom, kind: device}
"""


class HomeBench:
    """The home sensors, the locator and a client."""

    def __init__(self, ros, tmp_path, home=HOME):
        self.ros = ros
        hotspots, file = tmp_path / "hotspots.yaml", tmp_path / "home.yaml"
        hotspots.write_text(HOTSPOTS)
        file.write_text(home)
        self.node = ros.add(FlorenceNode("client"))
        self.seen, self.diagnoses = [], {}
        self.node.create_subscription(UserSeen, "home_sensors/user_seen", self.seen.append, LATCHED)
        self.node.create_subscription(DiagnosticArray, "diagnostics", self._on_diagnostics, RELIABLE)
        self.events = self.node.create_publisher(HomeEvent, "home_sensors/event", RELIABLE)
        self.detected = self.node.create_publisher(DetectedUser, "detected_user", RELIABLE)
        self.locator = ros.add(LocatorNode(parameters={"hotspots_file": str(hotspots)}))
        parameters = {"home_file": str(file), "hotspots_file": str(hotspots)}
        self.home = ros.add(HomeSensorsNode(parameters=parameters))
        ros.spin_until(lambda: self.events.get_subscription_count() == 1, what="the home sensors")
        ros.spin_until(lambda: self.detected.get_subscription_count() == 1, what="the locator")
        self._clients = {}

    def _on_diagnostics(self, message):
        self.diagnoses.update({status.name: status for status in message.status})

    def call(self, service_type, name, **fields):
        client = self._clients.setdefault(
            name, self._clients.get(name) or self.node.create_client(service_type, f"florenceLocator/{name}")
        )
        self.ros.spin_until(client.service_is_ready, what=name)
        future = client.call_async(service_type.Request(**fields))
        self.ros.spin_until(future.done, what=f"the answer of {name}")
        return future.result()

    def says(self, sensor, active=True, ago=None):
        stamp = Time() if ago is None else stamp_to_ros(self.node.timebase.now() - ago)
        self.events.publish(HomeEvent(sensor=sensor, active=active, stamp=stamp))

    def wait_for_room(self, room):
        self.ros.spin_until(lambda: self.call(GetRoom, "getUserPosRoom").room == room, what=room)


@pytest.fixture
def bench(ros, tmp_path):
    return HomeBench(ros, tmp_path)


def test_a_report_sets_the_users_room(bench):
    assert not bench.call(GetUserSeen, "getUserSeen").valid
    bench.says("kitchen_pir")
    bench.wait_for_room("kitchen")
    answer = bench.call(GetUserSeen, "getUserSeen")
    assert (answer.valid, answer.room, answer.source) == (True, "kitchen", "kitchen_pir")
    bench.says("radio", True, ago=300.0)
    bench.says("bedroom_pir", True, ago=200.0)
    bench.says("bedroom_pir", False, ago=190.0)
    bench.says("kitchen_pir", False)
    bench.ros.spin_for(0.5)
    assert bench.call(GetRoom, "getUserPosRoom").room == "kitchen", "what is older does not count"
    bench.says("bedroom_pir")
    bench.wait_for_room("bedroom")


def test_a_report_from_before_the_start_has_its_age(bench):
    bench.says("kitchen_pir", True, ago=300.0)
    bench.says("kitchen_pir", False, ago=200.0)
    bench.wait_for_room("kitchen")
    assert 200.0 <= bench.call(GetUserSeen, "getUserSeen").age < 290.0


def test_who_sees_the_user_later_counts_whatever_it_is(bench):
    bench.says("kitchen_pir")
    bench.wait_for_room("kitchen")
    bench.detected.publish(DetectedUser(command=True, user_position_x=5.0, user_position_y=1.5))
    bench.wait_for_room("bedroom")
    assert bench.call(GetUserSeen, "getUserSeen").source == "detected_user"
    count = len(bench.seen)
    bench.ros.spin_until(lambda: len(bench.seen) > count + 1, what="motion that goes on in the kitchen")
    assert bench.call(GetRoom, "getUserPosRoom").room == "bedroom", "it began before the user was detected"
    assert bench.call(SetRoom, "setUserPosRoom", room="kitchen").success
    assert bench.call(GetUserSeen, "getUserSeen").source in ("setUserPosRoom", "kitchen_pir")


def test_motion_that_goes_on_keeps_the_sighting_young(bench):
    bench.says("kitchen_pir", True, ago=100.0)
    bench.wait_for_room("kitchen")
    bench.ros.spin_until(lambda: len(bench.seen) > 1, what="a second message")
    since, stamp = stamp_from_ros(bench.seen[-1].since), stamp_from_ros(bench.seen[-1].stamp)
    assert 100.0 <= stamp - since < 200.0
    assert bench.call(GetUserSeen, "getUserSeen").age < 50.0


def test_bad_reports_are_counted_refused_and_shown(bench):
    bench.says("kichen_pir")
    bench.says("kitchen_pir", ago=-3600.0)
    bench.events.publish(HomeEvent(sensor="kitchen_pir", active=True, stamp=Time(sec=-1)))
    bench.events.publish(HomeEvent(sensor="x" * 300, active=True))
    refused = bench.home.health.refused
    bench.ros.spin_until(lambda: refused["home_sensors/event"] == 4, what="four refusals")
    bench.ros.spin_until(lambda: "home_sensors: messages" in bench.diagnoses, what="diagnostics")
    assert bench.diagnoses["home_sensors: messages"].level == b"\x01"
    assert not bench.call(GetUserSeen, "getUserSeen").valid


def test_diagnostics_name_each_sensor_and_the_users_room(bench):
    bench.says("kitchen_pir", True, ago=599.0)
    bench.ros.spin_until(
        lambda: (found := bench.diagnoses.get("home_sensors: kitchen_pir")) and found.level == b"\x01",
        what="a stale sensor",
    )
    assert "has not reported for 600 s" in bench.diagnoses["home_sensors: kitchen_pir"].message
    assert "last seen in kitchen" in bench.diagnoses["home_sensors: user"].message
    assert "home_sensors: MQTT broker" not in bench.diagnoses


def test_a_wrong_file_is_told_at_the_start(ros, tmp_path):
    with pytest.raises(ConfigError, match=r"home.yaml:2:15: .*'kichen'.*would have worked: kitchen"):
        HomeBench(ros, tmp_path, "sensors:\n  pir: {room: kichen}\n")
