"""The part of the editor where a mission is tried in the simulated flat."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import replace
from typing import Any

from nicegui import ui

from florence_page.acting import Actor
from florence_page.components import MapView, StatusView, TreeView
from florence_page.editor.elements import InputForm
from florence_page.editor.helpers import Trials
from florence_page.editor.trial_request import TrialRequest

_SPEEDS = {0.0: "as fast as possible", 4.0: "four times as fast", 1.0: "as fast as life"}
_PEOPLE = {
    "": "in a random room",
    **{
        room: f"in the {room.replace('_', ' ')}"
        for room in ("kitchen", "living_room", "bedroom", "bathroom", "study")
    },
    **{word: word for word in ("standing", "sitting", "lying", "walking")},
    "company": "two or three people",
    "absent": "nobody",
}
_LOOK_S = 0.5
"""Seconds from one look whether the rig is done to the next."""


class TrialPanel:
    """The inputs of a mission, who is at home, the flat with the robot, and how the mission ended.

    Args:
        trials: The rig.
        actor: Tells the viewer what went wrong.
        ask: Gives the mission as it stands in the text; None, and a word about it, when it cannot run.
        enabled: Whether there is a mission at all.
    """

    def __init__(
        self,
        trials: Trials,
        actor: Actor,
        ask: Callable[[], Awaitable[TrialRequest | None]],
        *,
        enabled: bool,
    ) -> None:
        self._trials, self._actor, self._ask = trials, actor, ask
        self._enabled = enabled
        self._shown_end: dict[str, Any] | None = None
        ui.label(
            "The mission runs in a simulated flat, as it stands in the text; nothing moves the real robot."
        ).classes("text-sm text-gray-600")
        self.form = InputForm()
        with ui.row().classes("w-full items-center gap-2 mt-1"):
            self._person = (
                ui.select(_PEOPLE, value="", label="somebody is").props("dense outlined").classes("w-40")
            )
            self._seed = ui.number("chance", value=1, min=0, max=999_999, precision=0).props("dense outlined")
            self._seed.classes("w-20").tooltip("the same number gives the same run")
            self._speed = ui.select(_SPEEDS, value=4.0, label="time").props("dense outlined").classes("w-44")
        with ui.row().classes("w-full items-center gap-2 mt-2"):
            self._start = (
                ui.button("Try it", icon="play_arrow", on_click=self._try_it).props("no-caps").mark("try")
            )
            self._stop = ui.button("Stop", icon="stop", on_click=trials.stop).props("no-caps outline")
            self._stop.mark("stop-try")
            self._stop.set_enabled(False)
            StatusView().classes("grow")
        MapView(plain=True).classes("w-full h-80 mt-2 rounded").mark("map")
        self._wait = ui.label("the flat is being built: seconds, the first time about a minute")
        self._wait.classes("text-sm text-gray-500 mt-1").set_visibility(False)
        self._end = ui.column().classes("w-full gap-1 mt-2").mark("outcome")
        TreeView().classes("w-full h-72 mt-2")
        ui.timer(_LOOK_S, self._follow)

    async def _try_it(self) -> None:
        request = await self._ask()
        if request is None:
            return
        request = replace(
            request,
            inputs=self.form.values,
            person=self._person.value if self._person.value in _PEOPLE else "",
            seed=int(self._seed.value or 0),
            speed=float(self._speed.value if self._speed.value in _SPEEDS else 0.0),
        )
        await self._actor.told(self._trials.start(request))
        self._end.clear()

    def _follow(self) -> None:
        """Show whether the rig is busy, and once how a mission ended."""
        trials = self._trials
        self._start.set_enabled(self._enabled and not trials.running)
        self._stop.set_enabled(trials.running)
        self._wait.set_visibility(trials.running and not trials.seen)
        if trials.last is self._shown_end:
            return
        self._shown_end = trials.last
        self._end.clear()
        if trials.last is not None:
            with self._end:
                _show_end(trials.last)


def _show_end(end: Mapping[str, Any]) -> None:
    """Show how a mission in the rig ended."""
    if "problem" in end:
        ui.label(end["problem"]).classes("text-red-700 whitespace-pre-wrap")
        return
    good = end["status"] == "SUCCEEDED"
    word = {"SUCCEEDED": "succeeded", "FAILED": "failed", "STOPPED": "was stopped"}.get(
        end["status"], end["status"]
    )
    colour = "text-green-800" if good else "text-red-700"
    ui.label(f"It {word} after {end['seconds']:.0f} s.").classes(f"font-bold {colour}")
    if end["reason"]:
        ui.label(end["reason"] + (f" ({end['code']})" if end["code"] else "")).classes(colour)
    for name, value in end["outputs"].items():
        ui.label(f"{name}: {value}").classes("text-sm font-mono")
    for fact in end["facts"]:
        ui.label(fact).classes("text-sm")
    with ui.expansion("what happened when").classes("w-full").props("dense"):
        ui.label(end["journal"]).classes("font-mono text-xs whitespace-pre overflow-auto w-full")
