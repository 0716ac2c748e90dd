"""Dumps of trees as text: colour, visited path, durations."""

from __future__ import annotations

import re

import pytest
from py_trees.behaviours import Success
from py_trees.composites import Sequence

from florence_bt.behaviours.composites import Selector
from florence_bt.behaviours.decorators import Invert
from florence_bt.behaviours.leaves import Fail, SetKey
from florence_bt.behaviours.pacing import Wait
from florence_bt.core.clock import ManualClock
from florence_bt.trees.drawings.ascii import draw_rows, tree_rows
from tests.ticking import make_context
from tests.unit.trees.dumps import ascii_tree


@pytest.fixture
def root():
    clock = ManualClock()
    context = make_context(clock)
    reason = "there is a chair\nin the way, and behind it another one"
    tree = Sequence(
        "all",
        True,
        [
            Selector(
                "find", True, [Invert("not there", SetKey("there", context, {})), SetKey("here", context, {})]
            ),
            Selector("go", True, [Fail("drive", context, reason), Wait("rest", context, 3.0)]),
            SetKey("never", context, {}),
        ],
    )
    tree.tick_once()
    return tree


WHOLE = """\
[>] all (sequence)
    [+] find (selector)
        [x] not there -- there succeeded, but the opposite was wanted
            [+] there
        [+] here
    [>] go (selector)
        [x] drive -- there is a chair in the way, and behind it another one
        [>] rest
    [ ] never"""


def test_the_whole_tree(root):
    assert ascii_tree(root) == WHOLE


def test_the_visited_path_leaves_out_what_was_not_reached(root):
    assert ascii_tree(root, visited_only=True) == WHOLE.replace("\n    [ ] never", "")


def test_colours_change_nothing_but_the_marks(root):
    coloured = ascii_tree(root, colour=True)
    assert "\x1b[32m[+]\x1b[0m find" in coloured and "\x1b[31m[x]\x1b[0m drive" in coloured
    assert re.sub(r"\x1b\[\d+m", "", coloured) == WHOLE


def test_durations_stand_behind_the_names_of_nodes_that_were_reached(root):
    text = ascii_tree(root, durations=lambda node: 2.04 if node.name in ("drive", "all") else None)
    assert "[>] all (sequence) (2.0 s)\n" in text
    assert "[x] drive (2.0 s) -- there is a chair" in text
    assert re.sub(r" \(2\.0 s\)", "", text) == WHOLE


def test_rows_can_be_drawn_after_the_tree_has_forgotten_everything(root):
    rows = tree_rows(root, lambda node: None, lambda node: None)
    for node in root.iterate():
        node.feedback_message = ""
    assert draw_rows(rows) == WHOLE


def test_a_deep_tree_is_drawn_without_recursion():
    node = Success("leaf")
    for number in range(3000):
        node = Sequence(f"level {number}", True, [node])
    assert len(ascii_tree(node).splitlines()) == 3001
