"""The server of the page: the live stream for every viewer, pictures, and the page itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI, HTTPException, Response, WebSocket

from florence_bt.app.page.access import LARGEST_REQUEST, Access, Guard, is_loopback
from florence_bt.app.page.editor.routes import add_editor
from florence_bt.app.page.layout import add_page
from florence_bt.app.page.ros_thread import RosThread
from florence_bt.app.page.viewers import Viewers
from florence_bt.core.errors import ConfigError

SHUT_DOWN_S = 2
"""Seconds that viewers get to leave when the page ends."""


def make_app(ros: RosThread, access: Access, missions: Sequence[Path] = ()) -> Any:
    """Make the ASGI application.

    Args:
        ros: Talks to the robot.
        access: Who may do what.
        missions: Folders of missions for the editor, the last one to be written to; empty takes those of
            the robot.
    """
    app = FastAPI(title="Florence", docs_url=None, redoc_url=None, openapi_url=None)
    viewers = Viewers(ros.node.parts, ros.look, ros.node.get_logger().info)

    @app.websocket("/live")
    async def live(socket: WebSocket) -> None:
        await viewers.serve(socket)

    @app.get("/picture/{name}.png")
    async def picture(name: str) -> Response:
        data = ros.node.pictures.get(name)
        if data is None:
            raise HTTPException(404, f"no picture {name!r} has come yet")
        return Response(data, media_type="image/png", headers={"cache-control": "private, max-age=3600"})

    add_editor(app, ros, missions)
    add_page(app, ros)
    return Guard(app, access)


def serve_page(host: str, port: int, access: Access, missions: Sequence[Path] = ()) -> None:
    """Serve the page until Ctrl-C.

    Args:
        host: The address to be bound.
        port: The TCP port.
        access: Who may do what.
        missions: Folders of missions for the editor.

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
            make_app(ros, access, missions),
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
