"""The port at which Foxglove finds the robot: its WebSocket protocol, behind the guard of the page.

The server of foxglove-sdk 0.30 lets any web site in, and takes no function that could look at a request;
the protocol that a robot without parameters and services needs is small. Source: Foxglove WebSocket
protocol, version 1
(https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md).
"""

from __future__ import annotations

import asyncio
import json
import re
import socket
import struct
import threading
import time
from collections import deque
from collections.abc import Awaitable, Callable, Iterable, Mapping
from typing import Any

from florence_bt.app.guard.guard import Guard, NoTokens
from florence_bt.core.errors import ConfigError

PROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
DESKTOP = "file://"
"""The origin of Foxglove's desktop application, whose page is a file."""
MOST_FOXGLOVES = 10
MOST_OF_FOXGLOVE = 1_000
"""Messages that a viewer may send in a second: a layout that is loaded asks for each topic by itself."""
MOST_SUBSCRIPTIONS = 1_000
MOST_WAITING, MOST_WAITING_BYTES = 1_024, 32_000_000
"""Messages for a viewer that takes them too slowly; then the oldest ones are left out."""
END_S = 5.0
"""Wall seconds until the server has ended."""
_MESSAGE = struct.Struct("<BIQ")
"""Head of a message: opcode 1, subscription, time in nanoseconds."""
_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://[a-z0-9.:\[\]_-]*", re.IGNORECASE)
_WARNING, _ERROR = 1, 2
"""Levels of a status in the protocol of Foxglove's WebSocket."""

Send = Callable[[Mapping[str, Any]], Awaitable[None]]


def check_origins(origins: Iterable[str]) -> frozenset[str]:
    """Return the origins that are let in, besides that of the desktop application.

    Raises:
        ConfigError: One is none.
    """
    for each in origins:
        if not _ORIGIN.fullmatch(each):
            raise ConfigError(f"{each!r} is not an origin", valid=["https://app.foxglove.dev"])
    return frozenset({DESKTOP, *(each.lower() for each in origins)})


def bind(port: int) -> socket.socket:
    """Take a port of this machine.

    Raises:
        ConfigError: It cannot be had.
    """
    try:
        return socket.create_server(("127.0.0.1", port))
    except OSError as error:
        problem = f"Foxglove's port {port} cannot be used: {error.strerror}"
        raise ConfigError(problem, valid=["another port"]) from error


class FoxglovePort:
    """Shows topics to Foxglove, on a thread of its own; its methods may be called from any other.

    Args:
        port: The TCP port of 127.0.0.1.
        origins: Web sites that may look, too, such as ``https://app.foxglove.dev``.
        look: Called with the id of a channel, and 1 when somebody begins to look at it, -1 when they cease.

    Raises:
        ConfigError: The port is taken, or an origin is none.
    """

    def __init__(self, port: int, origins: Iterable[str], look: Callable[[int, int], object]) -> None:
        from florence_bt.app.guard.connections import make_server  # files need no server

        hint = f"; the parameter foxglove_origins of the recorder lets them in, besides {DESKTOP}"
        guard = Guard(
            self._serve, NoTokens(), origins=check_origins(origins), hint=hint, most_messages=MOST_OF_FOXGLOVE
        )
        self._look = look
        self._channels: dict[int, dict[str, Any]] = {}
        self._viewers: set[_Viewer] = set()
        self._session = str(time.time_ns())
        self._socket = bind(port)
        self._server = make_server(guard, "127.0.0.1", port, compress=False)
        self._loop = asyncio.new_event_loop()
        self._lock = threading.Lock()
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="Foxglove", daemon=True)
        self._thread.start()

    def advertise(self, channel: int, topic: str, type_name: str, schema: str) -> None:
        """Offer a topic.

        Args:
            channel: Its id.
            topic: Its name.
            type_name: Its type, such as ``sensor_msgs/msg/LaserScan``.
            schema: The definition of the type, in the form ``ros2msg``.
        """
        entry = {
            "id": channel,
            "topic": topic,
            "encoding": "cdr",
            "schemaName": type_name,
            "schema": schema,
            "schemaEncoding": "ros2msg",
        }
        self._soon(self._add, entry)

    def show(self, channel: int, time_ns: int, serialised: bytes) -> None:
        """Show a message to those who look at its topic."""
        self._soon(self._pass_on, channel, time_ns, serialised)

    def close(self) -> None:
        """Send the viewers away, and end."""
        with self._lock:
            self._ended = True
        self._server.should_exit = True
        self._thread.join(END_S)

    # ---- on the thread of the server ------------------------------------------------------------------

    def _soon(self, call: Callable[..., object], *arguments: object) -> None:
        with self._lock:
            if not self._ended:
                self._loop.call_soon_threadsafe(call, *arguments)

    def _run(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            runner.run(self._server.serve(sockets=[self._socket]))

    def _add(self, entry: dict[str, Any]) -> None:
        self._channels[entry["id"]] = entry
        for viewer in self._viewers:
            viewer.say({"op": "advertise", "channels": [entry]})

    def _pass_on(self, channel: int, time_ns: int, serialised: bytes) -> None:
        for viewer in self._viewers:
            subscription = viewer.looks_at(channel)
            if subscription is not None:
                viewer.show(_MESSAGE.pack(1, subscription, time_ns) + serialised)

    async def _serve(self, scope: Mapping[str, Any], receive: Any, send: Send) -> None:
        """Serve one viewer until it leaves; what is no WebSocket is told what this is for."""
        if scope["type"] == "lifespan":
            return
        if scope["type"] == "http":
            await _refuse(send, "http.response", 426, "this port is for Foxglove: open ws://localhost there")
            return
        protocol = next((each for each in PROTOCOLS if each in scope["subprotocols"]), None)
        if protocol is None:
            await _refuse(send, "websocket.http.response", 400, f"this speaks {' and '.join(PROTOCOLS)}")
            return
        if len(self._viewers) >= MOST_FOXGLOVES:
            await _refuse(send, "websocket.http.response", 503, f"{MOST_FOXGLOVES} viewers are here already")
            return
        await receive()
        await send({"type": "websocket.accept", "subprotocol": protocol})
        await self._entertain(_Viewer(), receive, send)

    async def _entertain(self, viewer: _Viewer, receive: Any, send: Send) -> None:
        viewer.say(
            {
                "op": "serverInfo",
                "name": "Florence",
                "capabilities": [],
                "supportedEncodings": [],
                "metadata": {},
                "sessionId": self._session,
            }
        )
        viewer.say({"op": "advertise", "channels": list(self._channels.values())})
        self._viewers.add(viewer)
        sending = asyncio.create_task(viewer.send_all(send))
        try:
            while (message := await receive())["type"] == "websocket.receive":
                self._heed(viewer, message.get("text"))
        finally:
            self._viewers.discard(viewer)
            sending.cancel()
            await asyncio.gather(sending, return_exceptions=True)
            for channel in viewer.leave():
                self._look(channel, -1)

    def _heed(self, viewer: _Viewer, text: str | None) -> None:
        """Do what a viewer asks for; what cannot be done is answered."""
        try:
            match json.loads(text or ""):
                case {"op": "subscribe", "subscriptions": [*wanted]}:
                    for each in wanted:
                        self._subscribe(viewer, each)
                case {"op": "unsubscribe", "subscriptionIds": [*ids]}:
                    for each in ids:
                        channel = viewer.unsubscribe(each) if isinstance(each, int) else None
                        if channel is not None:
                            self._look(channel, -1)
                case _:
                    viewer.complain(_WARNING, "here one can subscribe and unsubscribe, and nothing else")
        except (ValueError, RecursionError):
            viewer.complain(_ERROR, "this is not JSON")

    def _subscribe(self, viewer: _Viewer, wanted: Any) -> None:
        match wanted:
            case {"id": int(number), "channelId": int(channel)} if (
                0 <= number < 2**32 and channel in self._channels
            ):
                if viewer.subscribe(number, channel):
                    self._look(channel, 1)
                else:
                    viewer.complain(_WARNING, "this is subscribed to already, or too much is")
            case _:
                viewer.complain(
                    _ERROR, "a subscription has an id, and the channelId of one that was advertised"
                )


class _Viewer:
    """A client of Foxglove: what it looks at, and what waits for it."""

    def __init__(self) -> None:
        self._channels: dict[int, int] = {}
        self._subscriptions: dict[int, int] = {}
        self._said: deque[str] = deque()
        self._shown: deque[bytes] = deque()
        self._bytes = 0
        self._waiting = asyncio.Event()

    def looks_at(self, channel: int) -> int | None:
        """Return its subscription to a channel; None when it does not look at that."""
        return self._subscriptions.get(channel)

    def subscribe(self, number: int, channel: int) -> bool:
        """Begin to look at a channel; gives whether it does so now and did not before."""
        full = len(self._channels) >= MOST_SUBSCRIPTIONS
        if full or number in self._channels or channel in self._subscriptions:
            return False
        self._channels[number] = channel
        self._subscriptions[channel] = number
        return True

    def unsubscribe(self, number: int) -> int | None:
        """Cease to look; gives at which channel."""
        channel = self._channels.pop(number, None)
        if channel is not None:
            del self._subscriptions[channel]
        return channel

    def leave(self) -> Iterable[int]:
        """Cease to look at anything; gives the channels that it has looked at."""
        left = list(self._subscriptions)
        self._subscriptions.clear()
        self._channels.clear()
        return left

    def say(self, what: Mapping[str, Any]) -> None:
        """Have something of the protocol sent; that is never left out."""
        self._said.append(json.dumps(what))
        self._waiting.set()

    def complain(self, level: int, why: str) -> None:
        """Say why something was not done, unless there is much to be said already."""
        if len(self._said) < MOST_WAITING:
            self.say({"op": "status", "level": level, "message": why})

    def show(self, message: bytes) -> None:
        """Have a message sent; when too much waits, the oldest are left out."""
        self._shown.append(message)
        self._bytes += len(message)
        while len(self._shown) > 1 and (len(self._shown) > MOST_WAITING or self._bytes > MOST_WAITING_BYTES):
            self._bytes -= len(self._shown.popleft())
        self._waiting.set()

    async def send_all(self, send: Send) -> None:
        """Send what waits, for as long as the viewer is there."""
        while True:
            await self._waiting.wait()
            self._waiting.clear()
            while self._said or self._shown:
                if self._said:
                    await send({"type": "websocket.send", "text": self._said.popleft()})
                    continue
                message = self._shown.popleft()
                self._bytes -= len(message)
                await send({"type": "websocket.send", "bytes": message})


async def _refuse(send: Send, kind: str, status: int, why: str) -> None:
    headers = [(b"content-type", b"text/plain; charset=utf-8")]
    await send({"type": f"{kind}.start", "status": status, "headers": headers})
    await send({"type": f"{kind}.body", "body": f"{why}\n".encode()})
