"""The node ``home_sensors``: :class:`HomeSensing` on ROS, and the reports that come over MQTT."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from florence_interfaces.msg import HomeEvent, UserSeen

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.ros.conversions import stamp_from_ros, stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.home_sensors.home_sensors import Report
from florence_bt.skills.home_sensors.mqtt import MqttClient
from florence_bt.skills.home_sensors.sensing import REPORTS, HomeSensing
from florence_bt.skills.home_sensors.settings import BrokerSettings, load_home
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.skills.locator.locating import SIGHTINGS, Sighting


@dataclass(frozen=True, slots=True)
class HomeSensorsNodeParameters:
    """Parameters of the home sensors.

    Attributes:
        home_file: Which sensor is in which room (docs/manual/home_sensors.md).
        hotspots_file: The rooms.

    Source:
        Document, section 3.8.1.
    """

    home_file: str
    hotspots_file: str


class HomeSensorsNode(FlorenceNode):
    """Publishes ``home_sensors/user_seen``, and on ``answer`` the name of a button that is pressed.

    Args:
        parameters: The node's parameters.

    Raises:
        ConfigError: A file is wrong, or paho-mqtt is needed and not installed.
    """

    parameter_classes = (HomeSensorsNodeParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("home_sensors", parameters=parameters)
        params = self.read_parameters(HomeSensorsNodeParameters)
        settings = load_home(params.home_file, load_hotspots(params.hotspots_file))
        self._link: str | None = None
        self._client: MqttClient | None = None
        ports = RosPorts(self, {SIGHTINGS: self._user_seen}, {REPORTS: self._report})
        self._sensing = HomeSensing(ports, settings.sensors, self._links)
        topics = [sensor.topic for sensor in settings.sensors.values() if sensor.topic]
        if settings.mqtt is not None and topics:
            self._connect(settings.mqtt, topics)

    def _connect(self, broker: BrokerSettings, topics: list[str]) -> None:
        self._address = broker.address
        self._client = MqttClient(
            broker, topics, call_soon=self.call_soon, on_message=self._on_mqtt, on_link=self._on_link
        )
        self._client.open()
        self.on_close(self._client.close)

    def _report(self, message: HomeEvent) -> Report:
        stamp = stamp_from_ros(message.stamp)
        at = self.time_of(stamp) if stamp else self.timebase.now()
        return Report(message.sensor, message.active, at)

    def _user_seen(self, sighting: Sighting) -> UserSeen:
        seen = sighting.seen
        message = UserSeen(room=sighting.room, source=seen.source)
        message.since, message.stamp = (stamp_to_ros(self.stamp(when)) for when in (seen.since, seen.at))
        return message

    def _on_mqtt(self, topic: str, payload: bytes, retained: bool) -> None:
        self._sensing.take_payload(topic, payload, retained=retained, wall_now=time.time())

    def _on_link(self, problem: str) -> None:
        self._link = problem
        if problem:
            self.get_logger().error(f"MQTT broker {self._address}: {problem}; will be tried again and again")
        else:
            self.get_logger().info(f"MQTT broker {self._address}: connected")

    def _links(self) -> dict[str, Diagnosis]:
        if self._client is None:
            return {}
        values = {"address": self._address, "messages dropped": str(self._client.dropped)}
        found = Diagnosis(Severity.WARN, "connecting", values)
        if self._link is not None:
            level = Severity.ERROR if self._link else Severity.OK
            found = Diagnosis(level, self._link or "connected", values)
        return {"MQTT broker": found}
