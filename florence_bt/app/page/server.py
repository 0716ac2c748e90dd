"""The server of the page: the live stream for every viewer, pictures, and the page itself."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI, HTTPException, Response, WebSocket, WebSocketDisconnect

from florence_bt.app.page.access import LARGEST_REQUEST, Access, Guard, is_loopback
from florence_bt.app.page.layout import add_page
from florence_bt.app.page.node import PageNode
from florence_bt.app.page.ros_thread import RosThread
from florence_bt.core.errors import ConfigError

FRAME_S = 0.1
"""Seconds between two frames for a viewer, at least."""
ANSWER_S = 20.0
"""A viewer that has not taken a frame for so long is left alone."""
MOST_VIEWERS = 50
SHUT_DOWN_S = 2
"""Seconds that viewers get to leave when the page ends."""


class Viewers:
    """Sends each viewer what has changed, when it has taken what came before: the newest state wins.

    The node hears what comes often only while there is a viewer.
    """

    def __init__(self, ros: RosThread) -> None:
        self._ros = ros
        self._count = 0

    async def serve(self, socket: WebSocket) -> None:
        """Serve one viewer until it leaves."""
        if self._count >= MOST_VIEWERS:
            await socket.close(1013, f"{MOST_VIEWERS} viewers are here already")
            return
        await socket.accept()
        self._add(1)
        try:
            await self._send_all(socket, self._ros.node)
        except (WebSocketDisconnect, TimeoutError, RuntimeError) as error:
            # It has left, maybe amid a frame, or takes nothing: others are not concerned.
            self._ros.node.get_logger().info(f"a viewer is gone: {error!r}")
        finally:
            self._add(-1)

    async def _send_all(self, socket: WebSocket, node: PageNode) -> None:
        taken = asyncio.Event()
        listening = asyncio.create_task(_listen(socket, taken))
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

    def _add(self, more: int) -> None:
        self._count += more
        self._ros.look(self._count > 0)


async def _listen(socket: WebSocket, taken: asyncio.Event) -> None:
    """Note that a viewer has taken its frame, until it leaves."""
    while True:
        await socket.receive_text()
        taken.set()


def make_app(ros: RosThread, access: Access, runs: Path | None = None) -> Any:
    """Make the ASGI application; see :func:`serve_page`."""
    app = FastAPI(title="Florence", docs_url=None, redoc_url=None, openapi_url=None)
    viewers = Viewers(ros)

    @app.websocket("/live")
    async def live(socket: WebSocket) -> None:
        await viewers.serve(socket)

    @app.get("/picture/{name}.png")
    async def picture(name: str) -> Response:
        data = ros.node.pictures.get(name)
        if data is None:
            raise HTTPException(404, f"no picture {name!r} has come yet")
        return Response(data, media_type="image/png", headers={"cache-control": "private, max-age=3600"})

    add_page(app, ros, runs)
    return Guard(app, access)


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
    if not is_loopback(host) and not access.tokens:
        raise ConfigError(
            f"with --host {host} anybody on the network could drive the robot: the page needs tokens there",
            valid=["florence page --token run", "--host 127.0.0.1"],
        )
    with RosThread() as ros:
        settings = uvicorn.Config(
            make_app(ros, access, runs),
            host=host,
            port=port,
            log_level="warning",
            ws_max_size=LARGEST_REQUEST,
            timeout_graceful_shutdown=SHUT_DOWN_S,
        )
        server = uvicorn.Server(settings)
        print(
            f"the page: http://{'localhost' if is_loopback(host) else host}:{port}; Ctrl-C ends it",
            flush=True,
        )
        try:
            server.run()
        except SystemExit:
            raise ConfigError(f"the port {port} cannot be used", valid=["another one, with --port"]) from None
