"""The pages of the history: the list of runs, and a run with its slider."""

from __future__ import annotations

import gc
import weakref

import pytest

pytest.importorskip("nicegui")

from florence_page.history import MOST_KEPT, RecentPlaybacks, add_history, run_address, runs_address
from nicegui import ui

from florence_bt.app.runs.playback import read_playback
from packages.florence_page.tests.page_user import look_at
from tests.recorded_runs import record_run, resumable_missions
from tests.unit.app.test_playback import record


def history_of(folder):
    def show():
        add_history(folder)
        ui.label("begin")

    return show


def test_the_list_leads_to_a_run_and_its_slider_shows_it_as_it_ran(tmp_path):
    for number in range(1, 31):
        record(tmp_path, number, mission="fetch" if number > 1 else "carry")

    async def do(user):
        await user.open(runs_address())
        await user.should_see("fetch")
        await user.should_not_see("carry")
        await user.should_see("a chair")
        user.find("earlier").click()
        await user.should_see("carry", retries=100)
        await user.should_not_see("earlier")
        await user.open(run_address("T-00002-fetch"))
        await user.should_see("fetch › drive")
        await user.should_see("+3.5 s")
        (slider,) = user.find("slider").elements
        slider.value = 0
        await user.should_see("+0.0 s the run started", retries=100)
        user.find("next").click()
        await user.should_see("fetch › look: success", retries=100)

    look_at(history_of(tmp_path), do)


def test_a_mission_narrows_the_list(tmp_path):
    for number, mission in enumerate(("carry", "fetch"), 1):
        record(tmp_path, number, mission=mission)

    async def do(user):
        await user.open(runs_address())
        await user.should_see("carry", retries=100)
        user.find(marker="mission").type(" fetch ").trigger("keydown.enter")
        await user.should_not_see("carry", retries=100)
        await user.should_see("fetch")

    look_at(history_of(tmp_path), do)


@pytest.mark.parametrize("address", ["run?id=../../etc", "run", "runs?page=-5&mission=%27%3B--&state=x"])
def test_what_does_not_exist_is_told(tmp_path, address):
    record(tmp_path)

    async def do(user):
        await user.open(address)
        await user.should_see("none" if address.startswith("runs") else "problem")

    look_at(history_of(tmp_path), do)


def test_without_a_journal_the_page_says_so(tmp_path):
    async def do(user):
        await user.open(runs_address())
        await user.should_see("there is no journal")

    look_at(history_of(tmp_path), do)


def test_only_the_runs_that_were_looked_at_last_are_kept_and_the_others_can_be_looked_at_still(tmp_path):
    ids = [record(tmp_path, number) for number in range(1, MOST_KEPT + 3)]
    recent = RecentPlaybacks(tmp_path)
    opened = [weakref.ref(recent.open(each)[0]) for each in ids]
    gc.collect()  # why a run cannot be run again is an error, whose traceback knows the run
    assert [each() is not None for each in opened] == [False] * 2 + [True] * MOST_KEPT
    assert recent.moment(ids[0], 0).text == "the run started"
    gc.collect()
    assert opened[2]() is None and opened[3]() is not None


def test_a_run_is_read_as_it_is_when_it_is_opened(tmp_path):
    run_id = record(tmp_path)
    recent = RecentPlaybacks(tmp_path)
    assert recent.open(run_id)[0].path
    (tmp_path / run_id / "result.json").unlink()
    assert not recent.open(run_id)[0].path


def test_keys_buttons_and_marks_lead_to_the_failures_and_the_keys_are_shown(tmp_path):
    resumable_missions(tmp_path / "missions")
    run_id = record_run(tmp_path / "missions", tmp_path / "runs", "goto_user", 3)[0].run_id
    playback = read_playback(tmp_path / "runs", run_id)
    failures = [mark.step for mark in playback.marks if mark.kind == "failure"]
    last, seen = len(playback) - 1, []

    async def do(user):
        await user.open(run_address(run_id))
        await user.should_see(f"step {last + 1} of {last + 1}")
        for act, step in (
            ("g", 0),
            ("ArrowRight", 1),
            ("f", failures[0]),
            ("f", failures[1]),
            ("F", failures[0]),
            ("End", last),
            ("Home", 0),
        ):
            user.find(marker="pressed").trigger("go", act)
            await user.should_see(f"step {step + 1} of {last + 1}", retries=600)
        for button, step in (
            ("next failure", failures[0]),
            ("next", failures[0] + 1),
            ("failure before", failures[0]),
        ):
            user.find(marker=button).click()
            await user.should_see(f"step {step + 1} of {last + 1}", retries=600)
        user.find(marker="stop").click()
        await user.should_see("recovered", retries=600)
        (keys,) = user.find(marker="keys").elements
        seen.append(keys.content)

    look_at(history_of(tmp_path / "runs"), do)
    assert "room = " in seen[0]
