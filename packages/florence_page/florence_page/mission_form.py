"""The form that starts a mission: a field for each of its typed inputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from florence_interfaces.msg import MissionInfo, MissionPort
from florence_interfaces.srv import ListMissions
from nicegui import ui
from nicegui.events import GenericEventArguments

from florence_bt.core.geometry import Pose2
from florence_page.acting import Actor
from florence_page.components import MapView, pose_from_browser

_PARTS = {"x": "length", "y": "length"}
_HEADINGS = ("phi", "yaw")


async def choose_mission(actor: Actor) -> None:
    """Show every mission with its inputs, and start the one that is chosen."""
    request = ListMissions.Request()
    work = actor.ros.ask(ListMissions, "florence_bt/list_missions", request)
    found = await actor.told(work, lambda answer: "")
    if found is None:
        return
    missions = {each.name: each for each in found.missions}
    with ui.dialog() as dialog, ui.card().classes("w-[28rem] max-w-full"):
        chosen = (
            ui.select(sorted(missions), label="mission", with_input=True).classes("w-full").mark("mission")
        )
        form = ui.column().classes("w-full gap-1")
        fields: dict[str, Any] = {}
        chosen.on_value_change(lambda event: _fill(form, fields, missions.get(event.value)))
        with ui.row():
            actor.on_press(ui.button("Start"), lambda: dialog.submit(chosen.value)).mark("go")
            ui.button("Cancel", on_click=dialog.close).props("flat")
    name = await dialog
    values = {key: text_of(field.value) for key, field in fields.items()}
    dialog.delete()
    if name:
        await actor.start(name, values)


def _fill(form: ui.column, fields: dict[str, Any], mission: MissionInfo | None) -> None:
    """Show a field for each input of a mission, and a map for those that are poses."""
    form.clear()
    fields.clear()
    if mission is None:
        return
    with form:
        ui.label(mission.problem or mission.description).classes("text-sm")
        for port in mission.inputs:
            fields[port.name] = input_field(port)
        for take in map_choices({port.name: port.type for port in mission.inputs}):
            _add_map(fields, take)


def input_field(port: MissionPort) -> Any:
    """Show the field of an input."""
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
    field.props["hint"] = " ".join(filter(None, words))
    return field


def text_of(value: Any) -> str:
    """Return what stands in a field as a mission takes it; empty when nothing does."""
    return ("true" if value else "false") if isinstance(value, bool) else str(value or "").strip()


def _add_map(fields: Mapping[str, Any], take: Callable[[Pose2], Mapping[str, str]]) -> None:
    """Add a map on which a click fills fields."""
    view = MapView(picking=True).classes("w-full h-64").mark("pose-map")
    ui.label(f"press on the map for {' and '.join(take(Pose2()))}; drag for the heading").classes("text-xs")

    def choose(event: GenericEventArguments) -> None:
        pose = pose_from_browser(event.args)
        if pose is None:
            return
        view.show_chosen(pose)
        for name, text in take(pose).items():
            fields[name].value = text

    view.on("place", choose)


def map_choices(inputs: Mapping[str, str]) -> list[Callable[[Pose2], dict[str, str]]]:
    """Return how a pose that is chosen on the map becomes inputs of a mission.

    Args:
        inputs: Name of each input -> its type.

    Returns:
        For each input that is a pose, and for lengths called x and y with an angle phi or yaw, a function
        that gives the texts by the name of the input.
    """
    found: list[Callable[[Pose2], dict[str, str]]] = []
    for name, kind in inputs.items():
        if kind == "pose":
            found.append(partial(_as_pose, name))
    if all(inputs.get(name) == kind for name, kind in _PARTS.items()):
        heading = next((name for name in _HEADINGS if inputs.get(name) == "angle"), None)
        found.append(
            lambda pose: {"x": _m(pose.x), "y": _m(pose.y)} | ({heading: _deg(pose)} if heading else {})
        )
    return found


def _as_pose(name: str, pose: Pose2) -> dict[str, str]:
    return {name: f"{{x: {_m(pose.x)}, y: {_m(pose.y)}, yaw: {_deg(pose)}}}"}


def _m(metres: float) -> str:
    return f"{metres:.2f} m"


def _deg(pose: Pose2) -> str:
    return f"{math.degrees(pose.yaw):.0f} deg"
