"""The processes that work for the editor: an answer belongs to its question."""

from __future__ import annotations

import asyncio
import sys
import tempfile
from pathlib import Path

import pytest
from florence_page.editor.helpers import ScenarioRuns, Trials, Verifications, Worker
from florence_page.editor.trial_request import TrialRequest

from florence_bt.core.errors import FlorenceError

TEXT = "mission: {name}\ntree:\n  wait: 1 s\n"


def test_a_question_that_was_given_up_leaves_no_answer_for_the_next_one():
    async def go():
        worker = Worker()

        async def rows(name):
            look = await worker.ask("look", (), None, text=TEXT.format(name=name), name=name)
            return look["outline"]

        try:
            before = await rows("first")
            asked = asyncio.create_task(rows("second"))
            await asyncio.sleep(0)  # it has written its question
            asked.cancel()
            await asyncio.gather(asked, return_exceptions=True)
            return before, await rows("third"), await rows("fourth")
        finally:
            await worker.close()

    first, third, fourth = asyncio.run(go())
    assert "first" in str(first) and "third" in str(third) and "fourth" in str(fourth)


@pytest.fixture
def room(tmp_path, monkeypatch):
    """A folder for what is passing."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


REQUEST = TrialRequest(name="tea", text=TEXT.format(name="tea"))


def test_a_trial_that_is_ended_at_once_leaves_nothing(room):
    async def go():
        trials = Trials()
        await trials.start(REQUEST)
        while not (began := list(room.iterdir())):
            await asyncio.sleep(0.01)
        await trials.close()
        return began, trials.running

    began, running = asyncio.run(go())
    assert began and not running and not list(room.iterdir())


def test_that_the_rig_cannot_be_started_is_told(room, monkeypatch):
    monkeypatch.setattr(sys, "executable", str(room / "no_such_program"))

    async def go():
        trials = Trials()
        await trials.start(REQUEST)
        while trials.running:
            await asyncio.sleep(0.01)
        return trials.last

    assert "cannot be started" in asyncio.run(go())["problem"]


def test_scenarios_end_with_the_page(room):
    scenarios = room / "tea.yaml"
    scenarios.write_text("")

    async def go():
        runs = ScenarioRuns()
        asked = asyncio.create_task(runs.run("tea", REQUEST.text, scenarios, [], lambda said: None))
        while runs._process is None and not asked.done():
            await asyncio.sleep(0.01)
        process = runs._process
        await runs.close()
        return await asked, process.returncode

    results, code = asyncio.run(go())
    assert results == [] and code < 0
    assert list(room.iterdir()) == [Path(scenarios)]


def test_a_verification_answers_and_can_be_stopped(room):
    async def go():
        runs, file = Verifications(), room / "tea.yaml"
        answer = await runs.run(REQUEST.text, file, [])
        asked = asyncio.create_task(runs.run(REQUEST.text, file, []))
        while not runs.running:
            await asyncio.sleep(0.01)
        with pytest.raises(FlorenceError, match="already"):
            await runs.run(REQUEST.text, file, [])
        await runs.stop()
        with pytest.raises(FlorenceError, match="it was stopped"):
            await asked
        return answer, runs.running

    answer, running = asyncio.run(go())
    assert answer["holds"] and not running


def test_that_a_mission_cannot_be_verified_is_told(room):
    with pytest.raises(FlorenceError, match="tree"):
        asyncio.run(Verifications().run("mission: tea\n", room / "tea.yaml", []))
