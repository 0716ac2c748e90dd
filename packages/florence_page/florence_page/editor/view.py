"""The editor's page: the text with what is wrong, its drawing, saving; and the panels beside it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from nicegui import ui
from nicegui.element import Element

from florence_bt.core.errors import FlorenceError
from florence_page.acting import Actor, confirmed, tell_failure
from florence_page.components import ABOVE_BAR, RobotBar
from florence_page.editor.completion import insertion
from florence_page.editor.desk import Desk, Home
from florence_page.editor.elements import InputForm, MissionOutline, MissionText
from florence_page.editor.helpers import check_size
from florence_page.editor.scenario_panel import ScenarioPanel
from florence_page.editor.shelf import ChangedMeanwhile, Opened, Saved, Shelf, checked_name, date_text
from florence_page.editor.side_panel import SidePanel
from florence_page.editor.trial_panel import TrialPanel
from florence_page.editor.trial_request import TrialRequest
from florence_page.editor.verify_panel import VerifyPanel, VerifyRequest
from florence_page.editor.words import TEMPLATES

_NAME = re.compile(r"^mission:[ ]*([a-z][a-z0-9_]*)[ ]*(?:#.*)?$", re.MULTILINE)
_SHORT = """
@media (max-width: 640px) {
  .florence-short .block { font-size: 0; line-height: 0; width: 0 }
  .florence-short .q-icon { margin: 0 }
  .florence-short { padding: 4px 8px }
}
"""
"""On a phone these buttons have only their sign (an important rule of Quasar keeps their texts displayed)."""
_ROBOT_S = 3.0
"""How often to look whether a robot has come or gone."""


class EditorPage:
    """The editor of one viewer.

    Args:
        desk: What all who edit share.
        actor: Does what the viewer asks for.
        home: Where missions are.
        name: The mission that is opened; empty for none.
        template: What a new mission begins with.

    Raises:
        ConfigError: This is no name of a mission, or its file cannot be read.
    """

    def __init__(self, desk: Desk, actor: Actor, home: Home, name: str, template: str) -> None:
        self._desk, self._actor, self._home = desk, actor, home
        self._opened = home.shelf.open(name) if name else None
        self._name = name
        self._saved = self._opened.text if self._opened is not None else ""
        self._text = self._saved or (_from_template(name, template) if name else "")
        self._look: dict[str, Any] = {}
        self._broken: list[dict[str, Any]] = []
        self._looking = self._again = False
        self._line = 1
        self._areas: dict[str, Element] = {}
        self._build()

    # ---- what is where --------------------------------------------------------------------------------

    def _build(self) -> None:
        ui.query(".nicegui-content").classes(f"p-2 gap-2 w-full no-wrap {ABOVE_BAR}")
        RobotBar()
        self._build_head()
        if self._opened is not None and self._opened.draft is not None:
            self._build_draft_note(self._opened)
        areas = {"side": "Missions", "text": "Text", "work": "Drawing, try"}
        self._toggle = ui.toggle(areas, value="text" if self._name else "side").mark("areas")
        self._toggle.classes("lg:hidden w-full").props("spread dense no-caps unelevated")
        self._toggle.on_value_change(lambda event: self._show_area(event.value))
        columns = "lg:grid-cols-[16rem_minmax(0,1.2fr)_minmax(0,1fr)]"
        with ui.element("div").classes(f"w-full grow grid grid-cols-1 {columns} gap-2 min-h-0"):
            for area, build in (
                ("side", self._build_side),
                ("text", self._build_text),
                ("work", self._build_work),
            ):
                with ui.element("div").classes(
                    "flex flex-col flex-nowrap min-h-0 min-w-0 border border-gray-300 rounded-lg "
                    "overflow-hidden"
                ) as panel:
                    build()
                self._areas[area] = panel
        self._show_area("text" if self._name else "side")
        ui.timer(_ROBOT_S, self._look_for_robot)
        ui.timer(0.05, self._begin, once=True)

    def _show_area(self, shown: str) -> None:
        """On a phone one area is shown, on a desk all."""
        for area, panel in self._areas.items():
            panel.classes(**{"remove" if area == shown else "add": "max-lg:hidden"})

    def _build_head(self) -> None:
        ui.add_css(_SHORT)
        short = "florence-short"
        with ui.row().classes("w-full items-center gap-2 no-wrap"):
            ui.button(icon="arrow_back", on_click=lambda: ui.navigate.to("/")).props(
                "flat round dense"
            ).tooltip("back to the robot")
            ui.label(self._name or "Missions").classes("text-lg font-bold truncate").mark("name")
            self._state = ui.badge("").props("color=grey-6").mark("state")
            self._state.set_visibility(bool(self._name))
            self._note = ui.label(self._home.note).mark("robot")
            self._note.classes("grow text-sm text-gray-500 truncate max-md:hidden")
            ui.space().classes("md:hidden")
            ui.button("New…", icon="add", on_click=self._choose_new).props("flat no-caps dense").classes(
                short
            ).mark("new")
            if self._name:
                old = ui.button("Old versions", icon="history", on_click=self._choose_version)
                old.props("flat no-caps dense").classes(short)
                ui.button("Save", icon="save", on_click=self._save).props("no-caps").classes(short).mark(
                    "save"
                )
                self._run = ui.button("Run on the robot…", icon="play_arrow", on_click=self._run_on_robot)
                self._run.props("outline no-caps").classes(short).mark("run")
                self._allow_run()
        self._short_note = ui.label(self._home.note).classes("text-xs text-gray-500 md:hidden")

    def _build_draft_note(self, opened: Opened) -> None:
        with ui.row().classes("w-full items-center gap-2 bg-amber-50 rounded-lg px-3 py-1") as note:
            ui.label("There is a draft that was not saved as the mission.").classes("text-sm")

            def take() -> None:
                self._editor.run_method("set_text", opened.draft)
                note.delete()

            ui.button("open the draft", on_click=take).props("flat dense no-caps").mark("draft")

    def _build_side(self) -> None:
        self._side = SidePanel(self._name, self._insert)

    def _build_text(self) -> None:
        if not self._name:
            with ui.column().classes("m-auto items-center p-6 text-center gap-3"):
                ui.icon("edit_note", size="4rem").classes("text-gray-400")
                ui.label("Choose a mission on the left, or begin a new one.").classes("text-gray-600")
                ui.button("New mission…", icon="add", on_click=self._choose_new).props("no-caps")
                ui.label(f"Yours are kept in {self._home.shelf.own}").classes(
                    "text-xs text-gray-400 break-all"
                )
            return
        self._editor = MissionText(self._text).classes("grow min-h-0 w-full").mark("text")
        self._editor.on("text", lambda event: self._on_text(event.args["text"]))
        self._editor.on("line", lambda event: self._on_line(event.args["line"]), throttle=0.1)
        self._editor.on("save", self._save)

    def _build_work(self) -> None:
        with ui.tabs().props("dense no-caps align=justify") as tabs:
            drawing, trial = ui.tab("Drawing"), ui.tab("Try")
            proof, scenarios = ui.tab("Verify"), ui.tab("Scenarios")
        with (
            ui.tab_panels(tabs, value=drawing)
            .props("animated=false keep-alive")
            .classes("w-full grow min-h-0")
        ):
            with ui.tab_panel(drawing).classes("p-0 h-full flex"):
                self._outline = MissionOutline().classes("grow min-h-0 w-full").mark("outline")
                self._outline.on("node", lambda event: self._go_to(event.args["line"]))
            with ui.tab_panel(trial).classes("p-2 h-full overflow-auto"):
                self._trial = TrialPanel(
                    self._desk.trials, self._actor, self._to_try, enabled=bool(self._name)
                )
            with ui.tab_panel(proof).classes("p-2 h-full overflow-auto"):
                VerifyPanel(
                    self._desk,
                    self._actor,
                    self._to_verify,
                    self._show_broken,
                    self._go_to,
                    enabled=bool(self._name),
                )
            with ui.tab_panel(scenarios).classes("p-2 h-full overflow-auto"):
                ScenarioPanel(self._desk, self._actor, self._mission)

    # ---- the text -------------------------------------------------------------------------------------

    async def _begin(self) -> None:
        if self._name:
            await self._look_at_text()
        await self._actor.told(self._refresh())

    async def _refresh(self) -> None:
        """Show the missions and what can be inserted."""
        self._side.show(await self._desk.learn(self._home), self._home.shelf.drafts())

    async def _look_for_robot(self) -> None:
        """Follow a robot that has come or gone."""
        home = self._home
        if self._desk.robot_there == home.there and home.told == home.there:
            return
        self._home = await self._desk.home()
        for note in (self._note, self._short_note):
            note.set_text(self._home.note)
        if self._name:
            self._allow_run()
            await self._look_at_text()
        await self._actor.told(self._refresh())

    def _allow_run(self) -> None:
        """Offer to run it if the robot would: of a folder that it does not read it would run another one."""
        shipped = self._opened is not None and not self._opened.own
        self._run.set_enabled(self._home.there and (self._home.reads_own or shipped))

    async def _on_text(self, text: Any) -> None:
        if not isinstance(text, str):
            return
        if text != self._text:
            self._broken = []  # what was proved was about another text
        self._text = text
        self._show_state()
        if self._looking:
            self._again = True
            return
        self._looking = True
        try:
            while True:
                self._again = False
                await self._look_at_text()
                if not self._again:
                    return
        finally:
            self._looking = False

    async def _look_at_text(self) -> dict[str, Any]:
        """Check the text as it is now, and show and return what came out of it: nothing if that failed."""
        text = self._text
        try:
            check_size(text)
            look = await self._desk.worker.ask(
                "look",
                self._home.shelf.folders,
                self._home.hotspots,
                text=text,
                name=self._name_in(text),
            )
        except FlorenceError as error:
            self._look = {}
            self._editor.show([], str(error))
            return {}
        self._look = look
        self._show_findings()
        self._outline.show(look["outline"])
        self._trial.form.show(look["inputs"])
        self._show_state()
        return look

    def _show_findings(self) -> None:
        """Show what the check has found, and what does not hold."""
        found = self._look["findings"]
        errors = sum(each["severity"] == "error" for each in found)
        self._editor.show([*found, *self._broken], _summary(errors, len(found) - errors))

    def _show_broken(self, text: str, findings: list[dict[str, Any]]) -> None:
        """Mark in the text what does not hold, unless another text stands there by now."""
        if text != self._text:
            return
        self._broken = findings
        if self._look:
            self._show_findings()

    def _name_in(self, text: str) -> str:
        """Return what a text calls its mission: so is its file called."""
        found = _NAME.search(text)
        return found[1] if found else self._name

    def _show_state(self) -> None:
        name = self._name_in(self._text)
        changed = self._text != self._saved
        word = "saved" if not changed else "not saved" if name == self._name else f"will be saved as {name}"
        self._state.set_text(word)
        self._state.props(f"color={'green-7' if not changed else 'orange-8'}")
        self._editor.set_dirty(changed)

    def _on_line(self, line: int) -> None:
        self._line = int(line)
        self._outline.point_at(self._line)

    def _go_to(self, line: int) -> None:
        self._switch_to("text")
        self._editor.run_method("go_to", int(line), 1)

    def _switch_to(self, area: str) -> None:
        self._toggle.value = area

    def _insert(self, picked: Mapping[str, str]) -> None:
        group = self._desk.words.get(picked["group"], {})
        found = group.get(picked["name"]) if picked["group"] in ("skills", "missions", "node_kinds") else None
        snippet = found if isinstance(found, str) else (found or {}).get("snippet")
        if not snippet or not self._name:
            return
        after, lines = insertion(self._text, self._line, snippet)
        self._switch_to("text")
        self._editor.run_method("insert", after, lines)

    # ---- new, saved, old ------------------------------------------------------------------------------

    async def _choose_new(self) -> None:
        with ui.dialog() as dialog, ui.card().classes("w-96"):
            ui.label("A new mission").classes("text-lg font-bold")
            name = ui.input("its name, such as fetch_tea").classes("w-full").mark("new-name")
            kinds = {key: about for key, (about, _) in TEMPLATES.items()}
            template = ui.select(kinds, value="go", label="it begins as").classes("w-full")
            with ui.row():
                ui.button("Write it", on_click=lambda: dialog.submit(name.value or "")).props("no-caps").mark(
                    "write"
                )
                ui.button("Cancel", on_click=dialog.close).props("flat no-caps")
        given = await dialog
        dialog.delete()
        if given is None:
            return
        try:
            wanted = checked_name(given.strip().lower().replace(" ", "_").replace("-", "_"))
        except FlorenceError as error:
            tell_failure(error)
            return
        ui.navigate.to(f"/edit/{wanted}?template={template.value}")

    async def _save(self) -> None:
        if not self._name:
            return
        text, shelf = self._text, self._home.shelf  # what is typed meanwhile is not saved
        name = self._name_in(text)
        look = await self._look_at_text()
        if not look.get("fits"):
            why = "It has errors and would not run" if look else "It could not be checked"
            sentence = f"{why}, so it is not saved as a mission. Keep it as a draft?"
            if await confirmed(sentence, "Keep the draft", self._actor):
                file = self._actor.attempt(lambda: shelf.save_draft(name, text))
                if file is not None:
                    ui.notify(f"the draft is kept in {file}; no robot reads it", multi_line=True)
            return
        file = self._actor.attempt(lambda: shelf.file_of(name) or shelf.own)
        if file is None:
            return
        if file != shelf.own and file.parent != shelf.own:
            sentence = (
                f"{name} comes from {file.parent}. Yours will take its place, also for missions that call it."
            )
            if not await confirmed(sentence, "Save mine", self._actor):
                return
        known = (
            self._opened.print if self._opened is not None and self._opened.own and name == self._name else ""
        )
        saved = await self._save_over(name, text, known)
        if saved is None:
            return
        self._opened = Opened(text, saved.file, True, saved.print)
        self._saved = text
        self._show_state()
        self._allow_run()
        kept = f"; what stood there is kept in {saved.before}" if saved.before else ""
        ui.notify(f"saved in {saved.file}{kept}", type="positive", multi_line=True)
        if self._home.there and self._home.reads_own:
            report = await self._actor.told(self._desk.reload())
            if report:
                ui.notify(f"the robot: {report}", multi_line=True)
        if name != self._name and text == self._text:
            self._editor.set_dirty(False)
            ui.navigate.to(f"/edit/{name}")
        else:
            await self._actor.told(self._refresh())

    async def _save_over(self, name: str, text: str, known: str) -> Saved | None:
        """Save a mission; what somebody else has written meanwhile only gives way when the writer agrees."""
        shelf = self._home.shelf
        try:
            return shelf.save(name, text, known)
        except ChangedMeanwhile as error:
            if not await confirmed(
                f"{error}. Save yours over it? The other text is kept.", "Save mine", self._actor
            ):
                return None
            there = shelf.open(name)
            return self._actor.attempt(lambda: shelf.save(name, text, there.print if there else ""))
        except FlorenceError as error:
            tell_failure(error)
            return None

    async def _choose_version(self) -> None:
        shelf, dates = self._home.shelf, self._home.shelf.versions(self._name)
        with ui.dialog() as dialog, ui.card().classes("w-96"):
            ui.label(f"Old versions of {self._name}").classes("text-lg font-bold")
            if not dates:
                ui.label("None yet: each save keeps what stood there before.")
            with ui.column().classes("max-h-80 overflow-auto gap-1"):
                for date in dates:
                    ui.button(date_text(date), on_click=lambda chosen=date: dialog.submit(chosen)).props(
                        "flat no-caps dense"
                    )
            ui.button("Close", on_click=dialog.close).props("flat no-caps")
        date = await dialog
        dialog.delete()
        text = self._actor.attempt(lambda: shelf.version(self._name, date)) if date else None
        if text is not None:
            self._editor.run_method("set_text", text)
            ui.notify("that version is in the text now; save it to have it back")

    # ---- trying ---------------------------------------------------------------------------------------

    async def _that_fits(self) -> str | None:
        """Return the text as it stands; None, and a word about it, when it cannot run."""
        if not self._name:
            return None
        text = self._text
        look = await self._look_at_text()
        if not look.get("fits"):
            why = "the mission has errors: mend them first" if look else "the mission could not be checked"
            ui.notify(why, type="warning")
            return None
        return text

    async def _to_try(self) -> TrialRequest | None:
        """Return the mission as it is to be tried; None when it cannot run."""
        text = await self._that_fits()
        if text is None:
            return None
        folders = tuple(str(folder) for folder in self._home.shelf.folders)
        return TrialRequest(self._name_in(text), text, folders)

    async def _to_verify(self) -> VerifyRequest | None:
        """Return the mission as it is to be verified; None when it cannot run."""
        text, shelf = await self._that_fits(), self._home.shelf
        if text is None:
            return None
        name = self._name_in(text)
        file = self._actor.attempt(lambda: shelf.file_of(name) or shelf.own / f"{name}.yaml")
        return VerifyRequest(name, text, file, shelf) if file is not None else None

    def _mission(self) -> tuple[str, str, Shelf]:
        """Return name and text as they stand, and where the missions are."""
        return self._name_in(self._text), self._text, self._home.shelf

    # ---- on the robot ---------------------------------------------------------------------------------

    async def _run_on_robot(self) -> None:
        if self._text != self._saved:
            ui.notify("save it first: the robot runs what is saved", type="warning")
            return
        with ui.dialog() as dialog, ui.card().classes("w-96"):
            ui.label(f"Run {self._name} on the robot").classes("text-lg font-bold")
            form = InputForm()
            form.show(self._look.get("inputs", []))
            with ui.row():
                go = ui.button("Run").props("no-caps").mark("go")
                self._actor.on_press(go, lambda: dialog.submit(True))
                ui.button("Cancel", on_click=dialog.close).props("flat no-caps")
        agreed, inputs = await dialog, form.values
        dialog.delete()
        if agreed and await self._actor.start(self._name, inputs):
            ui.navigate.to("/")


def _from_template(name: str, template: str) -> str:
    _, text = TEMPLATES.get(template, TEMPLATES["go"])
    return text.format(name=name)


def _summary(errors: int, warnings: int) -> str:
    if not errors and not warnings:
        return "✓ nothing is wrong"
    counts = [(errors, "error"), (warnings, "warning")]
    return ", ".join(f"{count} {word}{'s' * (count != 1)}" for count, word in counts if count)
