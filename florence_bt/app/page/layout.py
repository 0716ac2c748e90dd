"""What is where on the page, and what its buttons do."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from fastapi import FastAPI, Request
from florence_interfaces.msg import MissionInfo, MissionPort
from florence_interfaces.srv import (
    AnswerQuestion,
    ListMissions,
    PauseMission,
    ResumeMission,
    RunMission,
    StopMission,
)
from nicegui import ui
from nicegui.element import Element
from rcl_interfaces.srv import GetParameters

from florence_bt.app.page.access import ROLE, Role
from florence_bt.app.page.ros_thread import RosThread
from florence_bt.app.runs.client import LOCATOR, RUN_MISSION
from florence_bt.core.errors import FlorenceError
from florence_bt.skills.locator.hotspots import Hotspots, load_hotspots
from florence_bt.skills.robot_description.room import RoomParameters

_LIVE = {"florence-live": "components/live"}


class MapView(Element, component="components/map_view.js", esm=_LIVE):
    """The map. Emits ``place`` with x and y in metres when somebody clicks.

    Args:
        footprint: The corners of the robot in its own frame, metres.
    """

    def __init__(self, footprint: Sequence[Sequence[float]]) -> None:
        super().__init__()
        self._props["footprint"] = [list(corner) for corner in footprint]
        self._props["places"] = []

    def show_places(self, places: Hotspots) -> None:
        """Show rooms and objects at the places where the robot stands for them."""
        self._props["places"] = [
            {"label": each.label, "x": each.pose.x, "y": each.pose.y, "kind": each.kind} for each in places
        ]
        self.update()


class TreeView(Element, component="components/tree_view.js", esm=_LIVE):
    """The tree of the running mission."""


class StatusView(Element, component="components/status_view.js", esm=_LIVE):
    """A line: the mission and its state, the battery, what holds the robot up."""


def add_page(app: FastAPI, ros: RosThread) -> None:
    """Add the page to an application."""

    @ui.page("/")
    def page(request: Request) -> None:
        Page(ros, request.scope.get(ROLE, Role.LOOK))

    ui.run_with(app, title="Florence", show_welcome_message=False)


class Page:
    """The page of one viewer.

    Args:
        ros: Talks to the robot.
        role: What the viewer may do.
    """

    def __init__(self, ros: RosThread, role: Role) -> None:
        self._ros = ros
        self._may_run = role >= Role.RUN
        self._may_edit = role >= Role.EDIT
        self._caller = f"page ({role.name.lower()})"
        corners = RoomParameters().make_footprint().corners
        ui.query(".nicegui-content").classes("p-2 gap-2 w-full h-screen no-wrap")
        with ui.row().classes("w-full items-center gap-2"):
            StatusView().classes("grow")
            if self._may_run:
                self._add_controls()
            if self._may_edit:
                edit = ui.button(icon="edit_note", on_click=lambda: ui.navigate.to("/edit/")).props("flat")
                edit.tooltip("write missions").mark("edit")
        with ui.element("div").classes("w-full grow grid grid-cols-1 lg:grid-cols-2 gap-2 min-h-0"):
            self._map = MapView(corners).classes("w-full h-full").mark("map")
            TreeView().classes("w-full h-full").mark("tree")

        ui.timer(0.1, self._show_places, once=True)

    async def _show_places(self) -> None:
        """Show the rooms and objects of the locator's file; without a locator there are none."""
        question = GetParameters.Request(names=["hotspots_file"])
        try:
            answer = await self._ros.ask(GetParameters, f"{LOCATOR}/get_parameters", question)
            places = load_hotspots(answer.values[0].string_value)
        except FlorenceError as error:
            ui.notify(f"no places are shown: {error}", type="warning", multi_line=True)
            return
        self._map.show_places(places)

    def _add_controls(self) -> None:
        ui.button("Start…", on_click=self._choose_mission, icon="play_arrow").mark("start")
        ui.button("Stop", on_click=self._stop, icon="stop").props("outline").mark("stop")
        ui.button("Pause", on_click=self._pause).props("outline")
        ui.button("Go on", on_click=self._resume).props("outline")
        answer = ui.input("answer").props("dense outlined").classes("w-32")
        answer.on("keydown.enter", lambda: self._answer(answer))
        ui.button("STOP THE ROBOT", on_click=lambda: self._override(True), color="negative").mark("override")
        ui.button("release", on_click=lambda: self._override(False)).props("flat").mark("release")

    # ---- what the buttons do --------------------------------------------------------------------------

    async def _told(self, work: Awaitable[Any], message: Callable[[Any], str]) -> Any:
        """Wait for an answer and tell it; what went wrong is told, too."""
        try:
            answer = await work
        except FlorenceError as error:
            ui.notify(str(error), type="negative", multi_line=True)
            return None
        text = message(answer)
        if text:
            ui.notify(text, multi_line=True)
        return answer

    async def _stop(self) -> None:
        request = StopMission.Request(reason=f"stopped on the {self._caller}")
        await self._told(
            self._ros.ask(StopMission, "florence_bt/stop", request), lambda answer: answer.message
        )

    async def _pause(self) -> None:
        request = PauseMission.Request(reason=f"paused on the {self._caller}")
        await self._told(
            self._ros.ask(PauseMission, "florence_bt/pause", request), lambda answer: answer.message
        )

    async def _resume(self) -> None:
        request = ResumeMission.Request()
        await self._told(
            self._ros.ask(ResumeMission, "florence_bt/resume", request), lambda answer: answer.message
        )

    async def _answer(self, field: ui.input) -> None:
        request = AnswerQuestion.Request(text=field.value or "")
        done = await self._told(
            self._ros.ask(AnswerQuestion, "florence_bt/answer", request), lambda answer: answer.message
        )
        if done is not None and done.accepted:
            field.value = ""

    def _override(self, on: bool) -> None:
        self._ros.override(on)

    async def _choose_mission(self) -> None:
        request = ListMissions.Request()
        found = await self._told(
            self._ros.ask(ListMissions, "florence_bt/list_missions", request), lambda answer: ""
        )
        if found is None:
            return
        missions = {each.name: each for each in found.missions}
        with ui.dialog() as dialog, ui.card().classes("w-96"):
            chosen = (
                ui.select(sorted(missions), label="mission", with_input=True)
                .classes("w-full")
                .mark("mission")
            )
            form = ui.column().classes("w-full gap-1")
            fields: dict[str, Any] = {}
            chosen.on_value_change(lambda event: _fill(form, fields, missions.get(event.value)))
            with ui.row():
                ui.button("Start", on_click=lambda: dialog.submit(chosen.value)).mark("go")
                ui.button("Cancel", on_click=dialog.close).props("flat")
        name = await dialog
        if name:
            await self._start(name, {key: field.value for key, field in fields.items()})

    async def _start(self, mission: str, values: dict[str, Any]) -> None:
        given = {name: str(value).strip() for name, value in values.items() if str(value or "").strip()}
        request = RunMission.Request(
            mission=mission,
            input_names=list(given),
            input_values=list(given.values()),
            caller=self._caller,
        )
        await self._told(
            self._ros.ask(RunMission, RUN_MISSION, request),
            lambda answer: "" if answer.accepted else answer.message,
        )


def _fill(form: ui.column, fields: dict[str, Any], mission: MissionInfo | None) -> None:
    """Show a field for each input of a mission."""
    form.clear()
    fields.clear()
    if mission is None:
        return
    with form:
        ui.label(mission.problem or mission.description).classes("text-sm")
        for port in mission.inputs:
            fields[port.name] = _field(port)


def _field(port: MissionPort) -> Any:
    limits = " to ".join(text for text in (port.minimum, port.maximum) if text)
    words = (
        port.description,
        limits and f"({limits})",
        "" if port.required else f"default {port.default_value}",
    )
    if port.type == "boolean":
        return ui.checkbox(port.name, value=port.default_value == "true").tooltip(" ".join(words))
    field = (
        ui.input(f"{port.name} ({port.type})", placeholder=port.default_value)
        .classes("w-full")
        .mark(port.name)
    )
    return field.props(f'hint="{" ".join(filter(None, words))}"'.replace("\n", " "))
