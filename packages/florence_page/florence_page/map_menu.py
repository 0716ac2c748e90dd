"""What a click on the map offers: the pose, and what may be done there."""

from __future__ import annotations

import math
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from florence_bt.core.geometry import Pose2, normalize_angle
from florence_page.access import Role
from florence_page.acting import Actor, confirmed
from florence_page.components import MapView, pose_from_browser

DRIVE = "goto_pose"
"""The shipped mission that drives to a pose."""
MOST_LETTERS = 100


class MapMenu:
    """Opens for each pose that a viewer gives on the map.

    Args:
        map_view: The map.
        actor: Does what the viewer chooses.
    """

    def __init__(self, map_view: MapView, actor: Actor) -> None:
        self._map = map_view
        self._actor = actor
        map_view.on("place", self._on_place)

    async def _on_place(self, event: GenericEventArguments) -> None:
        pose = pose_from_browser(event.args)
        if pose is None:
            return
        self._map.show_chosen(pose)
        places = self._actor.ros.node.places
        with ui.dialog() as dialog, ui.card().classes("gap-2 w-72 items-stretch"):
            heading = self._show(pose)
            if self._actor.may(Role.RUN):
                ui.button("Drive there", on_click=lambda: dialog.submit("drive")).mark("drive-there")
                ui.button("The robot is here", on_click=lambda: dialog.submit("initial")).props("outline")
            if self._actor.may(Role.EDIT):
                label = (
                    ui.input("name of a place", autocomplete=list(places.labels()))
                    .props(f"dense maxlength={MOST_LETTERS}")
                    .classes("w-full")
                    .mark("place-name")
                )
                ui.button("Put the place here", on_click=lambda: dialog.submit("place")).props("outline")
            ui.button("Close", on_click=dialog.close).props("flat")
        chosen = await dialog
        pose = Pose2(pose.x, pose.y, normalize_angle(math.radians(heading.value or 0.0)))
        name = str(label.value or "").strip()[:MOST_LETTERS] if self._actor.may(Role.EDIT) else ""
        dialog.delete()
        await self._do(chosen, pose, name)
        self._map.show_chosen(None)

    def _show(self, pose: Pose2) -> Any:
        """Show a pose; gives the field of its heading in degrees."""
        room = self._actor.ros.node.places.room_of(pose.x, pose.y)
        ui.label(f"{pose.x:.2f} m, {pose.y:.2f} m{f' in {room}' if room else ''}").mark("pose")
        degrees = round(math.degrees(pose.yaw))
        return (
            ui.number("heading in degrees", value=degrees, min=-360, max=360).props("dense").classes("w-full")
        )

    async def _do(self, chosen: str | None, pose: Pose2, name: str) -> None:
        where = f"({pose.x:.2f} m, {pose.y:.2f} m), {math.degrees(pose.yaw):.0f}°"
        if chosen == "drive" and await confirmed(f"Drive to {where}?", "Drive", self._actor):
            at = {"x": f"{pose.x:.3f} m", "y": f"{pose.y:.3f} m", "phi": f"{math.degrees(pose.yaw):.1f} deg"}
            await self._actor.start(DRIVE, at)
        elif chosen == "initial" and await confirmed(
            f"Does the robot stand at {where}?", "It does", self._actor
        ):
            self._actor.tell_pose(pose)
            ui.notify("told the localiser; the scan must lie on the walls now")
        elif chosen == "place" and not name:
            ui.notify("a place needs a name", type="warning")
        elif chosen == "place":
            known = self._actor.ros.node.places.get(name) is not None
            question = f"Move the place {name} to {where}?" if known else f"Add the place {name} at {where}?"
            if await confirmed(question, "Move" if known else "Add", self._actor):
                await self._actor.set_hotspot(name, pose)
