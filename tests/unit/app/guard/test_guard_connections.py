"""A server behind bounded connections: who dawdles makes room, who asks at once is served."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from typing import Any

import pytest

pytest.importorskip("uvicorn")

from florence_bt.app.guard import connections
from florence_bt.app.guard.connections import make_server
from florence_bt.app.guard.guard import Guard, NoTokens
from florence_bt.app.guard.rules import SHIELD

PATIENCE_S = 60.0
SOON_S = 0.3
GOOD = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"
HEAD_ALONE = b"GET / HTTP/1.1\r\nHost: local"
BODY_ALONE = b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 10\r\n\r\n12345"


async def application(scope: Any, receive: Any, send: Any) -> None:
    """Take the whole request, and answer."""
    if scope["type"] != "http":
        return
    while True:
        message = await receive()
        if message["type"] == "http.disconnect":
            return
        if not message.get("more_body"):
            break
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


@pytest.fixture
def port() -> Iterator[int]:
    """The port of a server that has begun."""
    listening = socket.create_server(("127.0.0.1", 0))
    server = make_server(Guard(application, NoTokens()), "127.0.0.1", 0)
    server.config.timeout_keep_alive = round(PATIENCE_S)  # a busy machine may take the default of 5 s
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    try:
        yield int(listening.getsockname()[1])
    finally:
        server.should_exit = True
        thread.join(PATIENCE_S)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a request have little time."""
    monkeypatch.setattr(connections, "HEAD_S", SOON_S)
    monkeypatch.setattr(connections, "BODY_S", SOON_S)


def connect(port: int) -> closing[socket.socket]:
    return closing(socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S))


def answer(peer: socket.socket) -> bytes:
    """Give what comes until the end of an answer, or of the connection."""
    got = b""
    with contextlib.suppress(ConnectionError):
        while not got.endswith(b"ok") and (more := peer.recv(65_536)):
            got += more
    return got


def is_shut(peer: socket.socket) -> bool:
    """Wait until the server has ended a connection."""
    with contextlib.suppress(ConnectionError):
        return not peer.recv(65_536)
    return True


@pytest.mark.parametrize("begun", [b"", b"G", HEAD_ALONE, BODY_ALONE])
def test_who_does_not_finish_a_request_is_sent_away(quick: None, port: int, begun: bytes) -> None:
    with connect(port) as peer:
        peer.sendall(begun)
        assert is_shut(peer)


def test_more_bytes_give_no_more_time(quick: None, port: int) -> None:
    with connect(port) as peer:
        begin = time.monotonic()
        peer.settimeout(0.01)
        peer.sendall(b"GET / HTTP/1.1\r\nX: ")
        shut = False
        while not shut and time.monotonic() < begin + PATIENCE_S:
            with contextlib.suppress(TimeoutError):
                try:
                    peer.sendall(b"x")
                    shut = not peer.recv(1)
                except ConnectionError:
                    shut = True
        assert shut


def test_the_second_request_of_a_connection_has_its_time_too(quick: None, port: int) -> None:
    with connect(port) as peer:
        peer.sendall(GOOD)
        assert answer(peer).endswith(b"ok")
        peer.sendall(HEAD_ALONE)
        assert is_shut(peer)


def test_a_request_in_pieces_and_two_at_once_are_served(port: int) -> None:
    with connect(port) as peer:
        for byte in GOOD:
            peer.sendall(bytes([byte]))
        assert answer(peer).endswith(b"ok")
        peer.sendall(GOOD + GOOD)
        got = answer(peer)
        while got.count(b"HTTP/1.1 200") < 2:
            got += answer(peer)


def test_many_who_ask_for_nothing_make_room_for_one_who_asks(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connections, "MOST_CONNECTIONS", 20)
    with ExitStack() as crowd:
        peers = [crowd.enter_context(connect(port)) for _ in range(20)]
        for peer in peers:
            peer.sendall(HEAD_ALONE)
        with connect(port) as viewer:
            viewer.sendall(GOOD)
            assert answer(viewer).endswith(b"ok")
            assert is_shut(peers[0]), "the oldest went"
            for _ in range(40):
                peers.append(crowd.enter_context(connect(port)))
                peers[-1].sendall(HEAD_ALONE)
            assert is_shut(peers[1])
            viewer.sendall(GOOD)
            assert answer(viewer).endswith(b"ok"), "who has asked stays when others dawdle"


def test_the_address_with_most_connections_makes_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "MOST_CONNECTIONS", 3)

    class Held:
        def __init__(self, address: str, since: float) -> None:
            self.address, self.since, self.waiting = address, since, connections.Waiting.HEAD
            self.is_open, self.transport = True, self

        def abort(self) -> None:
            self.is_open = False

    alone = Held("10.0.0.1", 0.0)
    crowd = [Held("10.0.0.2", 1.0 + number) for number in range(3)]
    connections._make_room([alone, *crowd])  # type: ignore[list-item]
    assert [each.is_open for each in (alone, *crowd)] == [True, False, True, True]


@pytest.mark.parametrize(
    "bad",
    [
        b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n",
        b"GET / HTTP/1.1\r\n\r\n",
        b"\r\n",
        b"GET /\xff HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nX: a\x00b\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\n X: folded\r\n" + b"Y" * 100 + b"\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\nx",
        b"POST / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: gzip, chunked\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"x" * 100_000,
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    ],
)
def test_what_is_no_http_is_refused_with_the_headers_of_every_answer(port: int, bad: bytes) -> None:
    with connect(port) as peer:
        peer.sendall(bad)
        got = b""
        with contextlib.suppress(ConnectionError):
            while more := peer.recv(65_536):
                got += more
    assert got.startswith(b"HTTP/1.1 4")
    assert all(name + b": " + value in got for name, value in SHIELD.items())


def test_an_old_request_without_a_host_is_refused(port: int) -> None:
    with connect(port) as peer:
        peer.sendall(b"GET / HTTP/1.0\r\n\r\n")
        assert b" 403 " in peer.recv(65_536)
