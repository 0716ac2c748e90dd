"""The part of the editor where a mission is verified."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nicegui import ui

from florence_page.acting import Actor
from florence_page.editor.desk import Desk
from florence_page.editor.shelf import Shelf

_LOOK_S = 0.5
"""Seconds from one look whether something is being verified to the next."""


@dataclass(frozen=True, slots=True)
class VerifyRequest:
    """A mission to verify.

    Attributes:
        name: Its name.
        text: Its text, which counts instead of what its file says.
        file: Where it stands, or will.
        shelf: Where missions and scenarios are.
    """

    name: str
    text: str
    file: Path
    shelf: Shelf


class VerifyPanel:
    """Two buttons, and what was proved or the way on which it does not hold.

    Args:
        desk: Has missions verified.
        actor: Tells the viewer what went wrong.
        ask: Gives the mission as it stands in the text; None, and a word about it, when it cannot run.
        show: Told a text and what is to be marked in it, as findings.
        go_to: Leads to a line of the text.
    """

    def __init__(
        self,
        desk: Desk,
        actor: Actor,
        ask: Callable[[], Awaitable[VerifyRequest | None]],
        show: Callable[[str, list[dict[str, Any]]], None],
        go_to: Callable[[int], None],
        *,
        enabled: bool,
    ) -> None:
        self._desk, self._actor, self._ask = desk, actor, ask
        self._show, self._go_to, self._enabled = show, go_to, enabled
        ui.label(
            "Every way in which the mission can go is explored, as it stands in the text (florence verify)."
        ).classes("text-sm text-gray-600")
        with ui.row().classes("items-center gap-2 mt-1"):
            self._start = ui.button("Verify it", icon="rule", on_click=self._verify).props("no-caps")
            self._start.mark("verify")
            self._stop = ui.button("Stop", icon="stop", on_click=self._end).props("no-caps outline")
            self._stop.mark("stop-verify").set_enabled(False)
            self._busy = ui.spinner()
        self._follow()
        self._answer = ui.column().classes("w-full gap-1 mt-2").mark("verdict")
        ui.timer(_LOOK_S, self._follow)

    def _follow(self) -> None:
        """Show whether something is being verified, by whoever."""
        running = self._desk.verifications.running
        self._start.set_enabled(self._enabled and not running)
        self._stop.set_enabled(running)
        self._busy.set_visibility(running)

    async def _end(self) -> None:
        await self._desk.verifications.stop()

    async def _verify(self) -> None:
        request = await self._ask()
        if request is None:
            return
        self._answer.clear()
        self._show(request.text, [])
        answer = await self._actor.told(
            self._desk.verifications.run(request.text, request.file, request.shelf.folders)
        )
        if answer is None:
            return
        self._show(request.text, [_finding(each) for each in answer["problems"] if each["line"]])
        with self._answer:
            self._show_answer(answer, request)

    def _show_answer(self, answer: dict[str, Any], request: VerifyRequest) -> None:
        colour = "text-green-800" if answer["holds"] else "text-red-700"
        ui.label(f"{request.name}: {answer['headline']}").classes(f"font-bold {colour}").mark("headline")
        for line in answer["facts"]:
            ui.label(line).classes("text-sm text-gray-700")
        for problem in answer["problems"]:
            self._show_problem(problem, request)

    def _show_problem(self, problem: dict[str, Any], request: VerifyRequest) -> None:
        """Show one thing that does not hold, the way to it, and what can be done with it."""
        broken = problem["severity"] == "error"
        colour = "border-red-700" if broken else "border-amber-600"
        with ui.column().classes(f"w-full gap-1 mt-2 pl-2 border-l-4 {colour}"):
            ui.label(f"{'broken' if broken else 'warning'}: {problem['text']}").classes("font-bold text-sm")
            if problem["file"]:
                ui.label(f"as {problem['file']} has it").classes("text-xs text-gray-500")
            with ui.row().classes("gap-2"):
                if problem["line"]:
                    place = ui.button(f"line {problem['line']}", icon="my_location").mark("place")
                    place.on_click(lambda: self._go_to(problem["line"])).props("flat dense no-caps")
                if problem["scenario"]:
                    save = ui.button("Save as scenario", icon="save_alt").mark("save-scenario")
                    save.on_click(lambda: self._save(problem, request)).props("flat dense no-caps")
            if problem["way"]:
                ui.label("It comes like this:").classes("text-sm")
                ui.label("\n".join(problem["way"])).classes(
                    "font-mono text-xs whitespace-pre overflow-auto w-full"
                ).mark("way")

    def _save(self, problem: dict[str, Any], request: VerifyRequest) -> None:
        """Keep a way as a scenario."""
        file = self._actor.attempt(
            lambda: request.shelf.save_scenario(request.name, problem["kind"], problem["scenario"])
        )
        if file is not None:
            ui.notify(f"saved in {file}; it fails until the mission is mended", multi_line=True)


def _finding(problem: dict[str, Any]) -> dict[str, Any]:
    """Return what is marked in the text."""
    return {
        "line": problem["line"],
        "column": problem["column"],
        "severity": problem["severity"],
        "message": f"florence verify: {problem['text']}",
        "valid": [],
        "file": "",
    }
