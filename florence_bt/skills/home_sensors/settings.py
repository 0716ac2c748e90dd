"""The file of the home sensors: which sensor is in which room, and how it reports.

Free of ROS and MQTT: ``florence up`` and ``florence doctor`` read it before anything starts.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlSequence, read_yaml
from florence_bt.core.text_files import decode, read_bytes
from florence_bt.core.yaml_reader import ValueReader, YamlReader
from florence_bt.skills.locator.hotspots import Hotspots

ON = frozenset({"true", "on", "1", "yes", "open", "motion", "detected", "occupied"})
OFF = frozenset({"false", "off", "0", "no", "closed", "clear", "none", ""})
"""Reports that mean on, and off, where the file says nothing else; in capitals or not."""
STALE_AFTER_S, STUCK_AFTER_S = 3600.0, 1800.0
PORT, TLS_PORT = 1883, 8883
"""Registered by IANA for MQTT, and for MQTT over TLS."""
MAX_TOPIC_BYTES = 65_535
"""MQTT 5.0, section 1.5.4."""


class SensorKind(Enum):
    """The kinds of sensors, by the meaning of their reports."""

    MOTION = "motion"
    """Somebody is in the room from the first report of motion to the one that says that it is over."""
    DEVICE = "device"
    """Somebody in the room operated it when its state changed: a door, a light, a TV."""
    BUTTON = "button"
    """Somebody in the room pressed it with every report that is on."""


@dataclass(frozen=True, slots=True)
class HomeSensor:
    """A sensor of the house.

    Attributes:
        room: The label of the room in which somebody is when it says so.
        kind: What its reports mean.
        topic: Its MQTT topic; empty when it reports over ROS only.
        value: The member of the JSON object that holds its state; empty when the whole payload is the state.
        time: The member with the time of the report; empty when there is none.
        on: What it says when it is on, in lower case.
        off: What it says when it is off, in lower case.
        stale_after: Seconds after which a report no longer counts.
        stuck_after: Seconds of motion without a pause after which a motion detector is not trusted.
    """

    room: str
    kind: SensorKind = SensorKind.MOTION
    topic: str = ""
    value: str = ""
    time: str = ""
    on: frozenset[str] = ON
    off: frozenset[str] = OFF
    stale_after: float = STALE_AFTER_S
    stuck_after: float = STUCK_AFTER_S


@dataclass(frozen=True, slots=True)
class BrokerSettings:
    """The settings for reaching the MQTT broker.

    Attributes:
        host: Its name or address.
        port: Its TCP port.
        username: Empty for none.
        password_env: The variable of the environment that holds the password; empty for none.
        password_file: The file that holds it; None for none.
        tls: Whether the connection is encrypted and the broker's certificate checked.
        ca_file: The certificates that are trusted; None for those of the system.
        cert_file: The client's own certificate, where the broker wants one.
        key_file: Its key.
    """

    host: str
    port: int = PORT
    username: str = ""
    password_env: str = ""
    password_file: Path | None = None
    tls: bool = False
    ca_file: Path | None = None
    cert_file: Path | None = None
    key_file: Path | None = None

    @property
    def address(self) -> str:
        """Host and port, for people."""
        return f"{self.host}:{self.port}"

    def password(self, environment: Mapping[str, str] = os.environ) -> str | None:
        """Return the password, None when there is none.

        Raises:
            ConfigError: The variable is not set, or the file cannot be read. The password is never in it.
        """
        if self.password_env:
            if self.password_env not in environment:
                raise ConfigError(
                    f"the password of the MQTT broker: the variable {self.password_env} is not set",
                    valid=[f"export {self.password_env}=..."],
                )
            return environment[self.password_env]
        if self.password_file is not None:
            try:
                return decode(read_bytes(self.password_file), self.password_file).rstrip("\r\n")
            except ConfigError as error:
                raise ConfigError(
                    f"the password of the MQTT broker: {error.problem}", file=self.password_file
                ) from error
        return None


@dataclass(frozen=True, slots=True)
class HomeSettings:
    """The contents of the file.

    Attributes:
        sensors: The sensors by name, in the order of the file.
        mqtt: The broker; None when all sensors report over ROS.
    """

    sensors: Mapping[str, HomeSensor] = field(default_factory=dict)
    mqtt: BrokerSettings | None = None


def load_home(path: str | Path, hotspots: Hotspots) -> HomeSettings:
    """Read a file of home sensors.

    Args:
        path: The file; files that it names are relative to its folder.
        hotspots: Whose rooms the sensors are in.

    Raises:
        ConfigError: The file cannot be read or is wrong; with file, line and column.
    """
    return _HomeSettingsReader(Path(path), hotspots).read(read_yaml(Path(path)))


_KINDS = tuple(kind.value for kind in SensorKind)


class _HomeSettingsReader(YamlReader):
    """Reads the home sensors of one file."""

    def __init__(self, file: Path, hotspots: Hotspots) -> None:
        super().__init__(file)
        self._hotspots = hotspots
        self._topics: dict[str, str] = {}

    def read(self, root: YamlNode) -> HomeSettings:
        top = self.mapping(root, ("mqtt", "sensors"), needed=("sensors",))
        mqtt = self._broker(top["mqtt"]) if "mqtt" in top else None
        table = top["sensors"]
        if not isinstance(table, YamlMapping) or not table.entries:
            raise self.error(
                "'sensors' maps names to sensors", table, valid=("sensors: {kitchen_pir: {room: kitchen}}",)
            )
        return HomeSettings({key.text: self._sensor(key.text, item) for key, item in table.entries}, mqtt)

    def _broker(self, source: YamlNode) -> BrokerSettings:
        readers: dict[str, ValueReader] = {
            "host": self.text,
            "port": self._port,
            "username": self.text,
            "password_env": self.text,
            "password_file": self._path,
            "tls": self._flag,
            "ca_file": self._path,
            "cert_file": self._path,
            "key_file": self._path,
        }
        entries = self.mapping(source, readers, needed=("host",))
        if "password_env" in entries and "password_file" in entries:
            valid = ("password_env or password_file",)
            raise self.error("the password is given twice", entries["password_file"], valid)
        values = self.values(entries, readers)
        tls = values.get("tls", False)
        if not tls and values.keys() & {"ca_file", "cert_file", "key_file"}:
            raise self.error("certificates are for an encrypted connection", source, valid=("tls: true",))
        if ("cert_file" in values) != ("key_file" in values):
            raise self.error("cert_file and key_file go together", source, valid=("both", "neither"))
        return BrokerSettings(**{"port": TLS_PORT if tls else PORT, **values})

    def _path(self, source: YamlNode, name: str) -> Path:
        return self.file.parent / self.text(source, name)

    def _flag(self, source: YamlNode, name: str) -> bool:
        return self.choice(source, name, ("true", "false")) == "true"

    def _port(self, source: YamlNode, name: str) -> int:
        port = self.number(source, name)
        if not (port.is_integer() and 1 <= port <= 65535):
            raise self.error(f"the port {port:g} does not exist", source, valid=("1 to 65535",))
        return int(port)

    def _sensor(self, name: str, source: YamlNode) -> HomeSensor:
        rooms = [room.label for room in self._hotspots.rooms()]
        readers: dict[str, ValueReader] = {
            "room": partial(self.choice, known=rooms),
            "kind": lambda value, key: SensorKind(self.choice(value, key, _KINDS)),
            "topic": lambda value, _: self._topic(value, name),
            "value": self.text,
            "time": self.text,
            "on": self._words,
            "off": self._words,
            "stale_after": self._seconds,
            "stuck_after": self._seconds,
        }
        entries = self.mapping(source, readers, needed=("room",))
        if "time" in entries and "value" not in entries:
            problem = "'time' is a member of a JSON object, and so must be the state"
            raise self.error(problem, entries["time"], valid=("value: state",))
        values = self.values(entries, readers)
        # A word that the file gives to the one is not the other's by default.
        on = values.get("on", ON - values.get("off", frozenset()))
        off = values.get("off", OFF - values.get("on", frozenset()))
        if both := on & off:
            raise self.error(f"{min(both)!r} is on and off", entries["off"], valid=("one of them",))
        return HomeSensor(**{**values, "on": on, "off": off})

    def _topic(self, source: YamlNode, name: str) -> str:
        topic = self.text(source, "topic")
        if any(character in topic for character in "+#\0") or len(topic.encode()) > MAX_TOPIC_BYTES:
            raise self.error(f"the topic {topic[:80]!r} is not one topic", source, valid=("zigbee2mqtt/pir",))
        if topic in self._topics:
            problem = f"the topic {topic!r} is that of {self._topics[topic]!r}"
            raise self.error(problem, source, valid=("a topic for each sensor",))
        self._topics[topic] = name
        return topic

    def _seconds(self, source: YamlNode, name: str) -> float:
        seconds = self.number(source, name)
        if seconds <= 0.0:
            raise self.error(f"{name} is {seconds:g} s", source, valid=("a time above 0 s",))
        return seconds

    def _words(self, source: YamlNode, name: str) -> frozenset[str]:
        items = source.items if isinstance(source, YamlSequence) else (source,)
        return frozenset(self.text(item, name).lower() for item in items)
