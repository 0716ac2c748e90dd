"""Home sensors over MQTT, against a real broker: mosquitto, started, killed and started again.

Needs Debian's package mosquitto; skipped without it, except for what needs a broker that misbehaves.
"""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from florence_bt.app.doctor.finding import HealthLevel
from florence_bt.app.doctor.home import check_home
from florence_bt.core.errors import ConfigError
from florence_bt.skills.home_sensors.mqtt import MAX_WAITING, MqttClient
from florence_bt.skills.home_sensors.payload import MAX_PAYLOAD_BYTES
from florence_bt.skills.home_sensors.settings import BrokerSettings
from tests.script_process import free_port

paho = pytest.importorskip("paho.mqtt.client", reason="paho-mqtt is not here (extra home)")
MOSQUITTO = shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin:/usr/bin:/usr/local/bin")
needs_mosquitto = pytest.mark.skipif(
    MOSQUITTO is None, reason="mosquitto is not here (apt install mosquitto)"
)
PATIENCE_S = 60.0


def wait_until(condition: Callable[[], Any], what: str) -> Any:
    end = time.monotonic() + PATIENCE_S
    while not (value := condition()):
        assert time.monotonic() < end, f"waited {PATIENCE_S} s for {what}"
        time.sleep(0.01)
    return value


class Mosquitto:
    """A broker that listens on 127.0.0.1 only, and can be killed."""

    def __init__(self, folder: Path, *lines: str) -> None:
        self.port = free_port()
        self._config = folder / "mosquitto.conf"
        self._config.write_text(
            "\n".join(
                [f"listener {self.port} 127.0.0.1", "user root", *(lines or ["allow_anonymous true"]), ""]
            )
        )
        self._log = folder / "mosquitto.log"
        self._process: subprocess.Popen[bytes] | None = None
        self.start()

    def start(self) -> None:
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                [str(MOSQUITTO), "-c", self._config], stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )
        wait_until(self._listens, "mosquitto")

    def _listens(self) -> bool:
        assert self._process is not None and self._process.poll() is None, self._log.read_text()
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", self.port)) == 0

    def kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def publish(self, topic: str, payload: bytes | str, *, retain: bool = False, **login: str) -> None:
        """As a sensor would; returns when the broker has it."""
        client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        if login:
            client.username_pw_set(login["username"], login["password"])
        client.connect("127.0.0.1", self.port)
        client.loop_start()
        client.publish(topic, payload, qos=1, retain=retain).wait_for_publish(PATIENCE_S)
        client.disconnect()
        client.loop_stop()


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Mosquitto]:
    broker = Mosquitto(tmp_path)
    yield broker
    broker.kill()


class Bench:
    """A client whose callbacks run when the test says so."""

    def __init__(self, settings: BrokerSettings, *topics: str) -> None:
        self.soon: deque[Callable[[], None]] = deque()
        self.messages: list[tuple[str, bytes, bool]] = []
        self.links: list[str] = []
        self.client = MqttClient(
            settings,
            topics or ("a", "b"),
            call_soon=self.soon.append,
            on_message=lambda *message: self.messages.append(message),
            on_link=self.links.append,
        )
        self.client.open()

    def spin(self) -> None:
        while self.soon:
            self.soon.popleft()()

    def until(self, condition: Callable[[], Any], what: str) -> Any:
        def look() -> Any:
            self.spin()
            return condition()

        return wait_until(look, f"{what}; links: {self.links}")

    def wait_connected(self, times: int = 1) -> None:
        self.until(lambda: self.links.count("") == times, "the connection")


@pytest.fixture
def bench_of() -> Iterator[Callable[..., Bench]]:
    benches: list[Bench] = []

    def make(settings: BrokerSettings, *topics: str) -> Bench:
        benches.append(Bench(settings, *topics))
        return benches[-1]

    yield make
    for bench in benches:
        bench.client.close()
        assert not bench.client._thread.is_alive()


def at(port: int, **more: Any) -> BrokerSettings:
    return BrokerSettings("127.0.0.1", port, **more)


@needs_mosquitto
def test_messages_come_with_whether_they_were_kept(broker, bench_of):
    broker.publish("a", "old", retain=True)
    bench = bench_of(at(broker.port))
    bench.until(lambda: bench.messages == [("a", b"old", True)], "the retained message")
    broker.publish("a", "new", retain=True)
    broker.publish("c", "of no concern")
    broker.publish("b", b"\xff\x00")
    bench.until(lambda: len(bench.messages) == 3, "what is published now")
    assert bench.messages[1:] == [("a", b"new", False), ("b", b"\xff\x00", False)]
    assert bench.links == [""]


@needs_mosquitto
def test_a_broker_that_is_killed_is_reported_once_and_found_again(broker, bench_of):
    bench = bench_of(at(broker.port))
    bench.wait_connected()
    broker.kill()
    bench.until(lambda: bench.links[-1].startswith("no connection"), "the loss and a failed attempt")
    assert len(bench.links) <= 3, "a line when it is lost, one when it cannot be reached, not one an attempt"
    broker.start()
    bench.wait_connected(times=2)
    broker.publish("a", "back")
    bench.until(lambda: bench.messages == [("a", b"back", False)], "a message after the restart")


@needs_mosquitto
def test_a_broker_that_starts_later_is_found(tmp_path, bench_of):
    broker = Mosquitto(tmp_path)
    broker.kill()
    bench = bench_of(at(broker.port))
    bench.until(lambda: bench.links, "a failed attempt")
    assert bench.links == ["no connection: [Errno 111] Connection refused"]
    broker.start()
    try:
        bench.wait_connected()
    finally:
        broker.kill()


@needs_mosquitto
def test_a_wrong_password_is_reported_and_never_shown(tmp_path, bench_of, capfd):
    passwords = tmp_path / "passwords"
    subprocess.run(["mosquitto_passwd", "-b", "-c", passwords, "florence", "right"], check=True)
    broker = Mosquitto(tmp_path, "allow_anonymous false", f"password_file {passwords}")
    try:
        secret = tmp_path / "secret"
        secret.write_text("wr0ng-secret\n")
        wrong = bench_of(at(broker.port, username="florence", password_file=secret))
        wrong.until(lambda: wrong.links, "the refusal")
        assert wrong.links == ["the broker refuses the connection: Not authorized"]
        secret.write_text("right\n")
        right = bench_of(at(broker.port, username="florence", password_file=secret))
        right.wait_connected()
        broker.publish("a", "x", username="florence", password="right")
        right.until(lambda: right.messages, "a message")
        printed = capfd.readouterr()
        assert "wr0ng-secret" not in printed.out + printed.err + "".join(wrong.links)
    finally:
        broker.kill()


def test_a_subscription_that_is_refused_is_named(bench_of):
    """As brokers with rules for subscriptions answer; mosquitto 2.0 accepts all, and delivers nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(1000)
                connection.sendall(b"\x20\x03\x00\x00\x00")  # CONNACK
                packet = connection.recv(1000)  # SUBSCRIBE: type, length, identifier
                connection.sendall(
                    b"\x90\x05" + packet[2:4] + b"\x00\x01\x87"
                )  # SUBACK: QoS 1, not authorized
                connection.recv(1000)

        thread = threading.Thread(target=serve)
        thread.start()
        bench = bench_of(at(server.getsockname()[1]))
        bench.until(lambda: bench.links, "the answer")
        bench.client.close()
        thread.join(PATIENCE_S)
    assert bench.links == ["the broker refuses the subscription of b (Not authorized)"]


@pytest.fixture
def certificate(tmp_path: Path) -> tuple[Path, Path]:
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not here")
    cert, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    subprocess.run(
        [
            *("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2"),
            *(
                "-subj",
                "/CN=127.0.0.1",
                "-addext",
                "subjectAltName=IP:127.0.0.1",
                "-out",
                cert,
                "-keyout",
                key,
            ),
        ],
        check=True,
        capture_output=True,
    )
    return cert, key


@needs_mosquitto
# paho 2.2 leaves the socket of a failed handshake to the garbage collector.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_tls_checks_who_the_broker_is(tmp_path, bench_of, certificate):
    cert, key = certificate
    broker = Mosquitto(tmp_path, "allow_anonymous true", f"certfile {cert}", f"keyfile {key}")
    try:
        bench = bench_of(at(broker.port, tls=True, ca_file=cert))
        bench.wait_connected()
        stranger = bench_of(at(broker.port, tls=True))
        stranger.until(lambda: stranger.links, "the failure")
        assert "certificate verify failed" in stranger.links[0]
    finally:
        broker.kill()


def test_a_missing_certificate_is_told_at_the_start(tmp_path):
    with pytest.raises(ConfigError, match=r"certificate .* cannot be used: .*No such file"):
        Bench(at(1, tls=True, ca_file=tmp_path / "missing.pem"))


@needs_mosquitto
def test_a_huge_message_is_not_even_sent_to_us(broker, bench_of):
    bench = bench_of(at(broker.port))
    bench.wait_connected()
    broker.publish("a", b"x" * 5_000_000)
    broker.publish("a", b"y" * (MAX_PAYLOAD_BYTES + 1))
    bench.until(lambda: bench.messages, "the next message")
    assert [payload[:1] for _, payload, _ in bench.messages] == [b"y"], (
        "the reader of payloads refuses this one"
    )


@needs_mosquitto
def test_a_flood_is_cut_off_and_counted_while_the_owner_is_busy(broker, bench_of):
    bench = bench_of(at(broker.port))
    bench.wait_connected()
    sensor = paho.Client(paho.CallbackAPIVersion.VERSION2)
    sensor.connect("127.0.0.1", broker.port)
    sensor.loop_start()
    for _ in range(MAX_WAITING + 500):
        last = sensor.publish("a", "flood")
    last.wait_for_publish(PATIENCE_S)
    sensor.disconnect()
    sensor.loop_stop()
    wait_until(lambda: bench.client.dropped == 500, "what is dropped")
    bench.spin()
    assert len(bench.messages) == MAX_WAITING
    broker.publish("a", "later")
    bench.until(lambda: bench.messages[-1][1] == b"later", "a message after the flood")


@pytest.mark.parametrize(
    "answer",
    [
        b"HTTP/1.1 400 Bad Request\r\n\r\n",
        b"\x20\xff\xff\xff\xff\xff",
        b"\x20\x03\x00\x00\xff",
        b"\x20\x00" + b"\x00" * 40,
        bytes(range(256)) * 20,
        b"",
        b"\x20\x03\x00\x00\x00" + b"\x30\x06\x00\x01a\x01\xffx",
    ],
    ids=[
        "HTTP",
        "length",
        "short CONNACK",
        "zeros",
        "all bytes",
        "nothing",
        "a property that does not exist",
    ],
)
def test_what_is_not_a_broker_is_reported_and_survived(bench_of, answer):
    """A server that answers with something else, and hangs up, each time."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        served: list[int] = []

        def serve() -> None:
            while True:
                connection, _ = server.accept()
                with connection:
                    if not connection.recv(1000):
                        return  # the end of the test
                    served.append(1)
                    connection.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        bench = bench_of(at(server.getsockname()[1]))
        bench.until(lambda: bench.links and len(served) > 1, "a report, and a second attempt")
        bench.client.close()
        with socket.create_connection(server.getsockname()) as end:
            end.shutdown(socket.SHUT_WR)
            thread.join(PATIENCE_S)
    assert "" not in bench.links, "it is not taken for a broker"


@pytest.mark.parametrize("module", ["paho.mqtt.client", "paho.mqtt.enums"])
def test_without_paho_2_it_says_what_to_install(monkeypatch, module):
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.delattr("paho.mqtt.client")
    with pytest.raises(ConfigError, match=r"need paho-mqtt 2.*would have worked: make setup"):
        Bench(at(1))


def test_a_host_that_cannot_be_one_is_reported(bench_of):
    bench = bench_of(BrokerSettings("no..host"))
    bench.until(lambda: bench.links, "the report")
    assert bench.links[0].startswith("the client failed: UnicodeError")


def test_a_silent_server_does_not_hold_up_the_owner(bench_of):
    with socket.create_server(("127.0.0.1", 0)) as server:
        begin = time.monotonic()
        bench = bench_of(at(server.getsockname()[1]))
        bench.spin()
        assert time.monotonic() - begin < 1.0, "connecting is another thread's work"


@needs_mosquitto
def test_the_doctor_asks_the_broker(tmp_path, broker):
    (tmp_path / "hotspots.yaml").write_text(HOTSPOTS)
    file = tmp_path / "home.yaml"
    file.write_text(f"mqtt: {{host: 127.0.0.1, port: {broker.port}}}\n{SENSORS}")
    found = list(check_home(file, tmp_path / "hotspots.yaml"))
    assert [(finding.item, finding.level) for finding in found] == [
        ("file", HealthLevel.OK),
        ("MQTT broker", HealthLevel.OK),
    ]
    assert found[1].found == f"127.0.0.1:{broker.port}: connected, 2 topics"
    broker.kill()
    found = list(check_home(file, tmp_path / "hotspots.yaml"))
    assert found[1].level is HealthLevel.PROBLEM and "Connection refused" in found[1].found
    file.write_text("sensors: {pir: {room: kichen}}\n")
    found = list(check_home(file, tmp_path / "hotspots.yaml"))
    assert [finding.level for finding in found] == [HealthLevel.PROBLEM]
    assert "home.yaml:1:23" in found[0].found


# ---- the node ---------------------------------------------------------------------------------------------

HOTSPOTS = "hotspots:\n- {label: kitchen, x: 1, y: 1}\n- {label: bedroom, x: 5, y: 1}\n"
SENSORS = """\
sensors:
  kitchen_pir: {room: kitchen, topic: z/kitchen, value: occupancy, time: last_seen}
  bedroom_pir: {room: bedroom, topic: z/bedroom}
"""


@pytest.fixture
def node_of(ros, tmp_path):
    from florence_bt.skills.home_sensors.node import HomeSensorsNode

    def make(port: int):
        (tmp_path / "hotspots.yaml").write_text(HOTSPOTS)
        (tmp_path / "home.yaml").write_text(f"mqtt: {{host: 127.0.0.1, port: {port}}}\n{SENSORS}")
        files = {"home_file": tmp_path / "home.yaml", "hotspots_file": tmp_path / "hotspots.yaml"}
        return ros.add(HomeSensorsNode(parameters={name: str(file) for name, file in files.items()}))

    return make


class Watcher:
    """What the home sensors publish."""

    def __init__(self, ros):
        from diagnostic_msgs.msg import DiagnosticArray
        from florence_interfaces.msg import UserSeen

        from florence_bt.ros.node import FlorenceNode
        from florence_bt.ros.qos import LATCHED, RELIABLE

        self.room, self.diagnoses = "", {}
        node = ros.add(FlorenceNode("watcher"))
        node.create_subscription(UserSeen, "home_sensors/user_seen", self._on_seen, LATCHED)
        node.create_subscription(DiagnosticArray, "diagnostics", self._on_diagnostics, RELIABLE)

    def _on_seen(self, message):
        self.room = message.room

    def _on_diagnostics(self, message):
        self.diagnoses.update({status.name: status for status in message.status})

    def broker(self):
        found = self.diagnoses.get("home_sensors: MQTT broker")
        return found.message if found else ""


@needs_mosquitto
@pytest.mark.ros
def test_the_users_room_follows_the_sensors_over_a_restart_of_the_broker(ros, broker, node_of):
    watcher = Watcher(ros)
    node_of(broker.port)
    ros.spin_until(lambda: watcher.broker() == "connected", what="the broker")
    broker.publish("z/kitchen", '{"occupancy": true}')
    ros.spin_until(lambda: watcher.room == "kitchen", what="the kitchen")
    broker.kill()
    ros.spin_until(lambda: watcher.broker().startswith("no connection"), what="the loss")
    assert watcher.diagnoses["home_sensors: MQTT broker"].level == b"\x02"
    broker.start()
    ros.spin_until(lambda: watcher.broker() == "connected", what="the broker again")
    broker.publish("z/bedroom", "ON")
    ros.spin_until(lambda: watcher.room == "bedroom", what="the bedroom")


@needs_mosquitto
@pytest.mark.ros
def test_old_and_timeless_retained_messages_do_not_place_the_user(ros, broker, node_of):
    broker.publish("z/bedroom", "ON", retain=True)
    broker.publish("z/kitchen", json.dumps({"occupancy": True, "last_seen": time.time() - 7200}), retain=True)
    watcher = Watcher(ros)
    node = node_of(broker.port)
    ros.spin_until(lambda: watcher.broker() == "connected", what="the broker")
    ros.spin_until(
        lambda: (
            (found := watcher.diagnoses.get("home_sensors: kitchen_pir"))
            and {pair.key: pair.value for pair in found.values}["reports that came too late"] == "1"
        ),
        what="the report that came too late",
    )
    assert watcher.room == "" and not node.health.refused
    broker.publish("z/kitchen", json.dumps({"occupancy": True, "last_seen": time.time() - 60}), retain=True)
    ros.spin_until(lambda: watcher.room == "kitchen", what="the kitchen")


@needs_mosquitto
@pytest.mark.ros
def test_bad_payloads_are_counted_and_refused(ros, broker, node_of):
    watcher = Watcher(ros)
    node = node_of(broker.port)
    ros.spin_until(lambda: watcher.broker() == "connected", what="the broker")
    bad = [
        b"\xff\xfe\x00",
        b"{",
        b"[" * 10_000,
        b"x" * (MAX_PAYLOAD_BYTES + 1),
        b'{"occupancy": NaN}',
        b'{"occupancy": true, "last_seen": NaN}',
        b'{"occupancy": true, "last_seen": "tomorrow"}',
        json.dumps({"occupancy": True, "last_seen": time.time() + 86400}).encode(),
    ]
    for payload in bad:
        broker.publish("z/kitchen", payload)
    broker.publish("z/kitchen", b"z" * 1_000_000)
    ros.spin_until(lambda: node.health.refused["MQTT z/kitchen"] == len(bad), what="the refusals")
    ros.spin_until(lambda: "home_sensors: messages" in watcher.diagnoses, what="diagnostics")
    assert watcher.room == "" and not node.failures and not node.health.failed
    broker.publish("z/kitchen", '{"occupancy": true}')
    ros.spin_until(lambda: watcher.room == "kitchen", what="a good one after them")
