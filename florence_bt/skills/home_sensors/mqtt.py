"""The MQTT client: paho's, on a thread of its own; messages are passed to the owner's thread.

Connecting, keeping alive and connecting again with growing pauses are paho's. What is here: nothing waits
for the broker, what it sends is bounded, and whatever it sends, the thread goes on.
"""

from __future__ import annotations

import sys
import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from florence_bt.core.errors import ConfigError
from florence_bt.core.installation import how_to_get
from florence_bt.skills.home_sensors.payload import MAX_PAYLOAD_BYTES
from florence_bt.skills.home_sensors.settings import BrokerSettings

KEEP_ALIVE_S = 15
"""The broker is asked this often whether it is still there; without an answer it is lost."""
CONNECT_TIMEOUT_S = 3.0
CLOSING_ROUNDS, CLOSING_ROUND_S = 20, 0.2
"""For paho's thread to end in: it may be connecting, and looks once a second."""
SHORTEST_PAUSE_S, LONGEST_PAUSE_S = 1, 30
"""Between two attempts to connect; paho doubles the pause each time."""
PAUSE_AFTER_ERROR_S = 5.0
"""After an error at which paho gives up."""
MAX_WAITING = 1000
"""Messages that wait for the owner's thread; further ones are dropped, and counted."""
MAX_PACKET_BYTES = MAX_PAYLOAD_BYTES + 70_000
"""The broker is told to send nothing larger (MQTT 5.0, section 3.1.2.11.4): topic and header come on top."""


class MqttClient:
    """Subscribes to topics of a broker, and does so again whenever the broker comes back.

    Args:
        broker: Where it is.
        topics: What to subscribe to.
        call_soon: Runs a callback on the owner's thread; called from the client's.
        on_message: Called with topic, payload, and whether the broker had kept the message (retained).
        on_link: Called when it changes, with what is wrong with the connection, empty when it is up.

    Attributes:
        dropped: How many messages were dropped because too many waited.

    Raises:
        ConfigError: paho-mqtt is not installed, or the password or a certificate cannot be read.
    """

    def __init__(
        self,
        broker: BrokerSettings,
        topics: Sequence[str],
        *,
        call_soon: Callable[[Callable[[], None]], None],
        on_message: Callable[[str, bytes, bool], None],
        on_link: Callable[[str], None],
    ) -> None:
        self.dropped = 0
        self._topics = topics
        self._call_soon = call_soon
        self._on_message = on_message
        self._on_link = on_link
        self._problem: str | None = None
        self._waiting: deque[tuple[str, bytes, bool]] = deque()
        self._closing = threading.Event()
        self._client = _make_client(broker)
        self._client.on_connect = self._connected
        self._client.on_connect_fail = self._not_connected
        self._client.on_disconnect = self._disconnected
        self._client.on_subscribe = self._subscribed
        self._client.on_message = self._received
        # As a daemon: looking up a name can take longer than the process may take to end.
        self._thread = threading.Thread(target=self._serve, name="MQTT", daemon=True)

    def open(self) -> None:
        """Begin to connect; returns at once."""
        self._thread.start()

    def close(self) -> None:
        """Disconnect."""
        self._closing.set()
        for _ in range(CLOSING_ROUNDS):
            # Again, because paho forgets it when it is just about to connect.
            self._client.disconnect()
            self._thread.join(CLOSING_ROUND_S)
            if not self._thread.is_alive():
                return

    # ---- on paho's thread -----------------------------------------------------------------------------

    def _serve(self) -> None:
        while not self._closing.is_set():
            try:
                self._client.loop_forever(retry_first_connection=True)
            except Exception as error:
                # paho goes on after an OSError only; a host name that cannot be one is a UnicodeError.
                self._link(f"the client failed: {type(error).__name__}: {error}")
                self._closing.wait(PAUSE_AFTER_ERROR_S)

    def _connected(self, client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        if reason.is_failure:
            self._link(f"the broker refuses the connection: {reason}")
            return
        client.subscribe([(topic, 1) for topic in self._topics])

    def _subscribed(
        self, _client: Any, _data: Any, _id: int, reasons: Sequence[Any], _properties: Any
    ) -> None:
        refused = [
            f"{topic} ({reason})"
            for topic, reason in zip(self._topics, reasons, strict=False)
            if reason.is_failure
        ]
        self._link(f"the broker refuses the subscription of {', '.join(refused)}" if refused else "")

    def _not_connected(self, _client: Any, _data: Any) -> None:
        self._link(f"no connection: {sys.exception()}")

    def _disconnected(self, _client: Any, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        if not self._problem:  # else the reason is known
            self._link(f"the connection was lost: {reason}")

    def _received(self, _client: Any, _data: Any, message: Any) -> None:
        if len(self._waiting) >= MAX_WAITING:
            self.dropped += 1
            return
        self._waiting.append((message.topic, message.payload, bool(message.retain)))
        if len(self._waiting) == 1:
            self._call_soon(self._hand_over)

    def _link(self, problem: str) -> None:
        if problem != self._problem and not self._closing.is_set():
            self._problem = problem
            self._call_soon(lambda: self._on_link(problem))

    # ---- on the owner's thread ------------------------------------------------------------------------

    def _hand_over(self) -> None:
        try:
            for _ in range(len(self._waiting)):
                self._on_message(*self._waiting.popleft())
        finally:
            if self._waiting:
                self._call_soon(self._hand_over)


def require_paho() -> Any:
    """Import and return the module ``paho.mqtt.client``.

    Raises:
        ConfigError: It is not installed, or as old as that of Ubuntu 24.04 (1.6).
    """
    try:
        import paho.mqtt.client as paho
        from paho.mqtt.enums import CallbackAPIVersion  # noqa: F401  # paho 1 has no such module
    except ModuleNotFoundError as error:
        raise ConfigError(
            "home sensors over MQTT need paho-mqtt 2, which is not installed",
            valid=[how_to_get("paho")],
        ) from error
    return paho


def _make_client(broker: BrokerSettings) -> Any:
    paho = require_paho()
    from paho.mqtt.packettypes import PacketTypes
    from paho.mqtt.properties import Properties

    client = paho.Client(paho.CallbackAPIVersion.VERSION2, protocol=paho.MQTTv5)
    client.connect_timeout = CONNECT_TIMEOUT_S
    client.reconnect_delay_set(SHORTEST_PAUSE_S, LONGEST_PAUSE_S)
    if broker.username:
        client.username_pw_set(broker.username, broker.password())
    if broker.tls:
        try:
            client.tls_set(
                *(str(file) if file else None for file in (broker.ca_file, broker.cert_file, broker.key_file))
            )
        except (OSError, ValueError) as error:
            raise ConfigError(f"a certificate for the MQTT broker cannot be used: {error}") from error
    properties = Properties(PacketTypes.CONNECT)
    properties.MaximumPacketSize = MAX_PACKET_BYTES
    client.connect_async(broker.host, broker.port, KEEP_ALIVE_S, clean_start=True, properties=properties)
    return client
