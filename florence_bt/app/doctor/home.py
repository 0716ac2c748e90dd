"""The home sensors: whether their file is right, and whether the MQTT broker lets us in."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator
from pathlib import Path

from florence_bt.app.doctor.finding import HealthFinding, good, problem
from florence_bt.core.errors import ConfigError
from florence_bt.core.paths import find_data
from florence_bt.skills.home_sensors.mqtt import CONNECT_TIMEOUT_S, MqttClient
from florence_bt.skills.home_sensors.settings import BrokerSettings, load_home
from florence_bt.skills.locator.hotspots import load_hotspots

GROUP = "home sensors"
ANSWER_S = CONNECT_TIMEOUT_S + 2.0
"""Wall seconds for the broker to let us in and accept the subscriptions."""


def check_home(home_file: Path, hotspots_file: Path | None) -> Iterator[HealthFinding]:
    """Check the file and the broker.

    Args:
        home_file: The file of the home sensors.
        hotspots_file: The rooms; None for those of the package.
    """
    try:
        home = load_home(home_file, load_hotspots(hotspots_file or find_data("hotspots", "flat.yaml")))
        rooms = {sensor.room for sensor in home.sensors.values()}
        yield good(GROUP, "file", f"{home_file}: {len(home.sensors)} sensors in {len(rooms)} rooms")
        topics = [sensor.topic for sensor in home.sensors.values() if sensor.topic]
        if home.mqtt is not None and topics:
            yield _broker(home.mqtt, topics)
    except ConfigError as error:
        yield problem(GROUP, "file", str(error), "correct the file, or what it names")


def _broker(broker: BrokerSettings, topics: list[str]) -> HealthFinding:
    """Connect and subscribe as the node does."""
    soon: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
    links: list[str] = []
    client = MqttClient(
        broker,
        topics,
        call_soon=soon.put,
        on_message=lambda topic, payload, retained: None,
        on_link=links.append,
    )
    client.open()
    try:
        while not links:
            soon.get(timeout=ANSWER_S)()
    except queue.Empty:
        links.append(f"no answer within {ANSWER_S:g} s")
    finally:
        client.close()
    if links[0]:
        advice = "start the broker, or correct the part mqtt of the file"
        return problem(GROUP, "MQTT broker", f"{broker.address}: {links[0]}", advice)
    return good(GROUP, "MQTT broker", f"{broker.address}: connected, {len(topics)} topics")
