"""The texts of running trees."""

from py_trees.composites import Sequence

from florence_bt.behaviours.composites import Selector
from florence_bt.behaviours.leaves import Fail, SetKey
from florence_bt.behaviours.looping import Retry
from florence_bt.behaviours.pacing import Wait
from florence_bt.core.clock import ManualClock
from tests.ticking import make_context, tick_until
from tests.unit.trees.dumps import ascii_tree


def ticked():
    clock = ManualClock()
    context = make_context(clock)
    root = Sequence(
        "root",
        True,
        [
            SetKey("first", context, {}),
            Selector("choose", True, [Fail("no", context, "it is\nnot"), Wait("pause", context, 1.0)]),
            SetKey("last", context, {}),
        ],
    )
    root.tick_once()
    return root, clock, context


def test_dump_of_a_running_tree():
    root, _, _ = ticked()
    assert ascii_tree(root) == (
        "[>] root (sequence)\n"
        "    [+] first\n"
        "    [>] choose (selector)\n"
        "        [x] no -- it is not\n"
        "        [>] pause\n"
        "    [ ] last"
    )
    assert "last" not in ascii_tree(root, visited_only=True)
    assert ascii_tree(root) == ascii_tree(root)


def test_dump_in_colour_differs_only_in_colour():
    root, _, _ = ticked()
    coloured = ascii_tree(root, colour=True)
    for code in ("\x1b[32m", "\x1b[31m", "\x1b[33m", "\x1b[2m", "\x1b[0m"):
        assert code in coloured
        coloured = coloured.replace(code, "")
    assert coloured == ascii_tree(root)


def test_a_reason_is_told_where_it_begins_and_where_it_changes():
    clock = ManualClock()
    context = make_context(clock)
    retry = Retry("retry", Sequence("try", True, [Fail("no", context, "not so")]), context, 2)
    root = Sequence("root", True, [retry])
    tick_until(root, clock, context)
    assert ascii_tree(root) == (
        "[x] root (sequence)\n"
        "    [x] retry -- 2 of 2 attempts failed; last: not so\n"
        "        [x] try (sequence)\n"
        "            [x] no -- not so"
    )
