"""The home sensors on ROS (``home_sensors``): takes reports over ROS and MQTT, publishes the user's room."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from florence_interfaces.msg import HomeEvent, UserSeen
from std_msgs.msg import String

from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.topic_names import ANSWER, USER_SEEN
from florence_bt.ros.conversions import stamp_from_ros, stamp_to_ros
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.skills.home_sensors.home_sensors import BadReport, HomeSensors, Report, SensedRoom
from florence_bt.skills.home_sensors.mqtt import MqttClient
from florence_bt.skills.home_sensors.payload import read_payload
from florence_bt.skills.home_sensors.settings import BrokerSettings, load_home
from florence_bt.skills.locator.hotspots import load_hotspots

EVENT = "home_sensors/event"
PERIOD_S = 1.0
"""Between two looks at what has become stale, and two diagnostics."""


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
        self._settings = settings.sensors
        self._by_topic = {sensor.topic: name for name, sensor in settings.sensors.items() if sensor.topic}
        self._sensors = HomeSensors(settings.sensors, self.timebase.now())
        self._published: SensedRoom | None = None
        self._user_seen = self.create_publisher(UserSeen, USER_SEEN, LATCHED)
        self._answers = self.create_publisher(String, ANSWER, RELIABLE)
        self._diagnostics = diagnostics_publisher(self)
        self.create_subscription(HomeEvent, EVENT, self._on_event, RELIABLE)
        call_every(self.timebase, PERIOD_S, self._publish_user)
        self.ros_timebase.on_reset(self._publish_again)
        call_every(self.steady, PERIOD_S, self._publish_diagnostics)
        self._link: str | None = None
        self._client: MqttClient | None = None
        if settings.mqtt is not None and self._by_topic:
            self._connect(settings.mqtt)

    def _connect(self, broker: BrokerSettings) -> None:
        self._address = broker.address
        self._client = MqttClient(
            broker,
            list(self._by_topic),
            call_soon=self.call_soon,
            on_message=self._on_mqtt,
            on_link=self._on_link,
        )
        self._client.open()
        self.on_close(self._client.close)

    def _on_event(self, message: HomeEvent) -> None:
        now = self.timebase.now()
        stamp = stamp_from_ros(message.stamp)
        at = self.time_of(stamp) if stamp else now
        self._take(EVENT, Report(message.sensor, message.active, at), now)

    def _on_mqtt(self, topic: str, payload: bytes, retained: bool) -> None:
        now = self.timebase.now()
        name = self._by_topic[topic]
        try:
            report = read_payload(
                name, self._settings[name], payload, retained=retained, now=now, wall_now=time.time()
            )
        except BadReport as error:
            self.health.count_refused(f"MQTT {topic}", str(error))
            return
        if report is not None:
            self._take(f"MQTT {topic}", report, now)

    def _take(self, source: str, report: Report, now: float) -> None:
        try:
            self._sensors.take(report, now)
        except BadReport as error:
            self.health.count_refused(source, str(error))
            return
        if self._sensors.is_press(report, now):
            self._answers.publish(String(data=report.sensor))
        self._publish_user()

    def _publish_user(self) -> None:
        seen = self._sensors.locate(self.timebase.now())
        if seen is None or seen == self._published:
            return
        self._published = seen
        message = UserSeen(room=seen.room, source=seen.source)
        message.since, message.stamp = (stamp_to_ros(self.stamp(when)) for when in (seen.since, seen.at))
        self._user_seen.publish(message)

    def _publish_again(self) -> None:
        """Publish again when the clock has jumped, so that later subscribers get stamps of the new time."""
        self._published = None
        self._publish_user()

    def _on_link(self, problem: str) -> None:
        self._link = problem
        if problem:
            self.get_logger().error(f"MQTT broker {self._address}: {problem}; will be tried again and again")
        else:
            self.get_logger().info(f"MQTT broker {self._address}: connected")

    def _publish_diagnostics(self) -> None:
        found = self._sensors.diagnoses(self.timebase.now())
        if self._client is not None:
            found["MQTT broker"] = self._broker(self._client)
        self._diagnostics.publish(diagnostics_to_ros(found, self.get_name(), "home sensors", self.stamp()))

    def _broker(self, client: MqttClient) -> Diagnosis:
        values = {"address": self._address, "messages dropped": str(client.dropped)}
        if self._link is None:
            return Diagnosis(Severity.WARN, "connecting", values)
        return Diagnosis(Severity.ERROR if self._link else Severity.OK, self._link or "connected", values)
