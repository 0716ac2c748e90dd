"""What is where on the page, and what its buttons do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request
from florence_interfaces.srv import PauseMission, ResumeMission, StopMission
from nicegui import core, ui

from florence_page.access import ROLE, Role
from florence_page.acting import Actor, soon
from florence_page.breakpoints import BreakpointControls
from florence_page.components import (
    ABOVE_BAR,
    RECONNECT_S,
    BreakpointBar,
    DrivePad,
    MapView,
    RobotBar,
    StatusView,
    TreeView,
)
from florence_page.history import add_history
from florence_page.map_menu import MapMenu
from florence_page.mission_form import choose_mission
from florence_page.question import QuestionCards
from florence_page.ros_thread import RosThread


def add_page(app: FastAPI, ros: RosThread, runs: Path | None) -> None:
    """Add the page and its history to an application.

    Args:
        app: The application.
        ros: Talks to the robot.
        runs: The folder of the journal; None for that of the running system.
    """

    @ui.page("/", reconnect_timeout=RECONNECT_S)
    def page(request: Request) -> None:
        Page(Actor(ros, request.scope.get(ROLE, Role.LOOK)))

    add_history(runs)
    # By WebSocket alone, as the live stream: long polling would be another way in, which nobody counts.
    core.app.config.socket_io_js_transports = ["websocket"]
    core.sio.eio.transports = ["websocket"]
    ui.run_with(app, title="Florence", show_welcome_message=False)


class Page:
    """The page of one viewer.

    Args:
        actor: Does what the viewer asks for.
    """

    def __init__(self, actor: Actor) -> None:
        self._actor = actor
        self._ros = actor.ros
        ui.query(".nicegui-content").classes(f"p-2 gap-2 w-full no-wrap {ABOVE_BAR}")
        with ui.row().classes("w-full items-center gap-1 no-wrap overflow-x-auto shrink-0"):
            if actor.may(Role.RUN):
                self._add_controls(actor)
            ui.space()
            _icon("history", "recorded runs", lambda: ui.navigate.to("runs"))
            if actor.may(Role.EDIT):
                _icon("edit_note", "write missions", lambda: ui.navigate.to("/edit/"))
        # Two lines, whatever there is to say: nothing below or above moves under a finger.
        StatusView().classes("w-full shrink-0 h-10 overflow-y-auto shows-robot")
        # Halves of a fixed size: what comes below the tree moves nothing but the tree's lower end.
        halves = "grid grid-cols-1 grid-rows-2 lg:grid-cols-2 lg:grid-rows-1 gap-2"
        with ui.element("div").classes(f"w-full grow min-h-0 {halves}"):
            view = MapView().classes("w-full h-full shows-robot").mark("map")
            with ui.element("div").classes("flex flex-col flex-nowrap w-full h-full min-h-0"):
                runs = actor.may(Role.RUN)
                tree = TreeView(breaks=runs).classes("w-full grow min-h-0 shows-robot shows-missions")
                bar = BreakpointBar(acts=runs).classes("w-full shrink-0 shows-robot shows-missions")
                BreakpointControls(actor, tree.mark("tree"), bar.mark("breakpoints"))
        if actor.may(Role.RUN):
            RobotBar()
            QuestionCards(actor)
            DrivePad().classes("fixed right-2 bottom-[calc(var(--florence-bar)+8px)] z-10 max-w-full")
        MapMenu(view, actor)

    def _add_controls(self, actor: Actor) -> None:
        start = ui.button("Start…", on_click=lambda: choose_mission(self._actor), icon="play_arrow")
        start.props("no-wrap dense").classes("px-2").mark("start")
        actor.on_press(ui.button("Stop", icon="stop"), self._stop).props("outline no-wrap dense").classes(
            "px-2"
        ).mark("stop")
        actor.on_press(_icon("pause", "pause the mission"), self._pause)
        actor.on_press(_icon("play_circle_outline", "go on with the mission"), self._resume)

    # ---- what the buttons do --------------------------------------------------------------------------

    async def _stop(self) -> None:
        request = StopMission.Request(reason=f"stopped on the {self._actor.caller}")
        await self._actor.told(
            self._ros.ask(StopMission, "florence_bt/stop", request), lambda answer: answer.message
        )

    async def _pause(self) -> None:
        request = PauseMission.Request(reason=f"paused on the {self._actor.caller}")
        await self._actor.told(
            self._ros.ask(PauseMission, "florence_bt/pause", request), lambda answer: answer.message
        )

    async def _resume(self) -> None:
        request = ResumeMission.Request(valid_until=soon())
        await self._actor.told(
            self._ros.ask(ResumeMission, "florence_bt/resume", request), lambda answer: answer.message
        )


def _icon(icon: str, title: str, do: Callable[[], Any] | None = None) -> ui.button:
    """Add a button that has no words: on a phone there is little room."""
    button = ui.button(icon=icon, on_click=do)
    button.props(f'flat dense aria-label="{title}"').tooltip(title)
    return button
