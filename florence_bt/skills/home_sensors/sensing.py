"""The home sensors as a component: reports in; the room of the user and pressed buttons out.

Source: document, section 3.8.1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Diagnoses, Diagnosis
from florence_bt.core.ports import Ports, Topic
from florence_bt.core.topic_names import ANSWER, HOME_EVENT
from florence_bt.core.topics import DIAGNOSES
from florence_bt.skills.home_sensors.home_sensors import BadReport, HomeSensors, Report, SensedRoom
from florence_bt.skills.home_sensors.payload import read_payload
from florence_bt.skills.home_sensors.settings import HomeSensor
from florence_bt.skills.locator.locating import SIGHTINGS, Sighting
from florence_bt.skills.locator.locator import LastSeen

STALE_LOOK_S = 1.0
"""Between two looks at what has become stale, and two diagnostics."""
REPORTS = Topic(HOME_EVENT, Report, interface="florence_interfaces/msg/HomeEvent")
PRESSES = Topic(ANSWER, str)


class HomeSensing:
    """Publishes ``home_sensors/user_seen``, and on ``answer`` the name of a button that is pressed.

    Args:
        ports: Its connections.
        sensors: The sensors by name.
        links: Diagnoses of what else brings reports, by what they are about.
    """

    def __init__(
        self,
        ports: Ports,
        sensors: Mapping[str, HomeSensor],
        links: Callable[[], Mapping[str, Diagnosis]] = dict,
    ) -> None:
        self._ports, self._settings, self._links = ports, sensors, links
        self._by_topic = {sensor.topic: name for name, sensor in sensors.items() if sensor.topic}
        self._sensors = HomeSensors(sensors, ports.clock.now())
        self._sent: SensedRoom | None = None
        self._sightings, self._presses = ports.output(SIGHTINGS), ports.output(PRESSES)
        self._diagnoses = ports.output(DIAGNOSES)
        ports.listen(REPORTS, lambda report: self._take(REPORTS.name, report))
        call_every(ports.clock, STALE_LOOK_S, self._send_user)
        ports.on_time_jump(self._send_again)
        call_every(ports.steady, STALE_LOOK_S, self._send_diagnoses)

    def take_payload(self, topic: str, payload: bytes, *, retained: bool, wall_now: float) -> None:
        """Take a message of MQTT.

        Args:
            topic: Of a sensor.
            payload: Its bytes.
            retained: Whether the broker had kept it.
            wall_now: Seconds since 1970, which times in payloads count from.
        """
        now, name = self._ports.clock.now(), self._by_topic[topic]
        try:
            sensor = self._settings[name]
            report = read_payload(name, sensor, payload, retained=retained, now=now, wall_now=wall_now)
        except BadReport as error:
            self._ports.refuse(f"MQTT {topic}", str(error))
            return
        if report is not None:
            self._take(f"MQTT {topic}", report)

    def _take(self, source: str, report: Report) -> None:
        now = self._ports.clock.now()
        try:
            self._sensors.take(report, now)
        except BadReport as error:
            self._ports.refuse(source, str(error))
            return
        if self._sensors.is_press(report, now):
            self._presses.send(report.sensor)
        self._send_user()

    def _send_user(self) -> None:
        seen = self._sensors.locate(self._ports.clock.now())
        if seen is not None and seen != self._sent:
            self._sent = seen
            self._sightings.send(Sighting(seen.room, LastSeen(seen.source, seen.since, seen.at)))

    def _send_again(self) -> None:
        """Send it again when the clock has jumped, so that who listens later gets moments of the new time."""
        self._sent = None
        self._send_user()

    def _send_diagnoses(self) -> None:
        found = self._sensors.diagnoses(self._ports.clock.now())
        self._diagnoses.send(Diagnoses({**found, **self._links()}, "home sensors"))
