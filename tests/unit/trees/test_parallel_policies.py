"""The policies of a parallel, each with every order of ends."""

import itertools

import pytest
from py_trees.common import Status

from tests.unit.trees.language import BROKEN, ENDLESS, Play, takes


def play_of(tmp_path, policy, ends):
    """Three waits that end after 1, 2 and 3 s, by success ("+") or failure ("-")."""
    branches = "".join(
        f"    - {{name: b{index}, sequence: [{{wait: {index + 1} s}},"
        f" {{{'wait: 0' if end == '+' else 'fail: no'}}}]}}\n"
        for index, end in enumerate(ends)
    )
    return Play(tmp_path, f"tree:\n  parallel:\n{branches}  policy: {policy}")


def expected(ends, succeed, fail):
    """When and how it ends, by counting."""
    good = bad = 0
    for second, end in enumerate(ends, start=1):
        good, bad = good + (end == "+"), bad + (end == "-")
        if good >= succeed:
            return "success", second
        if bad >= fail or len(ends) - bad < succeed:
            return "failed", second
    raise AssertionError("it must end")


ENDS = ["".join(ends) for ends in itertools.product("+-", repeat=3)]


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize(
    ("policy", "succeed", "fail"),
    [
        ("all", 3, 1),
        ("any", 1, 3),
        ("{succeed: 2, fail: 1}", 2, 1),
        ("{succeed: 2, fail: 2}", 2, 2),
        ("{succeed: 1}", 1, 9),
        ("{succeed: 3}", 3, 9),
        ("{succeed: 2, fail: 3}", 2, 3),
    ],
)
def test_counting(tmp_path, policy, succeed, fail, ends):
    play = play_of(tmp_path, policy, ends)
    assert (play.run(), play.clock.now()) == expected(ends, succeed, fail)


@pytest.mark.parametrize("ends", ENDS)
def test_named_branches(tmp_path, ends):
    # Done when b0 and b1 have succeeded; any failure before that ends it.
    play = play_of(tmp_path, "[b0, b1]", ends)
    first = ends.find("-") + 1
    assert (play.run(), play.clock.now()) == (("failed", first) if first in (1, 2) else ("success", 2))


@pytest.mark.parametrize(
    ("policy", "status"),
    [
        ("any", "success"),
        ("{succeed: 1, fail: 1}", "success"),
        ("[other]", "success"),
        ("[work]", "broken"),
        ("[work, other]", "broken"),
        ("all", "broken"),
    ],
)
def test_a_success_and_a_failure_in_one_tick(tmp_path, policy, status):
    tree = f"{{parallel: [work: , other: ], policy: {policy}}}"
    assert Play(tmp_path, f"tree: {tree}", work=[takes(0.0, BROKEN)]).run() == status


@pytest.mark.parametrize("policy", ["all", "any", "[second]", "{succeed: 2, fail: 2}"])
def test_of_several_failures_in_one_tick_that_of_the_first_branch_is_told(tmp_path, policy):
    branches = "[{fail: one, code: one, name: first}, {fail: two, code: two, name: second}]"
    assert Play(tmp_path, f"tree: {{parallel: {branches}, policy: {policy}}}").run() == "one"


@pytest.mark.parametrize("policy", ["any", "[other]", "{succeed: 1}"])
def test_the_branches_that_still_run_are_stopped_and_clean_up(tmp_path, policy):
    tree = f"{{parallel: [{{work: , finally: {{clean: }}}}, other: ], policy: {policy}}}"
    play = Play(tmp_path, f"tree: {tree}", work=[ENDLESS], other=[takes(2.0)])
    assert play.run() == "success"
    assert (2.0, "work", "cancelled") in play.ended
    assert (2.0, "clean") in play.started


@pytest.mark.parametrize("policy", ["any", "all"])
def test_one_that_is_stopped_is_over_with_all_below_it(tmp_path, policy):
    play = Play(
        tmp_path, f"tree: {{parallel: [work: , other: ], policy: {policy}}}", work=[ENDLESS], other=[ENDLESS]
    )
    play.at(1.0)
    play.root.stop(Status.INVALID)
    assert play.ended == [(1.0, "work", "cancelled"), (1.0, "other", "cancelled")]
    assert all(node.status is Status.INVALID for node in play.root.iterate())


def test_the_reason_counts_the_failures(tmp_path):
    play = play_of(tmp_path, "any", "---")
    assert play.run() == "failed"
    assert play.why.reason == "3 of 3 branches failed; first: no"


def test_it_starts_anew_each_time(tmp_path):
    tree = "{repeat: 2, do: {parallel: [work: , other: ], policy: any}}"
    play = Play(tmp_path, f"tree: {tree}", work=[takes(1.0)], other=[ENDLESS])
    assert play.run() == "success"
    assert [skill for _, skill in play.started] == ["work", "other"] * 2
