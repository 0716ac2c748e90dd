"""Foxglove's port: who gets in, what is sent, what becomes of nonsense and of who is slow."""

from __future__ import annotations

import asyncio
import json
import socket
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest

pytest.importorskip("uvicorn")
connect = pytest.importorskip("websockets.sync.client").connect

from websockets.exceptions import InvalidStatus  # noqa: E402

from florence_bt.app.recording import foxglove_port  # noqa: E402
from florence_bt.app.recording.foxglove_port import MOST_FOXGLOVES, PROTOCOLS, FoxglovePort, _Viewer  # noqa: E402
from florence_bt.core.errors import ConfigError  # noqa: E402

PATIENCE_S = 60.0
WEB = "https://app.foxglove.dev"


class Robot:
    """Shows one topic at a port, and notes who looks."""

    def __init__(self, *origins: str) -> None:
        with socket.socket() as server:
            server.bind(("127.0.0.1", 0))
            self.port: int = server.getsockname()[1]
        self.looked: list[tuple[int, int]] = []
        self.shown = FoxglovePort(
            self.port, origins, lambda channel, more: self.looked.append((channel, more))
        )
        self.shown.advertise(3, "/words", "std_msgs/msg/String", "string data")

    def visit(self, **options: Any) -> Any:
        return connect(f"ws://127.0.0.1:{self.port}", subprotocols=list(PROTOCOLS[:1]), **options)


@pytest.fixture
def robots() -> Iterator[Callable[..., Robot]]:
    """Makes robots, and ends them."""
    with ExitStack() as ends:

        def make(*origins: str) -> Robot:
            robot = Robot(*origins)
            ends.callback(robot.shown.close)
            return robot

        yield make


def hear(client: Any, wanted: str) -> dict[str, Any]:
    """Return the next thing of a kind that is said."""
    while True:
        said = client.recv(timeout=PATIENCE_S)
        if isinstance(said, str) and (told := json.loads(said))["op"] == wanted:
            return dict(told)


def wait_for(condition: Callable[[], Any]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def subscribe(client: Any, *pairs: tuple[int, int]) -> None:
    wanted = [{"id": number, "channelId": channel} for number, channel in pairs]
    client.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


def test_a_web_site_gets_in_only_when_it_was_let_in(
    robots: Callable[..., Robot], capfd: pytest.CaptureFixture[str]
) -> None:
    shut, open_to = robots(), robots(WEB)
    for origin in (WEB, "http://evil.example", "null", f"http://127.0.0.1:{shut.port + 1}"):
        with pytest.raises(InvalidStatus) as refused:
            shut.visit(origin=origin)
        assert refused.value.response.status_code == 403
        assert b"foxglove_origins" in refused.value.response.body
    assert f"({WEB})" in capfd.readouterr().err, "a browser shows nobody why"
    with pytest.raises(InvalidStatus):
        shut.visit(additional_headers={"Sec-Fetch-Site": "cross-site"})
    for robot, origin in ((shut, None), (shut, "file://"), (open_to, WEB), (open_to, "file://")):
        with robot.visit(origin=origin) as client:
            assert hear(client, "advertise")["channels"][0]["topic"] == "/words"


@pytest.mark.parametrize("origin", ["*", "app.foxglove.dev", "https://a b", "https://x/path", ""])
def test_what_is_no_origin_is_told(origin: str) -> None:
    with pytest.raises(ConfigError, match="not an origin"):
        FoxglovePort(0, [origin], lambda channel, more: None)


def test_a_topic_is_sent_to_who_looks_at_it_and_to_nobody_else(robots: Callable[..., Robot]) -> None:
    robot = robots()
    with robot.visit() as client, robot.visit() as other:
        info = hear(client, "serverInfo")
        assert info["name"] == "Florence" and info["capabilities"] == []
        channel = hear(client, "advertise")["channels"][0]
        assert (channel["schemaName"], channel["schemaEncoding"]) == ("std_msgs/msg/String", "ros2msg")
        subscribe(client, (7, 3))
        wait_for(lambda: robot.looked == [(3, 1)])
        robot.shown.show(3, 5_000_000_000, b"hello")
        assert client.recv(timeout=PATIENCE_S) == struct.pack("<BIQ", 1, 7, 5_000_000_000) + b"hello"
        robot.shown.advertise(4, "/later", "std_msgs/msg/String", "string data")
        assert hear(client, "advertise")["channels"][0]["id"] == 4
        client.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [7, 8]}))
        wait_for(lambda: robot.looked == [(3, 1), (3, -1)])
        hear(other, "advertise")
        subscribe(other, (1, 4))
        wait_for(lambda: robot.looked[-1] == (4, 1))
    wait_for(lambda: robot.looked[-1] == (4, -1))


@pytest.mark.parametrize(
    "said",
    [
        *("nonsense", "", "null", "[]", "42", '{"op":1}', '{"op":"subscribe"}', "[" * 100_000, "1" * 5_000),
        *('{"op":"subscribe","subscriptions":[1]}', '{"op":"subscribe","subscriptions":[{"id":1}]}'),
        '{"op":"subscribe","subscriptions":[{"id":-1,"channelId":3}]}',
        '{"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":3}]}',
        '{"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]}',
        '{"op":"subscribe","subscriptions":[{"id":"x","channelId":[3]}]}',
        '{"op":"unsubscribe","subscriptionIds":[[1]]} x',
        '{"op":"advertise","channels":[]}',
        b"\x01\x00\x00",
    ],
)
def test_nonsense_is_answered_and_nothing_is_looked_at(robots: Callable[..., Robot], said: Any) -> None:
    robot = robots()
    with robot.visit() as client:
        client.send(said)
        assert hear(client, "status")["level"] in (1, 2)
        assert not robot.looked
        subscribe(client, (1, 3))
        wait_for(lambda: robot.looked == [(3, 1)])


def test_one_looks_at_a_topic_once_and_not_without_end(
    robots: Callable[..., Robot], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(foxglove_port, "MOST_SUBSCRIPTIONS", 1)
    robot = robots()
    robot.shown.advertise(4, "/more", "std_msgs/msg/String", "string data")
    with robot.visit() as client:
        subscribe(client, (1, 3), (1, 3), (2, 3), (3, 4))
        assert [hear(client, "status")["level"] for _ in range(3)] == [1, 1, 1]
        assert robot.looked == [(3, 1)]


def test_so_many_may_look_and_the_next_is_told(robots: Callable[..., Robot]) -> None:
    robot = robots()
    with ExitStack() as viewers:
        for _ in range(MOST_FOXGLOVES):
            hear(viewers.enter_context(robot.visit()), "serverInfo")
        with pytest.raises(InvalidStatus) as refused:
            robot.visit()
        assert refused.value.response.status_code == 503
    with pytest.raises(InvalidStatus) as refused:
        connect(f"ws://127.0.0.1:{robot.port}", subprotocols=["mqtt"])
    assert b"foxglove.sdk.v1" in refused.value.response.body


def test_a_viewer_that_is_too_slow_misses_the_oldest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foxglove_port, "MOST_WAITING", 3)
    monkeypatch.setattr(foxglove_port, "MOST_WAITING_BYTES", 100)
    sent: list[Any] = []

    async def send(message: Any) -> None:
        sent.append(message.get("bytes") or message["text"])

    async def watch() -> None:
        viewer = _Viewer()
        viewer.say({"op": "serverInfo"})
        for number in range(10):
            viewer.show(bytes([number]))
        sending = asyncio.create_task(viewer.send_all(send))
        await asyncio.sleep(0)
        viewer.show(b"x" * 60)
        viewer.show(b"y" * 60)
        viewer.show(b"z" * 200)
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        sending.cancel()

    asyncio.run(watch())
    assert sent == ['{"op": "serverInfo"}', b"\x07", b"\x08", b"\x09", b"z" * 200]
