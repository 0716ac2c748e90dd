"""The whole of gotoUser (REFERENCE 12.1): the room, the search, the approach."""

import math

import pytest
from py_trees.common import Status

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure, success
from florence_bt.testing.mocks import Step
from florence_bt.trees.ascii import ascii_tree

USER = Pose2(3.0, 2.0, math.pi)
HOTSPOT = Pose2(4.0, 5.0, 0.5)
NOBODY = Step(failure("no_user_seen", "nobody was there"), after=5.0)


def test_all_goes_well(stage):
    # 10 s to the room, 4.2 s for the first look, 0.1 s to stop the tracker, 10.05 s for the approach
    run = stage("goto_user")
    assert run.run() is Status.SUCCESS
    assert run.clock.now() == pytest.approx(10.0 + 4.2 + 0.1 + 10.05)
    assert run.started == [
        *["get_user_room", "robot_in_room", "get_hotspot", "navigate_to"],
        *["stop_tracker", "turn", "start_tracker", "look_for_user", "stop_tracker"],
        *["set_user_position", "get_robot_pose", "propose_approach_pose", "navigate_to"],
    ]
    assert run.calls("robot_in_room") == [{"room": "kitchen"}]
    assert run.calls("get_hotspot") == [{"label": "kitchen"}]
    assert run.calls("navigate_to")[0] == {"goal": HOTSPOT}
    assert run.calls("set_user_position") == [{"user": USER}]
    assert run.tree.outputs() == {"user": USER, "pose": Pose2(2.5, 2.0, 0.0)}


def test_the_robot_is_in_the_room_already(stage):
    run = stage("goto_user", robot_in_room=[Step()])
    assert run.run() is Status.SUCCESS
    assert run.calls("get_hotspot") == []
    assert len(run.calls("navigate_to")) == 1


@pytest.mark.parametrize(
    ("skill", "code", "reason"),
    [
        ("get_user_room", "user_unknown", "nobody has told yet where the user is"),
        ("get_hotspot", "unknown_hotspot", "no hotspot is called kitchen"),
        ("navigate_to", "no_path", "no way leads there"),
        ("turn", "collision_ahead", "a chair is in the way"),
        ("set_user_position", "server_lost", "the locator is gone"),
        ("get_robot_pose", "no_pose", "not localised"),
    ],
)
def test_a_failure_anywhere_ends_the_mission_with_its_reason(stage, skill, code, reason):
    run = stage("goto_user", **{skill: [Step(failure(code, reason))]})
    assert run.run() is Status.FAILURE
    assert (run.why().code, run.why().reason) == (code, reason)
    assert run.why().path.startswith("goto_user/")
    assert run.why().path.endswith(skill.replace("_", " "))
    assert not run.tracker_is_on


def test_navigation_to_the_room_is_not_followed_by_a_search(stage):
    run = stage("goto_user", navigate_to=[Step(failure("blocked", "the door is shut"), after=3.0)])
    assert run.run() is Status.FAILURE
    assert run.calls("turn") == []


def test_nobody_is_found(stage):
    run = stage("goto_user", look_for_user=[NOBODY])
    assert run.run() is Status.FAILURE
    assert run.why().reason == "no user seen in 8 of 8 looks"
    assert run.calls("set_user_position") == []


def test_in_the_room_already_it_looks_from_where_it_stands(stage):
    run = stage("goto_user", robot_in_room=[Step()])
    assert run.run() is Status.SUCCESS
    assert {"goal": HOTSPOT} not in run.calls("navigate_to")


def test_who_is_not_seen_from_there_is_looked_for_from_the_hotspot(stage):
    found = Step(success(user=USER, distance=2.0, user_id=1), after=1.0)
    run = stage("goto_user", robot_in_room=[Step()], look_for_user=[NOBODY] * 8 + [found])
    assert run.run() is Status.SUCCESS
    assert run.calls("navigate_to")[0] == {"goal": HOTSPOT}
    assert len(run.calls("look_for_user")) == 9


def test_nobody_is_found_from_either_place(stage):
    run = stage("goto_user", robot_in_room=[Step()], look_for_user=[NOBODY])
    assert run.run() is Status.FAILURE
    assert run.why().reason == "no user seen in 8 of 8 looks"
    assert len(run.calls("look_for_user")) == 16


def test_the_approach_fails_three_times(stage):
    no_path = Step(failure("no_path", "no way leads there"), after=1.0)
    run = stage("goto_user", robot_in_room=[Step()], navigate_to=[no_path])
    assert run.run() is Status.FAILURE
    assert run.why().reason == "3 of 3 attempts failed; last: no way leads there"


def test_inputs_reach_the_called_missions(stage):
    run = stage(
        "goto_user", {"safe_distance": "0.8 m", "window": "2 s", "looks": "3"}, look_for_user=[NOBODY]
    )
    run.run()
    assert run.calls("look_for_user") == [{"window": 2.0}] * 3
    run = stage("goto_user", {"safe_distance": "0.8 m"})
    run.run()
    assert run.calls("propose_approach_pose")[0]["safe_distance"] == 0.8


@pytest.mark.parametrize("tenth", range(0, 245, 5))
def test_a_stop_at_any_moment_leaves_nothing(stage, tenth):
    run = stage("goto_user")
    run.stop_at(tenth / 10)
    assert not run.tracker_is_on


def test_the_dump_of_a_running_mission(stage):
    run = stage("goto_user", look_for_user=[NOBODY])
    run.run(done=lambda: len(run.calls("look_for_user")) == 2)
    assert (
        ascii_tree(run.root, visited_only=True)
        == """\
[>] goto_user (sequence)
    [+] get user room
    [>] find the user (selector)
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
                            [>] look for user"""
    )


def test_the_dump_of_a_failed_mission_tells_each_reason_once(stage):
    run = stage("goto_user", robot_in_room=[Step()], look_for_user=[NOBODY])
    run.run()
    text = ascii_tree(run.root, visited_only=True)
    assert text.count("no user seen in 8 of 8 looks") == 1
    assert text.splitlines()[0] == "[x] goto_user (sequence)"


@pytest.mark.parametrize(("room", "status"), [("kitchen", Status.SUCCESS), ("", Status.SUCCESS)])
def test_goto_room(stage, room, status):
    run = stage("goto_room", {"room": room})
    assert run.run() is status
    assert run.calls("get_hotspot") == [{"label": room}]
    assert run.calls("navigate_to") == [{"goal": HOTSPOT}]


def test_goto_room_that_is_unknown(stage):
    run = stage("goto_room", {"room": "attic"}, get_hotspot=[Step(failure("unknown_hotspot", "no attic"))])
    assert run.run() is Status.FAILURE
    assert (run.why().code, run.calls("navigate_to")) == ("unknown_hotspot", [])


def test_goto_pose(stage):
    run = stage("goto_pose", {"x": "1.5 m", "y": 2, "phi": "90 deg"})
    assert run.run() is Status.SUCCESS
    assert run.calls("navigate_to") == [{"goal": Pose2(1.5, 2.0, pytest.approx(math.pi / 2))}]


@pytest.mark.parametrize("mission", ["goto_room", "goto_pose"])
@pytest.mark.parametrize("when", [0.0, 0.05, 5.0, 9.9])
def test_a_stop_of_a_drive(stage, mission, when):
    inputs = {"room": "kitchen"} if mission == "goto_room" else {"x": 1.0, "y": 2.0}
    run = stage(
        mission, inputs, navigate_to=[Step(success(), after=10.0, accept_after=0.1, cancel_takes=1.0)]
    )
    run.stop_at(when)
    assert run.skills["navigate_to"].runs[0].cancelled
