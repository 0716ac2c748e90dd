"""The elements of the editor: text, drawing, things to choose from, and a field for each input."""

from __future__ import annotations

from typing import Any

import nicegui.elements.codemirror  # noqa: F401 - so that the module nicegui-codemirror is served
from florence_interfaces.msg import MissionPort
from nicegui import ui
from nicegui.element import Element

from florence_bt.app.page.mission_form import input_field, text_of
from florence_bt.core.text_files import MAX_MISSION_BYTES


class MissionText(Element, component="components/mission_text.js"):
    """The text of a mission. Emits ``text`` (cut when too long), ``line`` of the cursor, and ``save``."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self._props["text"] = text
        self._props["most"] = MAX_MISSION_BYTES
        self.show([], "looking at it…")

    def show(self, findings: list[dict[str, Any]], note: str) -> None:
        """Show what is wrong, and a sentence above it."""
        self._props["findings"] = findings
        self._props["note"] = note
        self.update()

    def set_dirty(self, dirty: bool) -> None:
        """Say whether something would be lost when the page is left."""
        if self._props.get("dirty") != dirty:
            self._props["dirty"] = dirty
            self.update()


class MissionOutline(Element, component="components/outline.js"):
    """The drawing of a mission. Emits ``node`` with its line when somebody clicks one."""

    def __init__(self) -> None:
        super().__init__()
        self._props["line"] = 1
        self._props["rows"] = []

    def show(self, rows: list[dict[str, Any]]) -> None:
        """Show the nodes of a mission (:func:`~florence_bt.app.page.editor.looking.outline`).

        Of a text that cannot be read there are none: the last drawing stays, and is said to be old.
        """
        self._props["stale"] = not rows
        if rows:
            self._props["rows"] = rows
        self._props["empty"] = "the drawing waits until the text can be read again"
        self.update()

    def point_at(self, line: int) -> None:
        """Mark the node that a line belongs to."""
        self._props["line"] = line
        self.update()


class Chooser(Element, component="components/chooser.js"):
    """Groups of things to choose from. Emits ``pick`` with group and name."""

    def __init__(self, hint: str, chosen: str = "") -> None:
        super().__init__()
        self._props["hint"] = hint
        self._props["chosen"] = chosen
        self._props["groups"] = []

    def show(self, groups: list[dict[str, Any]]) -> None:
        """Show groups: key, title and items with name, about and perhaps a mark."""
        self._props["groups"] = groups
        self.update()


class InputForm:
    """A field for each input of a mission."""

    def __init__(self) -> None:
        self._column = ui.column().classes("w-full gap-1")
        self._fields: dict[str, Any] = {}
        self._shown: list[dict[str, Any]] = []

    def show(self, inputs: list[dict[str, Any]]) -> None:
        """Show the fields (:func:`~florence_bt.app.page.editor.looking.inputs`); what is typed stays."""
        if inputs == self._shown:
            return
        self._shown = inputs
        before = {name: field.value for name, field in self._fields.items()}
        self._column.clear()
        with self._column:
            self._fields = {
                each["name"]: input_field(MissionPort(**each)).props("dense outlined stack-label")
                for each in inputs
            }
        for name in before.keys() & self._fields.keys():
            if isinstance(before[name], type(self._fields[name].value)):
                self._fields[name].value = before[name]

    @property
    def values(self) -> dict[str, str]:
        """Read what was typed, without empty fields."""
        texts = {name: text_of(field.value) for name, field in self._fields.items()}
        return {name: text for name, text in texts.items() if text}
