"""Which branch an ``if`` and a ``switch`` do, and how they end."""

import pytest
from py_trees.behaviours import Success as Succeed
from py_trees.common import Status

from florence_bt.behaviours.branching import If, Switch
from florence_bt.behaviours.expressions import CompiledExpression
from florence_bt.behaviours.keys import KeyReference
from florence_bt.behaviours.leaves import Fail
from florence_bt.behaviours.why import Why, explain
from tests.ticking import make_context

FREE = CompiledExpression("free", lambda keys: keys.read("free"), ("free",))


def test_the_branch_that_is_chosen_is_done_and_gives_the_status(clock):
    context = make_context(clock, keys={"free": True})
    root = If("if free", context, FREE, Fail("go", context, "shut", "blocked"), Succeed("stay"))
    root.tick_once()
    assert (root.status, [child.status for child in root.children]) == (
        Status.FAILURE,
        [Status.FAILURE, Status.INVALID],
    )
    assert explain(root) == Why("if free/go", "blocked", "shut")
    assert root.feedback_message == "holds (free is true)"
    context.keys.write("free", False)
    root.tick_once()
    assert (root.status, root.current_child.name) == (Status.SUCCESS, "stay")
    assert root.feedback_message == "does not hold (free is false)"


def test_without_a_branch_for_the_answer_nothing_is_done_and_that_is_a_success(clock):
    context = make_context(clock, keys={"free": False})
    root = If("if free", context, FREE, Fail("go", context, "never asked"))
    root.tick_once()
    assert (root.status, root.children[0].status) == (Status.SUCCESS, Status.INVALID)


@pytest.mark.parametrize(("room", "branch"), [("hall", "a"), ("attic", "b"), ("cellar", "b"), (7, "rest")])
def test_a_switch_does_the_branch_whose_case_fits(clock, room, branch):
    context = make_context(clock, keys={"room": room})
    cases = [(("hall",), Succeed("a")), (("attic", "cellar"), Succeed("b"))]
    root = Switch("switch", context, KeyReference("room"), cases, Succeed("rest"))
    root.tick_once()
    done = [child.name for child in root.children if child.status is Status.SUCCESS]
    assert (root.status, done) == (Status.SUCCESS, [branch])


def test_a_switch_without_a_case_that_fits_names_those_that_there_are(clock):
    context = make_context(clock, keys={"room": "attic"})
    root = Switch("switch", context, KeyReference("room"), [(("hall",), Succeed("a"))], labels=["hall"])
    root.tick_once()
    assert explain(root) == Why("switch", "no_case", "the value is attic; there are cases for: hall")
    assert root.children[0].status is Status.INVALID
