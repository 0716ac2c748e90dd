"""The part of the editor with the missions, and with what can be inserted into the text."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from florence_page.editor.elements import Chooser


class SidePanel:
    """The missions that can be opened, and the parts that can be inserted.

    Args:
        name: The mission that is open; empty for none.
        insert: Told the group and the name of what is to be inserted.
    """

    def __init__(self, name: str, insert: Callable[[Mapping[str, str]], None]) -> None:
        with ui.tabs().props("dense no-caps align=justify") as tabs:
            missions, words = ui.tab("Missions"), ui.tab("Insert")
        with (
            ui.tab_panels(tabs, value=missions)
            .props("animated=false keep-alive")
            .classes("w-full grow min-h-0")
        ):
            with ui.tab_panel(missions).classes("p-2 h-full flex"):
                self._missions = (
                    Chooser("find a mission", name).classes("w-full grow min-h-0").mark("missions")
                )
                self._missions.on("pick", lambda event: ui.navigate.to(f"/edit/{event.args['name']}"))
            with ui.tab_panel(words).classes("p-2 h-full flex"):
                self._palette = Chooser("find a node, a skill").classes("w-full grow min-h-0").mark("palette")
                self._palette.on("pick", lambda event: insert(event.args))

    def show(self, words: Mapping[str, Any], drafts: list[str]) -> None:
        """Show the missions and what can be inserted.

        Args:
            words: What can be written now (:func:`~florence_page.editor.words.words_of`).
            drafts: The missions of which there is a draft.
        """
        known = words["missions"]
        own = [_choice(name, known[name], drafts) for name in known if known[name]["own"]]
        own += [
            {"name": name, "about": "not ready yet", "mark": "draft"} for name in drafts if name not in known
        ]
        shipped = [_choice(name, known[name], drafts) for name in known if not known[name]["own"]]
        self._missions.show(
            [
                {"key": "own", "title": "Yours", "items": own},
                {"key": "shipped", "title": "They come with Florence", "items": shipped},
            ]
        )
        nodes, skills = words["node_kinds"], words["skills"]
        self._palette.show(
            [
                _group("skills", "What the robot does", {name: skills[name]["summary"] for name in skills}),
                _group("missions", "Other missions", {name: known[name]["about"] for name in known}),
                _group("node_kinds", "How it goes on", {name: words["nodes"][name] for name in nodes}),
            ]
        )


def _choice(name: str, mission: Mapping[str, Any], drafts: list[str]) -> dict[str, Any]:
    marks = ["has errors"] * bool(mission["problem"]) + ["draft"] * (name in drafts)
    return {"name": name, "about": mission["about"] or mission["problem"], "mark": ", ".join(marks)}


def _group(key: str, title: str, items: Mapping[str, str]) -> dict[str, Any]:
    return {
        "key": key,
        "title": title,
        "items": [{"name": name, "about": about} for name, about in items.items()],
    }
