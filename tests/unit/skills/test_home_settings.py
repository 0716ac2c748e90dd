"""The file of the home sensors: what it says, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.paths import find_data
from florence_bt.skills.home_sensors.settings import BrokerSettings, HomeSettings, SensorKind, load_home
from florence_bt.skills.locator.hotspots import load_hotspots, parse_hotspots

HOTSPOTS = parse_hotspots(
    "hotspots:\n- {label: kitchen, x: 1, y: 1}\n- {label: hall, x: 5, y: 1}\n"
    "- {label: tv, x: 2, y: 2, kind: object}\n"
)
SENSORS = "sensors:\n  pir: {room: kitchen}\n"


def read(tmp_path: Path, text: str) -> HomeSettings:
    file = tmp_path / "home.yaml"
    file.write_text(text)
    return load_home(file, HOTSPOTS)


def test_the_example_is_right() -> None:
    home = load_home(find_data("config", "home.yaml"), load_hotspots(find_data("hotspots", "flat.yaml")))
    assert home.mqtt == BrokerSettings("127.0.0.1")
    assert {name: (sensor.room, sensor.kind.value) for name, sensor in home.sensors.items()} == {
        "kitchen_pir": ("kitchen", "motion"),
        "bathroom_pir": ("bathroom", "motion"),
        "front_door": ("hall", "device"),
        "tv": ("living_room", "device"),
        "call_button": ("bedroom", "button"),
    }


def test_every_commented_line_of_the_example_works(tmp_path: Path) -> None:
    lines = find_data("config", "home.yaml").read_text().splitlines()
    lines = ["  " + line.removeprefix("  # ") if line.startswith("  # ") else line for line in lines]
    (tmp_path / "home.yaml").write_text("\n".join(line for line in lines if "password_file" not in line))
    home = load_home(tmp_path / "home.yaml", load_hotspots(find_data("hotspots", "flat.yaml")))
    assert home.mqtt is not None and home.mqtt.tls and home.mqtt.ca_file == tmp_path / "home-ca.pem"
    assert home.mqtt.password({"FLORENCE_MQTT_PASSWORD": "secret"}) == "secret"


def test_what_is_left_out_has_its_default(tmp_path: Path) -> None:
    home = read(tmp_path, SENSORS)
    assert home.mqtt is None
    sensor = home.sensors["pir"]
    assert (sensor.kind, sensor.topic, sensor.stale_after, sensor.stuck_after) == (
        SensorKind.MOTION,
        "",
        3600,
        1800,
    )
    assert "on" in sensor.on and "off" in sensor.off


def test_a_word_for_on_is_not_one_for_off_any_more(tmp_path: Path) -> None:
    sensor = read(tmp_path, "sensors:\n  pir: {room: kitchen, on: [CLOSED, 'off']}\n").sensors["pir"]
    assert sensor.on == {"closed", "off"} and not sensor.on & sensor.off
    sensor = read(tmp_path, "sensors:\n  pir: {room: kitchen, off: open}\n").sensors["pir"]
    assert sensor.off == {"open"} and "on" in sensor.on and "open" not in sensor.on


def test_tls_has_a_port_of_its_own(tmp_path: Path) -> None:
    assert read(tmp_path, "mqtt: {host: h, tls: true}\n" + SENSORS).mqtt.port == 8883
    assert read(tmp_path, "mqtt: {host: h, tls: true, port: 1}\n" + SENSORS).mqtt.port == 1


@pytest.mark.parametrize(
    ("text", "place", "problem"),
    [
        ("[]", ":1:1", "a mapping is needed"),
        ("mqtt: {host: h}", ":1:1", "'sensors' is missing"),
        ("sensors: []", ":1:10", "maps names to sensors"),
        ("sensors: {}", ":1:10", "maps names to sensors"),
        ("sensors:\n  pir: {}", ":2:8", "'room' is missing"),
        ("sensors:\n  pir: {room: kichen}", ":2:15", "would have worked: kitchen"),
        ("sensors:\n  pir: {room: tv}", ":2:15", "room cannot be 'tv'"),
        ("sensors:\n  pir: {room: hall, knd: motion}", ":2:21", "would have worked: kind"),
        ("sensors:\n  pir: {room: hall, kind: motio}", ":2:27", "would have worked: motion"),
        ("sensors:\n  pir: {room: hall, topic: 'a/#'}", ":2:28", "is not one topic"),
        ("sensors:\n  a: {room: hall, topic: t}\n  b: {room: hall, topic: t}", ":3:26", "is that of 'a'"),
        ("sensors:\n  pir: {room: hall, stale_after: 1 h}", ":2:34", "must be a finite number"),
        ("sensors:\n  pir: {room: hall, stuck_after: 0}", ":2:34", "a time above 0 s"),
        ("sensors:\n  pir: {room: hall, on: [x], off: [X]}", ":2:35", "'x' is on and off"),
        ("sensors:\n  pir: {room: hall, time: t}", ":2:27", "so must be the state"),
        ("mqtt: {port: 1}\n" + SENSORS, ":1:7", "'host' is missing"),
        ("mqtt: {host: h, port: 70000}\n" + SENSORS, ":1:23", "1 to 65535"),
        ("mqtt: {host: h, tls: yes}\n" + SENSORS, ":1:22", "would have worked"),
        ("mqtt: {host: h, ca_file: c}\n" + SENSORS, ":1:7", "tls: true"),
        ("mqtt: {host: h, tls: true, key_file: c}\n" + SENSORS, ":1:7", "go together"),
        ("mqtt: {host: h, password: secret}\n" + SENSORS, ":1:17", "password_env, password_file"),
        ("mqtt: {host: h, password_env: A, password_file: b}\n" + SENSORS, ":1:49", "given twice"),
    ],
)
def test_what_is_wrong_has_its_place_and_what_would_have_worked(
    tmp_path: Path, text: str, place: str, problem: str
) -> None:
    with pytest.raises(ConfigError) as error:
        read(tmp_path, text)
    assert str(error.value).startswith(f"{tmp_path / 'home.yaml'}{place}: ")
    assert problem in str(error.value)


def test_a_password_is_read_from_a_file_or_the_environment(tmp_path: Path) -> None:
    file = tmp_path / "secret"
    file.write_text("pass word\n")
    assert BrokerSettings("h").password({}) is None
    assert BrokerSettings("h", password_file=file).password({}) == "pass word"
    assert BrokerSettings("h", password_env="V").password({"V": "x"}) == "x"
    with pytest.raises(ConfigError, match="the variable V is not set"):
        BrokerSettings("h", password_env="V").password({})
    with pytest.raises(ConfigError, match=r"missing: the password .* No such file"):
        BrokerSettings("h", password_file=tmp_path / "missing").password({})
