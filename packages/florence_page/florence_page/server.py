"""The server of the page: the live stream for every viewer, pictures, and the page itself."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from socket import socket
from typing import Any

import uvicorn
from fastapi import FastAPI, HTTPException, Response, WebSocket

from florence_bt.app.guard import connections
from florence_bt.app.guard.guard import Guard
from florence_bt.app.guard.log import Seldom
from florence_page.access import ROLE, Access, Role, address_of, check_page
from florence_page.editor.routes import WORDS, add_editor
from florence_page.frames import PARTS, URGENT, answer_plainly_what_is_not_there, problem_with
from florence_page.layout import add_page
from florence_page.node import CAMERA, SCENE, WANTS
from florence_page.presses import Press, add_presses
from florence_page.ros_thread import RosThread
from florence_page.viewers import LONGEST_WORDS, Viewers


class RobotViewers(Viewers):
    """Those who look at the robot: the node hears what comes often only while one of them wants to see it.

    Args:
        ros: Talks to the robot.
    """

    def __init__(self, ros: RosThread) -> None:
        super().__init__(ros.node.parts, Seldom(ros.node.get_logger().info))
        self._ros = ros
        self._wants: dict[WebSocket, frozenset[str]] = {}

    def joined(self, socket: WebSocket) -> None:
        """Show a viewer what comes often."""
        self._set_wants(socket, frozenset({SCENE}))

    def left(self, socket: WebSocket) -> None:
        """Hear less, and let go of the robot."""
        del self._wants[socket]
        self._look()
        self._ros.on_thread(lambda: self._ros.driving.let_go(socket))

    def heed(self, socket: WebSocket, words: list[str]) -> None:
        """Do what a viewer says; what is none of these, or not its to say, is passed over."""
        driving = self._ros.driving
        match words:
            case ["want", *names]:
                self._set_wants(socket, WANTS.intersection(names))
            case ["drive", forward, left, beat, age] if (
                _may_drive(socket)
                and (push := _push(forward, left)) is not None
                and (push == (0.0, 0.0) or Press.of_texts(beat, age).counts(time.monotonic()))
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


def make_app(ros: RosThread, access: Access, runs: Path | None = None, missions: Sequence[Path] = ()) -> Any:
    """Make the ASGI application; see :func:`serve_page`."""
    app = FastAPI(title="Florence", docs_url=None, redoc_url=None, openapi_url=None)
    viewers = RobotViewers(ros)

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

    add_presses(app, ros)
    add_editor(app, ros, missions)
    add_page(app, ros, runs)
    answer_plainly_what_is_not_there()
    return Guard(app, access, parts=PARTS, words=WORDS, urgent=URGENT, check=problem_with)


def make_server(
    ros: RosThread,
    host: str,
    port: int,
    access: Access,
    runs: Path | None,
    missions: Sequence[Path] = (),
) -> uvicorn.Server:
    """Make the server of the page; see :func:`serve_page`."""
    return connections.make_server(make_app(ros, access, runs, missions), host, port)


class _TellingServer(uvicorn.Server):
    """A server that says when it answers: from then on Ctrl-C ends it as it should."""

    def __init__(self, config: uvicorn.Config, ready: str) -> None:
        super().__init__(config)
        self._ready = ready

    async def startup(self, sockets: list[socket] | None = None) -> None:
        """Begin to answer, and say so."""
        await super().startup(sockets)
        if self.started:
            print(self._ready, flush=True)


def serve_page(
    host: str, port: int, access: Access, runs: Path | None = None, missions: Sequence[Path] = ()
) -> None:
    """Serve the page until Ctrl-C.

    Args:
        host: The address to be bound.
        port: The TCP port.
        access: Who may do what.
        runs: The folder of the journal; None for that of the running system.
        missions: Folders of missions for the editor, the last one to be written to; empty takes those of
            the robot.

    Raises:
        ConfigError: Others could reach the page without a token, or the port is taken.
    """
    check_page(host, port, access)
    with RosThread() as ros:
        server = make_server(ros, host, port, access, runs, missions)
        _TellingServer(server.config, f"the page: {address_of(host, port)}; Ctrl-C ends it").run()
