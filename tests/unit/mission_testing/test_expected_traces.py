"""Expected traces: nodes by patterns, times in every unit, and differences that show only what differs."""

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing import MissionTester
from florence_bt.mission_testing.record import TraceLine, read_line


@pytest.fixture
def play():
    stage = MissionTester()
    stage.defaults(
        get_robot_pose="SUCCESS (pose=(0 m, 0 m, 0 deg)), then SUCCESS (pose=(1 m, 0 m, 0 deg))",
        propose_approach_pose="SUCCESS (pose=(1 m, 0 m, 0 deg))",
        navigate_to="running 15 s, then SUCCESS",
    )
    return stage.run("approach_user", user="(3 m, 2 m, 0 deg)")


def test_a_line():
    assert read_line("  4.2 s   look for user: SUCCESS ") == TraceLine(4.2, "look for user", "SUCCESS")
    assert read_line("1 min a/**/b: c: RUNNING") == TraceLine(60.0, "a/**/b: c", "RUNNING")
    assert read_line("0 s x:FAILURE").status == "FAILURE"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        *[(text, "not a line of a trace") for text in ("", "x", "x: SUCCESS", "3 s x")],
        ("3 s x: success", "no status 'success'"),
        ("3 s x: INVALID", "no status 'INVALID'"),
        *[(text, "needs a unit") for text in ("3 x: SUCCESS", "3 s: SUCCESS")],
        ("3 m x: SUCCESS", "not a unit"),
        ("-3 s x: SUCCESS", "cannot be"),
        ("3 s a//b: SUCCESS", "not a pattern"),
    ],
)
def test_what_is_no_line(text, says):
    with pytest.raises(ConfigError, match=says):
        read_line(text)


def test_nodes_may_be_named_by_any_pattern_and_times_in_any_unit(play):
    play.assert_trace("""
        0 s    set seen: SUCCESS
        0 ms   drive_before/**/get_robot_pose: SUCCESS
        0 s    approach_user/**/propose*: SUCCESS
        0 s    navigate to: RUNNING
        0.25 min  **/navigate_to: SUCCESS
        15 s   set nearest: SUCCESS
        15 s   approach the person/get_robot_pose: SUCCESS
    """)
    play.assert_trace("0 s navigate_to: RUNNING\n15 s navigate_to: SUCCESS", "navigate_to")


def test_a_difference_shows_only_what_differs(play):
    with pytest.raises(AssertionError) as caught:
        play.assert_trace("0 s navigate to: RUNNING\n20 s **/navigate_to: SUCCESS", "navigate_to")
    lines = caught.value.problem.splitlines()
    assert [line for line in lines if line.startswith(("+", "-")) and line[:3] not in ("+++", "---")] == [
        "-20 s  navigate_to: SUCCESS",
        "+15 s  navigate_to: SUCCESS",
    ]


@pytest.mark.parametrize("text", ["0 s navigate_to: RUNNING", "0 s navigate_to: RUNNING\n" * 3])
def test_lines_that_are_missing_or_too_many(play, text):
    with pytest.raises(AssertionError, match="the trace differs"):
        play.assert_trace(text, "navigate_to")


def test_a_line_for_a_node_that_is_not_there(play):
    with pytest.raises(ConfigError, match="'navigat_to' matches no node"):
        play.assert_trace("0 s navigat_to: RUNNING")


def test_values_are_held_against_their_kinds(play):
    play.assert_succeeded(pose="(100 cm, 0 m, 0 deg)").assert_keys({"limit": "2 min"})
    for assertion in (play.assert_keys, play.assert_outputs):
        with pytest.raises(ConfigError, match="a pose is needed"):
            assertion({"pose": "3 m"})
    with pytest.raises(ConfigError, match="'m' is not a unit of a duration"):
        play.assert_keys({"limit": "120 m"})
    with pytest.raises(AssertionError, match="the key limit is 2 min, not 1 min"):
        play.assert_keys({"limit": "1 min"})
