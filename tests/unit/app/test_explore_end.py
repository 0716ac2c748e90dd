"""How an exploration ended, in one sentence, from the outputs of the real mission."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from florence_bt.app.maps.explore import MISSION, end_sentence
from florence_bt.mission_testing.mission_tester import MissionTester
from florence_bt.runtime.status import run_tree
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.skills.navigation.navigate.results import OUT_OF_REACH

DONE = {"complete": "true", "looks": "12", "left_aside": "0", "returned": "true"}


def test_it_tells_whether_the_map_is_whole_how_many_looks_and_where_the_robot_is():
    assert end_sentence(RunTree(outputs=DONE)) == (
        "the map is complete; 12 looks; the robot is back where it began"
    )
    told = end_sentence(RunTree(outputs={**DONE, "looks": "1", "left_aside": "1", "returned": "false"}))
    assert "1 look (1 of" in told and "not quite where it began" in told


def test_it_tells_where_the_map_stays_open_in_the_words_of_the_skill():
    where = "2 places; the largest is 1.2 m wide, at (3.1, -4.0)"
    tester = MissionTester()
    tester.defaults(
        get_robot_pose="SUCCESS (pose=(1 m, 2 m, 0 deg))",
        turn="SUCCESS",
        navigate_to="SUCCESS",
        get_frontier=f'SUCCESS (pose=(3 m, 2 m, 0 deg)), then FAILURE out_of_reach "{OUT_OF_REACH}: {where}"',
    )
    run = tester.run(MISSION)
    end = run_tree(run.run, tester.now, nodes=tester.executor.nodes_of(run.run))
    assert end_sentence(end) == (
        f"the map stays open, at {where}: a room may be missing; 1 look; the robot is back where it began"
    )


def test_what_a_mission_of_ones_own_gives_is_told_as_it_is():
    assert end_sentence(RunTree(outputs={"rooms": "3"})) == "outputs rooms: 3"
