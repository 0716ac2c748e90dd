"""A stop at any moment leaves no goal, no timer and no running tracker behind."""

import itertools

import pytest

from tests.sweeps import sweep


def stop_at(robot, mission, seconds, **inputs):
    play = robot.start(mission, **inputs)
    robot.advance(seconds)
    if not play.done:
        robot.stop("enough")
        robot.run_until_done()
        play.assert_stopped("enough")
    assert all(call.ended is not None for call in play.calls())
    assert robot.executor.current is None
    assert robot.clock.next_time() is None, "a timer was left behind"
    words = [skill for skill in play.order if skill in ("start_tracker", "stop_tracker")]
    assert not words or words[-1] == "stop_tracker"
    return play


@pytest.mark.parametrize("tenth", sweep(range(0, 345, 5), every=3))
def test_goto_user(robot, tenth):
    stop_at(robot, "goto_user", tenth / 10)


@pytest.mark.parametrize("tenth", sweep(range(0, 350, 7), every=4))
def test_goto_user_that_searches_again_from_nearby(robot, tenth):
    robot.mock("make sure from nearby/**/look_for_user", "running 5 s, then FAILURE no_user_seen")
    stop_at(robot, "goto_user", 20 + tenth / 10)


@pytest.mark.parametrize(
    ("tenth", "look_first"), sweep(itertools.product(range(0, 180, 3), ["true", "false"]), every=3)
)
def test_detect_user(robot, tenth, look_first):
    robot.mock("look_for_user", "running 5 s, then FAILURE no_user_seen")
    play = stop_at(robot, "detect_user", tenth / 10, look_first=look_first)
    assert play.order[-1] == "stop_tracker"


@pytest.mark.parametrize("tenth", sweep(range(0, 125, 4), every=3))
def test_approach_user(robot, tenth):
    robot.mock(
        "navigate_to",
        [
            "accepted after 500 ms, cancel takes 300 ms, running 1 s, then FAILURE no_path",
            "cancel takes 1 s, running 10 s, then SUCCESS",
        ],
    )
    stop_at(robot, "approach_user", tenth / 10, user="(3 m, 2 m, 180 deg)")


@pytest.mark.parametrize("tenth", sweep(range(0, 145, 4), every=3))
def test_approach_user_to_the_fourth_place(robot, tenth):
    robot.mock(
        "navigate_to",
        [
            "accepted after 500 ms, cancel takes 300 ms, running 1 s, then FAILURE no_path 3 times",
            "cancel takes 1 s, running 10 s, then SUCCESS",
        ],
    )
    stop_at(robot, "approach_user", tenth / 10, user="(3 m, 2 m, 180 deg)")


@pytest.mark.parametrize("seconds", [0.0, 0.05, 5.0, 9.9])
@pytest.mark.parametrize(
    ("mission", "inputs"), [("goto_room", {"room": "kitchen"}), ("goto_pose", {"x": "1 m", "y": "2 m"})]
)
def test_a_drive(robot, mission, inputs, seconds):
    play = stop_at(robot, mission, seconds, **inputs)
    assert play.calls("navigate_to")[0].cancelled


@pytest.mark.parametrize("tenth", range(0, 75, 4))
def test_approach_me(robot, tenth):
    robot.mock("approach_person", "accepted after 500 ms, cancel takes 300 ms, running 5 s, then SUCCESS")
    play = stop_at(robot, "approach_me", tenth / 10, x="1.5 m")
    assert play.order[-1] == "stop_tracker"
