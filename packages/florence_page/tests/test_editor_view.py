"""The editor's page: what is saved is what was checked, and a robot runs only what it reads."""

from __future__ import annotations

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

from florence_page.access import Role
from florence_page.editor.desk import Home
from florence_page.editor.elements import MissionText
from florence_page.editor.helpers import Trials
from florence_page.editor.shelf import Shelf
from florence_page.editor.view import EditorPage
from nicegui import ui

from florence_bt.core.errors import FlorenceError
from packages.florence_page.tests.page_user import NotedRobot, actor_for, click, look_at, until

TEXT = "mission: tea\ntree:\n  wait: 1 s\n"


class PlainVerifications:
    """Says that one thing does not hold."""

    running = False

    async def run(self, text, file, folders):
        problem = {"severity": "error", "text": "it is left on", "kind": "left_on", "file": ""}
        place = {"way": ["0 s  wait: RUNNING"], "line": 3, "column": 3, "scenario": "mission: tea\n"}
        return {
            "holds": False,
            "headline": "BROKEN, 1 thing",
            "facts": ["4 states"],
            "problems": [problem | place],
        }


class PlainDesk:
    """Finds nothing wrong, or finds nothing out."""

    def __init__(self, works=True, there=False):
        self.works = works
        self.worker = self
        self.trials = Trials()
        self.words = {}
        self.verifications = PlainVerifications()
        self.robot_there = there

    async def ask(self, what, folders, hotspots, **more):
        if not self.works:
            raise FlorenceError("looking at this took too long")
        return {"findings": [], "outline": [], "inputs": [], "fits": True}

    async def learn(self, home):
        return {"missions": {}, "node_kinds": {}, "skills": {}, "nodes": {}}

    async def reload(self):
        return "reloaded"


def edit(tmp_path, do, desk=None, name="tea", **home):
    """Open a mission in the editor and do something there."""
    shelf = Shelf(tmp_path)
    pages = []

    def show():
        where = Home(shelf, None, **{"there": False, "told": False, "reads_own": False, **home})
        pages.append(
            EditorPage(
                desk or PlainDesk(there=where.there), actor_for(NotedRobot({}), Role.EDIT), where, name, "go"
            )
        )

    look_at(show, lambda user: do(user, pages[-1]))


def test_what_is_typed_while_the_page_asks_is_not_marked_as_saved(tmp_path):
    file = tmp_path / "tea.yaml"
    file.write_text(TEXT)

    async def do(user, page):
        file.write_text(TEXT.replace("1 s", "9 s"))
        await page._on_text(TEXT.replace("1 s", "2 s"))
        user.find(kind=ui.button, marker="save").click()
        await user.should_see("was changed since", retries=50)
        await page._on_text(TEXT.replace("1 s", "3 s"))
        await click(user, "yes")
        await until(lambda: "2 s" in file.read_text())
        await user.should_see("saved in", retries=50)
        (state,) = user.find("state").elements
        assert state.text == "not saved"

    edit(tmp_path, do)


def test_a_text_that_cannot_be_checked_is_not_said_to_have_errors(tmp_path):
    (tmp_path / "tea.yaml").write_text(TEXT)

    async def do(user, page):
        user.find(kind=ui.button, marker="save").click()
        await user.should_see("It could not be checked", retries=50)
        await user.should_not_see("It has errors")

    edit(tmp_path, do, PlainDesk(works=False))


@pytest.mark.parametrize(
    ("name", "reads_own", "offered"),
    [("tea", True, True), ("tea", False, False), ("goto_user", False, True), ("new", False, False)],
)
def test_a_mission_is_run_only_by_a_robot_that_reads_it(tmp_path, name, reads_own, offered):
    (tmp_path / "tea.yaml").write_text(TEXT)

    async def do(user, page):
        await user.should_see("run", retries=50)
        (button,) = user.find(kind=ui.button, marker="run").elements
        assert button.enabled is offered

    edit(tmp_path, do, name=name, there=True, told=True, reads_own=reads_own)


@pytest.mark.parametrize(
    ("opens", "closes"),
    [({"content": "Old versions"}, "Close"), ({"marker": "new"}, "Cancel"), ({"marker": "run"}, "Cancel")],
)
def test_a_dialog_that_is_over_leaves_nothing_on_the_page(tmp_path, opens, closes):
    (tmp_path / "tea.yaml").write_text(TEXT)

    async def do(user, page):
        await user.should_see("run", retries=50)
        before = len(user.client.elements)
        user.find(kind=ui.button, **opens).click()
        await click(user, closes)
        await until(lambda: len(user.client.elements) == before)

    edit(tmp_path, do, there=True, told=True, reads_own=True)


def test_what_does_not_hold_is_marked_until_the_text_changes(tmp_path):
    (tmp_path / "tea.yaml").write_text(TEXT)

    async def do(user, page):
        await click(user, "Verify")
        user.find(kind=ui.button, marker="verify").click()
        for text in ("BROKEN, 1 thing", "it is left on", "0 s  wait: RUNNING"):
            await user.should_see(text, retries=50)
        (editor,) = user.find(kind=MissionText).elements
        [marked] = editor.props["findings"]
        assert (marked["line"], marked["severity"]) == (3, "error") and "left on" in marked["message"]
        user.find(kind=ui.button, marker="save-scenario").click()
        await user.should_see("it fails until the mission is mended", retries=50)
        assert (tmp_path / "scenarios" / "tea.yaml").read_text() == "mission: tea\n"
        await page._on_text(TEXT.replace("1 s", "2 s"))
        assert editor.props["findings"] == []

    edit(tmp_path, do)


def test_a_mission_that_cannot_be_checked_is_not_verified(tmp_path):
    (tmp_path / "tea.yaml").write_text(TEXT)

    async def do(user, page):
        await click(user, "Verify")
        user.find(kind=ui.button, marker="verify").click()
        await user.should_see("could not be checked", retries=50)
        await user.should_not_see("BROKEN")

    edit(tmp_path, do, PlainDesk(works=False))
