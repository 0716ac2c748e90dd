"""What people see of a mission: dumps and reasons."""

import pytest


def test_a_running_mission(robot):
    robot.mock("look_for_user", 'running 5 s, then FAILURE no_user_seen "nobody was there"')
    play = robot.start("goto_user")
    robot.run_until(lambda: len(play.calls("look_for_user")) == 2)
    assert (
        play.tree
        == """\
[>] goto_user (sequence)
    [+] get user room
    [>] find the user (selector)
        [x] search from here (sequence) -- the robot is in another room
            [ ] robot in room
            [ ] run detect_user
                [ ] search in a circle (finally)
                    [ ] retry up to $looks times
                        [ ] turn and look (sequence)
                            [ ] stop tracker
                            [ ] turn
                            [ ] settle
                            [ ] start tracker
                            [ ] repeat a look without pictures
                                [ ] look for user
                    [ ] stop tracker
        [>] search from the hotspot of the room (sequence)
            [+] get hotspot
            [+] navigate to
            [>] run detect_user
                [>] search in a circle (finally)
                    [>] retry up to $looks times -- attempt 2 of 8; the last one failed: nobody was there
                        [>] turn and look (sequence)
                            [+] stop tracker
                            [+] turn
                            [+] settle
                            [+] start tracker
                            [>] repeat a look without pictures
                                [>] look for user
                    [ ] stop tracker
    [ ] set user position
    [ ] run approach_user
        [ ] within $limit
            [ ] approach the person (sequence)
                [ ] get robot pose
                [ ] retry up to 3 times
                    [ ] propose and drive (sequence)
                        [ ] propose approach pose
                        [ ] navigate to"""
    )


def test_a_failed_mission_tells_each_reason_once(robot):
    robot.mock("look_for_user", "running 5 s, then FAILURE no_user_seen")
    play = robot.run("goto_user").assert_failed("no_user_seen", reason="no user seen in 8 of 8 looks")
    assert play.tree.count("no user seen in 8 of 8 looks") == 1
    assert play.tree.count("the robot is in another room") == 1
    assert play.tree.splitlines()[0] == "[x] goto_user (sequence)"
    assert play.leaf.startswith("goto_user/")
    assert play.leaf.endswith("look_for_user")


def test_two_searches_that_fail_alike_tell_it_once_each(robot):
    robot.mock("robot_in_room", "SUCCESS")
    robot.mock("look_for_user", "running 5 s, then FAILURE no_user_seen")
    play = robot.run("goto_user").assert_failed("no_user_seen", reason="no user seen in 8 of 8 looks")
    assert len(play.calls("look_for_user")) == 16
    telling = [line.strip() for line in play.tree.splitlines() if "no user seen in 8 of 8 looks" in line]
    assert telling == [
        "[x] search from here (sequence) -- no user seen in 8 of 8 looks",
        "[x] search in a circle (finally) -- no user seen in 8 of 8 looks",
    ]


SKILLS = (
    "get_user_room",
    "get_hotspot",
    "navigate_to",
    "stop_tracker",
    "turn",
    "start_tracker",
    "look_for_user",
    "set_user_position",
    "get_robot_pose",
    "propose_approach_pose",
)


@pytest.mark.parametrize("at", ["at once", "after 1 s"])
@pytest.mark.parametrize("skill", SKILLS)
def test_a_failure_of_any_skill_names_it_and_leaves_the_tracker_off(robot, skill, at):
    took = "running 1 s, then " if at == "after 1 s" else ""
    robot.mock(skill, f'{took}FAILURE server_lost "nobody answers"')
    play = robot.run("goto_user").assert_failed("server_lost", reason="nobody answers")
    assert play.leaf.endswith(skill)
    tracker = [name for name in play.order if name in ("start_tracker", "stop_tracker")]
    searched = skill not in ("get_user_room", "get_hotspot", "navigate_to")
    assert tracker[-1:] == (["stop_tracker"] if searched else [])
    assert all(call.ended is not None for call in play.calls())
