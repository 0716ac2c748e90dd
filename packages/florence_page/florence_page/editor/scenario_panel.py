"""The part of the editor where the scenarios of a mission are run."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from florence_page.acting import Actor
from florence_page.editor.desk import Desk
from florence_page.editor.shelf import Shelf


class ScenarioPanel:
    """A button, and what became of each scenario.

    Args:
        desk: Has the scenarios run.
        actor: Tells the viewer what went wrong.
        mission: Gives name and text of the mission as it stands, and where its scenarios are.
    """

    def __init__(self, desk: Desk, actor: Actor, mission: Callable[[], tuple[str, str, Shelf]]) -> None:
        self._desk, self._actor, self._mission = desk, actor, mission
        ui.label(
            "Scenarios play the mission with mocked skills and say what must hold (florence test)."
        ).classes("text-sm text-gray-600")
        ui.button("Run the scenarios", icon="checklist", on_click=self._run).props("no-caps").mark(
            "scenarios"
        )
        self._results = ui.column().classes("w-full gap-1 mt-2").mark("results")

    async def _run(self) -> None:
        name, text, shelf = self._mission()
        file = self._actor.attempt(lambda: shelf.scenarios_of(name)) if name else None
        self._results.clear()
        with self._results:
            if file is None:
                ui.label(f"There are none: they are read from {shelf.scenarios / f'{name}.yaml'}").classes(
                    "break-all"
                )
                return
            ui.spinner()
        said: list[str] = []
        results = await self._actor.told(
            self._desk.scenarios.run(name, text, file, shelf.folders, said.append)
        )
        self._results.clear()
        with self._results:
            for line in said:
                ui.label(line).classes("font-mono text-xs whitespace-pre-wrap")
            if results:
                _show_results(results, str(file))


def _show_results(results: list[dict[str, str]], file: str) -> None:
    """Show a line for each scenario, with what did not hold."""
    failed = sum(bool(each["problem"]) for each in results)
    ui.label(f"{len(results) - failed} of {len(results)} passed").classes(
        f"font-bold {'text-red-700' if failed else 'text-green-800'}"
    )
    ui.label(file).classes("text-xs text-gray-500 break-all")
    for each in results:
        if each["problem"]:
            with ui.expansion(f"✗ {each['name']}").classes("w-full text-red-700").props("dense"):
                ui.label(each["problem"]).classes(
                    "font-mono text-xs whitespace-pre-wrap overflow-auto w-full"
                )
        else:
            ui.label(f"✓ {each['name']}").classes("text-sm text-green-800")
