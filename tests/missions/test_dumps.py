"""What people see of a mission: dumps and reasons."""

import pytest


def test_a_running_mission(robot):
    robot.mock("look_for_user", 'running 5 s, then FAILURE no_user_seen "nobody was there"')
    play = robot.start("goto_user")
    robot.run_until(lambda: len(play.calls("look_for_user")) == 2)
    shown = play.tree
    assert "attempt 2 of 8; the last one failed: nobody was there" in shown
    assert "[>] look for user" in shown
    assert "[ ] set user position" in shown


def test_a_failed_mission_tells_each_reason_once(robot):
    robot.mock("robot_in_room", "SUCCESS")
    robot.mock("look_for_user", "running 5 s, then FAILURE no_user_seen")
    play = robot.run("goto_user").assert_failed("no_user_seen", reason="no user seen in 8 of 8 looks")
    assert play.tree.splitlines()[0].startswith("[x] goto_user (sequence)")
    assert play.leaf.startswith("goto_user/")
    assert play.leaf.endswith("look_for_user")


@pytest.mark.parametrize("skill", ["get_user_room", "get_hotspot", "set_user_position", "get_robot_pose"])
def test_a_failure_of_any_skill_names_the_skill(robot, skill):
    robot.mock(skill, 'FAILURE server_lost "nobody answers"')
    robot.run("goto_user").assert_failed("server_lost", reason="nobody answers", leaf=skill)
