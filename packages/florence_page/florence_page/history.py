"""The history: the list of recorded runs, and each run as it ran."""

from __future__ import annotations

import asyncio
import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from pathlib import Path
from urllib.parse import urlencode

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from florence_bt.app.runs.playback import (
    MOST_EVENTS,
    Mark,
    Moment,
    Playback,
    RunsPage,
    read_playback,
    read_runs,
)
from florence_bt.core.errors import FlorenceError
from florence_bt.runtime.journal import JournaledRun
from florence_bt.runtime.run import RunStatus
from florence_bt.runtime.status import duration_text
from florence_page.components import MapView, RunKeys, TreeView

RUNS_A_PAGE = 25
DEEPEST_PAGE = 1_000_000
PAGE = 10
"""Steps of a page key, as in the terminal."""
FAILURE = "failure"
_MARK_COLOURS = {FAILURE: "#b3261e", "stop": "#8a6d00", "question": "#1f6fd6"}
_MARK_PLACES = 400
"""So many marks of a kind can stand beside each other below the slider."""
_NEW_KEY = ' style="color:#2a7f3b"'
_GOES = {"ArrowLeft": "before", "ArrowRight": "next", "f": "next failure", "F": "failure before"}
_KEY_SIGNS = {"ArrowLeft": "←", "ArrowRight": "→"}
OPEN_S = 60.0
"""Seconds that a run may take to be opened: it is run again. Chosen for 5,000 events on a busy machine."""
MOST_KEPT = 4
"""How many runs are kept for whoever looks at them next."""
_COLOURS = {RunStatus.SUCCEEDED: "positive", RunStatus.FAILED: "negative", RunStatus.ABORTED: "negative"}
_COLUMNS = ("accepted (UTC)", "mission", "state", "took", "who", "why")
_EXAMPLE = "goto_user"


def add_history(folder: Path | None) -> None:
    """Add the pages of the history.

    Args:
        folder: The folder of the journal; None for that of the running system.
    """

    @ui.page("/runs", title="Runs")
    async def runs(page: int = 0, mission: str = "", state: str = "") -> None:
        page = min(max(page, 0), DEEPEST_PAGE)
        ui.query(".nicegui-content").classes("p-2 gap-2 w-full")
        try:
            found = await asyncio.to_thread(
                read_runs, folder, skip=page * RUNS_A_PAGE, limit=RUNS_A_PAGE, mission=mission, state=state
            )
        except FlorenceError as error:
            _show_problem(error)
            return
        _show_runs(found, page, mission, state)

    recent = RecentPlaybacks(folder)

    @ui.page("/run", title="Run", response_timeout=OPEN_S)
    async def run(id: str = "") -> None:
        try:
            playback, moment = await asyncio.to_thread(recent.open, id)
        except FlorenceError as error:
            _show_problem(error)
            return
        RunPage(playback, moment, partial(recent.moment, id))


class RecentPlaybacks:
    """The runs that were looked at last, for all who look: each has up to :data:`MOST_EVENTS` events.

    Args:
        folder: The folder of the journal; None for that of the running system.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._kept: OrderedDict[str, Playback] = OrderedDict()
        self._turn = threading.Lock()

    def open(self, run_id: str) -> tuple[Playback, Moment]:
        """Read a run as it is now; return it, and its last moment.

        Raises:
            ConfigError: As :func:`~florence_bt.app.runs.playback.read_playback`.
        """
        with self._turn:
            self._kept.pop(run_id, None)
            playback = self._find(run_id)
            return playback, playback.moment(len(playback) - 1)

    def moment(self, run_id: str, number: int) -> Moment:
        """Return how a run that was opened stood after one of its steps.

        Raises:
            ConfigError: It is gone from the journal.
        """
        with self._turn:  # to be run again, a run has one place at a time
            return self._find(run_id).moment(number)

    def _find(self, run_id: str) -> Playback:
        playback = self._kept.pop(run_id, None) or read_playback(self._folder, run_id)
        self._kept[run_id] = playback
        if len(self._kept) > MOST_KEPT:
            self._kept.popitem(last=False)
        return playback


def _show_problem(error: FlorenceError) -> None:
    ui.label(str(error)).classes("text-negative").mark("problem")
    ui.link("the robot", ".")


def runs_address(page: int = 0, mission: str = "", state: str = "") -> str:
    """Return the address of a part of the list of runs, relative to the page's own."""
    given = {"page": str(page) if page else "", "mission": mission, "state": state}
    query = urlencode({name: value for name, value in given.items() if value})
    return f"runs?{query}" if query else "runs"


def run_address(run_id: str) -> str:
    """Return the address of a run, relative to the page's own."""
    return f"run?{urlencode({'id': run_id})}"


def _show_runs(found: RunsPage, page: int, mission: str, state: str) -> None:
    with ui.row().classes("w-full items-center gap-2"):
        ui.link("‹ the robot", ".")
        name = ui.input("mission", value=mission, placeholder=_EXAMPLE).props("dense").mark("mission")
        states = {"": "any", **{status.value.lower(): status.value.lower() for status in RunStatus}}
        wanted = ui.select(states, label="state", value=state if state in states else "").props("dense")

        def look() -> None:
            ui.navigate.to(runs_address(0, str(name.value or "").strip(), str(wanted.value or "")))

        name.on("keydown.enter", look)
        wanted.on_value_change(look)
    with ui.element("div").classes("w-full overflow-x-auto"), ui.element("table").classes("w-full text-sm"):
        with ui.element("tr").classes("text-left"):
            for title in _COLUMNS:
                with ui.element("th").classes("pr-3"):
                    ui.label(title)
        for run in found.runs:
            _show_row(run)
    if not found.runs:
        ui.label("no run is recorded that fits").mark("none")
    with ui.row().classes("gap-4"):
        if page:
            ui.link("‹ later", runs_address(page - 1, mission, state)).mark("later")
        if found.more:
            ui.link("earlier ›", runs_address(page + 1, mission, state)).mark("earlier")


def _show_row(run: JournaledRun) -> None:
    took = duration_text(run.as_run(), run.ended) if run.ended is not None else ""
    accepted = run.accepted.replace("T", " ").partition(".")[0]
    with ui.element("tr").classes("border-t align-top"):
        cells = [accepted, run.mission, run.state.lower(), took, run.caller, run.reason]
        for title, text in zip(_COLUMNS, cells, strict=True):
            with ui.element("td").classes("pr-3 py-1" + ("" if title == "why" else " whitespace-nowrap")):
                if title == "mission":
                    ui.link(text, run_address(run.run_id))
                elif title == "state":
                    ui.label(text).classes(f"text-{_COLOURS.get(run.status, 'warning')}")
                else:
                    ui.label(text)


def _show_head(playback: Playback) -> None:
    run = playback.run
    with ui.row().classes("w-full items-center gap-2"):
        ui.link("‹ all runs", "runs")
        ui.label(run.mission).classes("font-bold")
        ui.label(run.state.lower()).classes(f"text-{_COLOURS.get(run.status, 'warning')}")
        accepted = run.accepted.replace("T", " ").partition(".")[0]
        ui.label(f"recorded {accepted} UTC").classes("text-xs text-grey")
        ui.label(run.run_id).classes("text-xs text-grey max-sm:hidden")
    if run.reason:
        ui.label(run.reason).classes("text-negative" if run.status is not RunStatus.SUCCEEDED else "")
    if run.cause:
        ui.label(" › ".join(run.cause.split("/"))).classes("text-sm").mark("cause")
    if playback.cut:
        ui.label(f"only its first {MOST_EVENTS} events are shown").classes("text-warning")


class RunPage:
    """One run as it was: a slider over its steps with marks, its tree and keys, and the map with its way.

    Args:
        playback: The run; it is not kept.
        end: Its last moment.
        moment: Gives how it stood after a step.
    """

    def __init__(self, playback: Playback, end: Moment, moment: Callable[[int], Moment]) -> None:
        self._moment = moment
        ui.query(".nicegui-content").classes("p-2 gap-1 w-full h-dvh no-wrap")
        _show_head(playback)
        self._last = len(playback) - 1
        self._failures = sorted({mark.step for mark in playback.marks if mark.kind == FAILURE})
        self._wanted = self._shown = self._last
        self._busy = False
        with ui.row().classes("w-full items-center gap-2 no-wrap"):
            self._button("keyboard_double_arrow_left", "F")
            self._button("chevron_left", "ArrowLeft")
            with ui.element("div").classes("grow"):
                self._slider = (
                    ui.slider(min=0, max=max(self._last, 1), value=self._last, on_change=self._on_slide)
                    .classes("w-full")
                    .mark("slider")
                )
                self._show_marks(playback.marks)
            self._button("chevron_right", "ArrowRight")
            self._button("keyboard_double_arrow_right", "f")
        RunKeys().on("go", lambda event: self._go(event.args)).mark("pressed")
        self._text = ui.label().classes("text-sm h-10 shrink-0 overflow-y-auto").mark("moment")
        halves = "grid grid-cols-1 grid-rows-2 lg:grid-cols-2 lg:grid-rows-1 gap-2"
        with ui.element("div").classes(f"w-full grow min-h-0 {halves}"):
            self._map = MapView(path=playback.path).classes("w-full h-full")
            with ui.element("div").classes("flex flex-col flex-nowrap w-full h-full min-h-0"):
                tree = TreeView(rows=end.rows, cause=playback.cause)
                self._tree = tree.classes("w-full grow min-h-0").mark("tree")
                if playback.without:
                    why = ui.label(f"the keys are not known: {playback.without}")
                    why.classes("text-xs text-grey-8 shrink-0 max-h-8 overflow-y-auto")
                keys = ui.html(sanitize=False).classes("w-full text-xs font-mono max-h-28 overflow-y-auto")
                self._keys = keys.props("role=list aria-label=keys").mark("keys")
        self._show(end)

    def _button(self, icon: str, key: str) -> None:
        """Add a button that does what a key does."""
        title = f"{_GOES[key]} ({_KEY_SIGNS.get(key, key)})"
        button = ui.button(icon=icon, on_click=lambda: self._go(key)).props(
            f'flat dense aria-label="{title}"'
        )
        button.tooltip(title).mark(_GOES[key])
        if key in ("f", "F") and not self._failures:
            button.disable()

    def _show_marks(self, marks: Sequence[Mark]) -> None:
        """Draw the marks below the slider, where they are: a click goes there."""
        with ui.element("div").classes("relative w-full h-3").mark("marks"):
            shown = {
                (round(_MARK_PLACES * mark.step / max(self._last, 1)), mark.kind): mark for mark in marks
            }
            for (place, kind), mark in shown.items():
                tick = ui.element("button").props(f'data-kind={kind} aria-label="{kind}"').tooltip(mark.text)
                tick.classes("absolute top-0 w-1.5 h-3 -ml-[3px] rounded-sm").mark(kind)
                tick.style(f"left: {100.0 * place / _MARK_PLACES:.1f}%; background: {_MARK_COLOURS[kind]}")
                tick.on("click", partial(self._slider.set_value, mark.step))

    def _go(self, key: object) -> None:
        """Go where a key leads; one that means nothing leads nowhere."""
        here, last = self._wanted, self._last
        steps = {"ArrowRight": 1, "ArrowLeft": -1, "PageDown": PAGE, "PageUp": -PAGE}
        if key in steps:
            self._slider.value = min(max(here + steps[str(key)], 0), last)
        elif key in ("g", "Home"):
            self._slider.value = 0
        elif key in ("G", "End"):
            self._slider.value = last
        elif key == "f":
            self._slider.value = next((step for step in self._failures if step > here), here)
        elif key == "F":
            self._slider.value = next((step for step in reversed(self._failures) if step < here), here)

    async def _on_slide(self, event: ValueChangeEventArguments) -> None:
        """Show the step that was chosen last; it is worked out on a thread: others look at the page, too."""
        if isinstance(event.value, int | float):
            self._wanted = int(event.value)
        if self._busy:
            return
        self._busy = True
        try:
            while self._shown != self._wanted:
                self._shown = self._wanted
                self._show(await asyncio.to_thread(self._moment, self._shown))
        except FlorenceError as error:
            ui.notify(str(error), type="negative", multi_line=True)
        finally:
            self._busy = False

    def _show(self, moment: Moment) -> None:
        said = f' · said "{moment.said}"' if moment.said else ""
        step = f"step {self._shown + 1} of {self._last + 1}"
        self._text.text = f"{step} · +{moment.at:.1f} s {moment.text}{said}"
        self._map.show_way(moment.points, moment.person)
        self._tree.show_rows(moment.rows)
        self._keys.set_content("".join(_key_line(moment, name) for name in _new_first(moment)))


def _new_first(moment: Moment) -> list[str]:
    return sorted(moment.keys, key=lambda name: name not in moment.changed)


def _key_line(moment: Moment, name: str) -> str:
    """Write a key with its value as it was; one that has just changed is green."""
    text = escape(f"{name.removeprefix('/')} = {moment.keys[name]}")
    return f'<div role="listitem"{_NEW_KEY if name in moment.changed else ""}>{text}</div>'
