"""The addresses of the editor: its page, the stream and the map of its rig, and completion."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from fastapi import FastAPI, HTTPException, Request, Response, WebSocket
from fastapi.responses import RedirectResponse
from nicegui import app as pages
from nicegui import ui
from pydantic import BaseModel, Field

from florence_bt.app.guard.log import Seldom
from florence_bt.core.errors import FlorenceError
from florence_bt.core.text_files import MAX_MISSION_BYTES
from florence_page.access import ROLE, Role
from florence_page.acting import Actor
from florence_page.components import RECONNECT_S
from florence_page.editor.completion import complete
from florence_page.editor.desk import Desk
from florence_page.editor.view import EditorPage
from florence_page.ros_thread import RosThread
from florence_page.viewers import Viewers

WORDS = "/edit/complete"
"""Gives words while somebody types."""
REFUSED = "the editor needs a token with the role edit: florence page --token edit"

RESPONSE_S = 20.0
"""Longest until the page of a viewer is made."""


class WordsWanted(BaseModel):
    """A place in a text where words are wanted; line and column count from 1."""

    text: Annotated[str, Field(max_length=MAX_MISSION_BYTES)]
    line: Annotated[int, Field(ge=1, le=MAX_MISSION_BYTES)]
    column: Annotated[int, Field(ge=1, le=MAX_MISSION_BYTES)]


def add_editor(app: FastAPI, ros: RosThread, folders: Sequence[Path]) -> None:
    """Add the editor to the application of the page.

    Args:
        app: The application.
        ros: Talks to the robot.
        folders: Folders of missions, the last one to be written to; empty takes those of the robot.
    """
    desk = Desk(ros, folders)
    viewers = Viewers(desk.trials.parts, Seldom(ros.node.get_logger().info))
    pages.on_shutdown(desk.close)

    @app.get("/edit")
    async def edit() -> Response:
        return RedirectResponse("/edit/")

    @app.websocket("/edit/live")
    async def live(socket: WebSocket) -> None:
        if not _may_edit(socket.scope):
            await socket.close(1008, REFUSED)
            return
        await viewers.serve(socket)

    @app.get("/edit/picture/map")
    async def picture(request: Request) -> Response:
        if not _may_edit(request.scope):
            raise HTTPException(403, REFUSED)
        if not desk.trials.picture:
            raise HTTPException(404, "nothing was tried yet")
        return Response(desk.trials.picture, media_type="image/png", headers={"cache-control": "no-cache"})

    @app.post(WORDS)
    async def words(asked: WordsWanted, request: Request) -> dict[str, Any]:
        if not _may_edit(request.scope):
            raise HTTPException(403, REFUSED)
        if not desk.words:
            return {"from": asked.column, "options": []}
        return complete(asked.text, asked.line, asked.column, desk.words)

    @ui.page("/edit/", response_timeout=RESPONSE_S, reconnect_timeout=RECONNECT_S)
    async def editor(request: Request) -> None:
        await show(request, "", "")

    @ui.page("/edit/{name}", response_timeout=RESPONSE_S, reconnect_timeout=RECONNECT_S)
    async def one(request: Request, name: str, template: str = "") -> None:
        await show(request, name, template)

    async def show(request: Request, name: str, template: str) -> None:
        if not _may_edit(request.scope):
            ui.label(REFUSED).classes("m-4")
            return
        try:
            EditorPage(desk, Actor(ros, Role.EDIT), await desk.home(), name, template)
        except FlorenceError as error:
            ui.label(str(error)).classes("m-4 text-red-700")
            ui.link("to the missions", "/edit/").classes("m-4")


def _may_edit(scope: Any) -> bool:
    return bool(scope.get(ROLE, Role.LOOK) >= Role.EDIT)
