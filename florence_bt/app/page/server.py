"""The server of the page: the live stream for every viewer, pictures, and the page itself."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI, HTTPException, Response, WebSocket, WebSocketDisconnect

from florence_bt.app.page.access import LARGEST_REQUEST, ROLE, Access, Guard, Role, address_of, check_page
from florence_bt.app.page.layout import add_page
from florence_bt.app.page.node import CAMERA, SCENE, WANTS, PageNode
from florence_bt.app.page.ros_thread import RosThread

FRAME_S = 0.1
"""Seconds between two frames for a viewer, at least."""
ANSWER_S = 20.0
"""A viewer that has not taken a frame for so long is left alone."""
MOST_VIEWERS = 50
MOST_MESSAGES = 100
"""Messages of a viewer in a second; one that sends more is left alone."""
LONGEST_WORDS = 200
"""Characters of a message that are read."""
SHUT_DOWN_S = 2
"""Seconds that viewers get to leave when the page ends."""


class Viewers:
    """Sends each viewer what has changed, when it has taken what came before: the newest state wins.

    The node hears what comes often only while there is a viewer.
    """

    def __init__(self, ros: RosThread) -> None:
        self._ros = ros
        self._wants: dict[WebSocket, frozenset[str]] = {}

    async def serve(self, socket: WebSocket) -> None:
        """Serve one viewer until it leaves."""
        if len(self._wants) >= MOST_VIEWERS:
            await socket.close(1013, f"{MOST_VIEWERS} viewers are here already")
            return
        await socket.accept()
        self._set_wants(socket, frozenset({SCENE}))
        try:
            await self._send_all(socket, self._ros.node)
        except (WebSocketDisconnect, TimeoutError, RuntimeError) as error:
            # It has left, maybe amid a frame, or takes nothing: others are not concerned.
            self._ros.node.get_logger().info(f"a viewer is gone: {error!r}")
        finally:
            del self._wants[socket]
            self._look()
            self._ros.on_thread(lambda: self._ros.driving.let_go(socket))

    async def _send_all(self, socket: WebSocket, node: PageNode) -> None:
        taken = asyncio.Event()
        listening = asyncio.create_task(self._listen(socket, taken))
        seen: dict[str, int] = {}
        try:
            while not listening.done():
                frame, seen = node.parts.since(seen)
                if frame:
                    taken.clear()
                    await asyncio.wait_for(socket.send_text(frame), ANSWER_S)
                    done = asyncio.create_task(taken.wait())
                    await asyncio.wait(
                        {listening, done}, timeout=ANSWER_S, return_when=asyncio.FIRST_COMPLETED
                    )
                    if not done.done():
                        done.cancel()
                        return
                await asyncio.wait({listening}, timeout=FRAME_S)
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)

    async def _listen(self, socket: WebSocket, taken: asyncio.Event) -> None:
        """Note that a viewer has taken a frame, and heed what else it says, until it leaves or floods us."""
        begun, count = time.monotonic(), 0
        while count < MOST_MESSAGES:
            text = await socket.receive_text()
            if time.monotonic() >= begun + 1.0:
                begun, count = time.monotonic(), 0
            count += 1
            if text == "ok":
                taken.set()
            else:
                self._heed(socket, text[:LONGEST_WORDS].split())

    def _heed(self, socket: WebSocket, words: list[str]) -> None:
        """Do what a viewer says; what is none of these, or not its to say, is passed over."""
        driving = self._ros.driving
        match words:
            case ["want", *names]:
                self._set_wants(socket, WANTS.intersection(names))
            case ["drive", forward, left] if (
                _may_drive(socket) and (push := _push(forward, left)) is not None
            ):
                self._ros.on_thread(lambda: driving.push(socket, *push))
            case ["speed", key] if _may_drive(socket):
                self._ros.on_thread(lambda: driving.step(socket, key))

    def _set_wants(self, socket: WebSocket, wants: frozenset[str]) -> None:
        self._wants[socket] = wants
        self._look()

    def _look(self) -> None:
        self._ros.look(frozenset().union(*self._wants.values()))


def _may_drive(socket: WebSocket) -> bool:
    return bool(socket.scope.get(ROLE, Role.LOOK) >= Role.RUN)


def _push(forward: str, left: str) -> tuple[float, float] | None:
    """Return where a hand is, -1 to 1 each; None when that is not what the texts say."""
    try:
        values = float(forward), float(left)
    except ValueError:
        return None
    return values if all(-1.0 <= value <= 1.0 for value in values) else None


def make_app(ros: RosThread, access: Access, runs: Path | None = None) -> Any:
    """Make the ASGI application; see :func:`serve_page`."""
    app = FastAPI(title="Florence", docs_url=None, redoc_url=None, openapi_url=None)
    viewers = Viewers(ros)

    @app.websocket("/live")
    async def live(socket: WebSocket) -> None:
        await viewers.serve(socket)

    @app.get("/picture/{name}")
    async def picture(name: str) -> Response:
        data = ros.node.pictures.get(name)
        if data is None:
            raise HTTPException(404, f"no picture {name[:LONGEST_WORDS]!r} has come yet")
        kind = "image/jpeg" if name == CAMERA else "image/png"
        return Response(data, media_type=kind, headers={"cache-control": "private, max-age=3600"})

    add_page(app, ros, runs)
    return Guard(app, access)


def make_server(ros: RosThread, host: str, port: int, access: Access, runs: Path | None) -> uvicorn.Server:
    """Make the server of the page; see :func:`serve_page`."""
    return uvicorn.Server(
        uvicorn.Config(
            make_app(ros, access, runs),
            host=host,
            port=port,
            log_level="warning",
            ws_max_size=LARGEST_REQUEST,
            timeout_graceful_shutdown=SHUT_DOWN_S,
        )
    )


def serve_page(host: str, port: int, access: Access, runs: Path | None = None) -> None:
    """Serve the page until Ctrl-C.

    Args:
        host: The address to be bound.
        port: The TCP port.
        access: Who may do what.
        runs: The folder of the journal; None for that of the running system.

    Raises:
        ConfigError: Others could reach the page without a token, or the port is taken.
    """
    check_page(host, port, access)
    with RosThread() as ros:
        server = make_server(ros, host, port, access, runs)
        print(f"the page: {address_of(host, port)}; Ctrl-C ends it", flush=True)
        server.run()
