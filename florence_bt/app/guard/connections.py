"""The server behind every guarded port, and what a connection may take before it has asked for anything.

uvicorn has no limit for the time to a whole request, and refuses the newest when there are too many. Here
who is slow, or holds many connections and uses none, loses one to the next who comes: whoever asks at once
is served, however many others do nothing.
"""

from __future__ import annotations

import asyncio
import enum
from collections import Counter
from typing import Any

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from florence_bt.app.guard.log import bound_logs
from florence_bt.app.guard.rules import LARGEST_REQUEST, SHIELD

HEAD_S, BODY_S = 5.0, 20.0
"""Seconds for the head of a request, from the connection or its first byte on, and for its body."""
LONGEST_HEAD = 32_768
"""Bytes of a request's line and headers."""
MOST_CONNECTIONS = 300
"""Connections of HTTP at once, of all: 50 viewers with six each. WebSockets are counted by the guard."""
BACKLOG = 256
"""So many connections are taken at once: those above the bound are open until the next look."""
SHUT_DOWN_S = 2
"""Seconds that viewers get to leave when the server ends."""


class Waiting(enum.IntEnum):
    """The things that a connection waits for; those that are worth least come first."""

    HEAD = 0
    BODY = 1
    NEXT = 2
    ANSWER = 3


class BoundedProtocol(H11Protocol):
    """HTTP of uvicorn with a time for each request, and room for the next who comes."""

    _clock: asyncio.TimerHandle | None = None
    waiting: Waiting | None = None
    since: float = 0.0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for the first request; whoever has waited longest without one makes room."""
        super().connection_made(transport)
        self._wait_for(Waiting.HEAD)
        _make_room([each for each in self.connections if isinstance(each, BoundedProtocol)])

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        self._stop_clock()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take what came, and look how far the request is."""
        super().data_received(data)
        self._look()

    def on_response_complete(self) -> None:
        """Look whether the next request has begun."""
        super().on_response_complete()
        self._look()

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP, with the headers of every answer, and leave; amid an answer only leave."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            body = f"{msg}\n".encode()
            headers = [*SHIELD.items(), (b"connection", b"close"), (b"content-type", b"text/plain")]
            length = (b"content-length", str(len(body)).encode())
            answer = h11.Response(status_code=400, headers=[*headers, length], reason=b"Bad Request")
            self.transport.write(self.conn.send(answer) + self.conn.send(h11.Data(data=body)))
        self.transport.close()

    @property
    def is_open(self) -> bool:
        """Tell whether it holds a place."""
        return self.transport is not None and not self.transport.is_closing()

    @property
    def address(self) -> str:
        """Name who is at the other end."""
        return self.client[0] if self.client else ""

    def _look(self) -> None:
        if self.transport.get_protocol() is not self:  # it is a WebSocket now
            self._stop_clock()
            return
        state = self.conn.their_state
        if state is h11.SEND_BODY:
            self._wait_for(Waiting.BODY)
        elif state is not h11.IDLE:
            self._wait_for(Waiting.ANSWER)
        elif self.cycle is None or self.conn.trailing_data[0]:
            self._wait_for(Waiting.HEAD)
        else:
            self._wait_for(Waiting.NEXT)

    def _wait_for(self, what: Waiting) -> None:
        """Give who has begun something its time; more bytes of it give no more time."""
        if what is self.waiting:
            return
        self._stop_clock()
        self.waiting, self.since = what, self.loop.time()
        if what in (Waiting.HEAD, Waiting.BODY):
            seconds = HEAD_S if what is Waiting.HEAD else BODY_S
            self._clock = self.loop.call_later(seconds, self.transport.close)

    def _stop_clock(self) -> None:
        if self._clock is not None:
            self._clock.cancel()
            self._clock = None


def _make_room(connections: list[BoundedProtocol]) -> None:
    """End a connection when there are too many: of the address that has most, the one that is worth least."""
    held = [each for each in connections if each.is_open]
    if len(held) <= MOST_CONNECTIONS:
        return
    of_one = Counter(each.address for each in held)
    most = max(of_one.values())
    crowd = [each for each in held if of_one[each.address] == most]
    min(crowd, key=lambda each: (each.waiting, each.since)).transport.abort()


def make_server(app: Any, host: str, port: int, *, compress: bool = True) -> uvicorn.Server:
    """Make the server of a guarded application.

    Args:
        app: The application of ASGI, a :class:`~florence_bt.app.guard.guard.Guard`.
        host: The address that is bound.
        port: The TCP port.
        compress: Whether messages of WebSockets are compressed.
    """
    bound_logs()
    return uvicorn.Server(
        uvicorn.Config(
            app,
            host=host,
            port=port,
            http=BoundedProtocol,
            log_config=None,
            log_level="warning",
            access_log=False,
            server_header=False,
            ws_max_size=LARGEST_REQUEST,
            ws_per_message_deflate=compress,
            h11_max_incomplete_event_size=LONGEST_HEAD,
            backlog=BACKLOG,
            timeout_graceful_shutdown=SHUT_DOWN_S,
        )
    )
