"""The status of goto_user fits a screen at every moment, and nobody misses what runs and what failed."""

import pytest

from tests.unit.trees.dumps import run_dump

MANY = 60
FAR = "SUCCESS (user=(5 m, 2 m, 180 deg), distance=2 m, user_id=7, posture=standing)"
CASES = {
    "all goes well": {},
    "nobody is there from nearby": {"make_sure/**/look_for_user": "running 5 s, then FAILURE no_user_seen"},
    "nobody anywhere": {"look_for_user": "running 5 s, then FAILURE no_user_seen"},
    "no way to anybody": {"navigate_to": "running 3 s, then FAILURE no_path"},
    "they walk on": {
        "see whether they have moved on/**/look_for_user": f"running 1 s, then {FAR}",
        "follow_user": "running 3 s, then FAILURE user_lost",
        "search_for_user": "running 3 s, then FAILURE user_lost",
    },
    "no battery": {"make_sure/**/navigate_to": "running 3 s, then FAILURE battery"},
}


def lines_that_count(tree):
    """The lines of leaves that run, and of failures that no node above has dealt with."""
    lines = tree.splitlines()
    depths = [(len(line) - len(line.lstrip())) // 4 for line in lines]
    way, found = [], []
    for line, depth, below in zip(lines, depths, [*depths[1:], 0], strict=True):
        mark = line.strip()[:3]
        del way[depth:]
        way.append(mark)
        if (mark == "[>]" and below <= depth) or (mark == "[x]" and set(way) <= {"[x]", "[>]"}):
            found.append(line)
    return found


@pytest.mark.parametrize("case", CASES)
def test_goto_user(robot, case):
    for pattern, script in CASES[case].items():
        robot.mock(pattern, script)
    play = robot.start("goto_user")
    for _ in range(150):
        robot.advance(0.7)
        folded, whole = run_dump(robot.executor, play.run), play.tree
        assert len(folded.splitlines()) < MANY, folded
        assert set(lines_that_count(whole)) <= set(folded.splitlines())
        if play.done:
            break
    assert len(whole.splitlines()) > 2 * MANY


def test_a_failure_inside_called_missions_is_shown_with_its_reason(robot):
    robot.mock("stop before them/**/navigate_to", "running 3 s, then FAILURE battery")
    play = robot.run("goto_user").assert_failed("battery")
    failed = [line for line in run_dump(robot.executor, play.run).splitlines() if play.reason in line]
    assert failed and failed[-1].strip().startswith("[x] navigate to")
