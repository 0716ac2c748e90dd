"""Breakpoints on the page: how a row is named for one, which rows have one, and what a click asks for."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

from florence_page.access import Role
from florence_page.breakpoints import ANOTHER_TREE, BreakpointControls
from florence_page.components import BreakpointBar, TreeView
from florence_page.shown_tree import ShownTree
from py_trees.common import Status

from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.trees.drawings.ascii import TreeRow
from packages.florence_page.tests.page_user import NotedRobot, actor_for, look_at, until

TITLES = ((0, "trip (sequence)"), (1, "drive"), (1, "again (selector)"), (2, "drive"), (2, "drive to $room"))
SET = {"florence_bt/breakpoints": SimpleNamespace(success=True, message="", breakpoints=["trip/drive"])}


def tree(*, run_id="7", status=Status.INVALID, **titles):
    """Return the rows of TITLES, some with another title: ``row4="drive to hall"``."""
    rows = [
        TreeRow(depth, status, titles.get(f"row{place}", title), "")
        for place, (depth, title) in enumerate(TITLES)
    ]
    return RunTree(run_id=run_id, mission="trip", nodes=tuple(rows))


SHOWN = ShownTree().followed_by(tree())


@pytest.mark.parametrize(
    ("place", "name"),
    [(0, "trip"), (2, "trip/again"), (1, "trip/drive"), (3, "trip/again/drive"), (4, "trip/drive to $room")],
)
def test_a_row_is_named_with_its_mission_and_by_its_whole_path_where_another_one_has_its_name(place, name):
    assert SHOWN.breakpoint_before(place) == name


@pytest.mark.parametrize(
    ("name", "rows"), [("drive", [1, 3]), ("again/drive", [3]), ("Drive_to $room", [4]), ("home", [])]
)
def test_the_rows_that_a_name_means_are_marked(name, rows):
    assert SHOWN.marked([name]) == rows


def test_a_row_that_has_begun_keeps_the_name_with_its_key_for_this_run():
    begun = tree(status=Status.RUNNING, row4="drive to hall")
    assert SHOWN.followed_by(begun).breakpoint_before(4) == "trip/drive to $room"
    assert ShownTree().followed_by(begun).breakpoint_before(4) == "trip/drive to hall"
    another = tree(run_id="8", status=Status.RUNNING, row4="drive to hall")
    assert SHOWN.followed_by(another).breakpoint_before(4) == "trip/drive to hall"


class Robot(NotedRobot):
    """Shows a tree, and keeps the breakpoints that it is told."""

    def __init__(self, *breakpoints):
        super().__init__(
            SET | {"florence_bt/step": SimpleNamespace(success=False, message="it goes on already")}
        )
        self.tree = SHOWN
        self.breakpoints = breakpoints
        self.on_thread = lambda work: work()
        self.take_breakpoints = lambda names: setattr(self, "breakpoints", tuple(names))


def send(robot, role, what, about, told=""):
    """Let a viewer do something in the tree or in the bar, and wait until it is asked, or told."""

    async def do(user):
        user.find("tree" if what == "break" else "bar").trigger(what, about)
        if told:
            await user.should_see(told, retries=600)
        elif role >= Role.RUN:
            await until(lambda: robot.lines or robot.asked)

    def show():
        tree, bar = TreeView(breaks=True).mark("tree"), BreakpointBar(acts=True).mark("bar")
        BreakpointControls(actor_for(robot, role), tree, bar)

    look_at(show, do)


DRIVE = {"node": 1, "title": "drive"}


@pytest.mark.parametrize(
    ("there", "add", "remove"), [((), ["trip/drive"], []), (("drive", "other"), [], ["drive"])]
)
def test_a_click_before_a_row_sets_a_breakpoint_or_takes_away_what_means_it(there, add, remove):
    robot = Robot(*there)
    send(robot, Role.RUN, "break", DRIVE)
    (request,) = robot.requests("florence_bt/breakpoints")
    assert (list(request.add), list(request.remove)) == (add, remove)
    assert robot.breakpoints == ("trip/drive",), "the answer is shown at once"
    assert "page (run)" in robot.lines[0]


@pytest.mark.parametrize(
    "about", [{"node": 1, "title": "home"}, {"node": 9, "title": "drive"}, {"node": "1"}, {}]
)
def test_a_row_that_is_another_one_by_now_gets_no_breakpoint(about):
    robot = Robot()
    send(robot, Role.RUN, "break", about, told=ANOTHER_TREE)
    assert not robot.asked


def test_a_step_is_for_the_run_on_the_screen_and_a_refusal_is_told():
    robot = Robot()
    send(robot, Role.RUN, "step", {"run_id": "7"}, told="it goes on already")
    (request,) = robot.requests("florence_bt/step")
    assert request.run_id == "7" and request.valid_until.sec > 0


@pytest.mark.parametrize(
    ("what", "about"),
    [("break", DRIVE), ("step", {"run_id": "7"}), ("go_on", {}), ("remove", {"name": "drive"})],
)
def test_who_may_only_look_does_nothing(what, about):
    robot = Robot("drive")
    send(robot, Role.LOOK, what, about)
    assert not robot.asked
