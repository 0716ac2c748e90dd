"""Three trials to stand in front of a person (REFERENCE 12.8). A proposal takes 0.05 s, a drive 10 s."""

import pytest
from py_trees.common import Status

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure, success
from florence_bt.testing.mocks import Step

USER = Pose2(3.0, 2.0, 3.0)
ROBOT = Pose2(1.0, 2.0, 0.0)
PROPOSALS = (Pose2(2.5, 2.0, 0.0), Pose2(2.6, 2.4, -0.8), Pose2(2.6, 1.6, 0.8))
DRIVEN = Step(success(), after=10.0)
NO_PATH = Step(failure("no_path", "no way leads there"), after=1.0)
OCCUPIED = Step(failure("pose_occupied", "the place is not free"), after=0.05)


def test_the_first_place_is_good(stage):
    run = stage("approach_user", {"user": USER})
    assert run.run() is Status.SUCCESS
    assert run.clock.now() == pytest.approx(10.05)
    assert run.calls("propose_approach_pose") == [
        {"user": USER, "robot": ROBOT, "trial": 1, "safe_distance": 0.5}
    ]
    assert run.calls("navigate_to") == [{"goal": PROPOSALS[0]}]
    assert run.tree.outputs() == {"pose": PROPOSALS[0]}


def test_the_second_place_is_good_and_the_robot_pose_is_that_of_the_start(stage):
    run = stage("approach_user", {"user": USER}, navigate_to=[NO_PATH, DRIVEN])
    assert run.run() is Status.SUCCESS
    assert [call["trial"] for call in run.calls("propose_approach_pose")] == [1, 2]
    assert [call["goal"] for call in run.calls("navigate_to")] == list(PROPOSALS[:2])
    assert len(run.calls("get_robot_pose")) == 1


def test_an_occupied_proposal_counts_as_a_trial_and_is_not_driven_to(stage):
    proposals = [OCCUPIED, OCCUPIED, Step(success(pose=PROPOSALS[2]), after=0.05)]
    run = stage("approach_user", {"user": USER}, propose_approach_pose=proposals)
    assert run.run() is Status.SUCCESS
    assert [call["trial"] for call in run.calls("propose_approach_pose")] == [1, 2, 3]
    assert run.calls("navigate_to") == [{"goal": PROPOSALS[2]}]


def test_the_third_trial_fails(stage):
    run = stage("approach_user", {"user": USER}, navigate_to=[NO_PATH])
    assert run.run() is Status.FAILURE
    assert (run.why().code, run.why().reason) == (
        "no_path",
        "3 of 3 attempts failed; last: no way leads there",
    )
    assert len(run.calls("navigate_to")) == 3


@pytest.mark.parametrize("code", ["server_lost", "no_pose", "cancelled"])
def test_what_another_place_would_not_mend_is_not_tried_again(stage, code):
    run = stage("approach_user", {"user": USER}, navigate_to=[Step(failure(code, "no good"), after=1.0)])
    assert run.run() is Status.FAILURE
    assert (run.why().code, len(run.calls("navigate_to"))) == (code, 1)


def test_the_robot_does_not_know_where_it_is(stage):
    run = stage("approach_user", {"user": USER}, get_robot_pose=[Step(failure("no_pose", "not localised"))])
    assert run.run() is Status.FAILURE
    assert (run.why().code, run.calls("propose_approach_pose")) == ("no_pose", [])


def test_the_limit_covers_all_trials(stage):
    # 120 s: the second drive is under way
    slow = Step(failure("no_progress", "stuck"), after=70.0, cancel_takes=0.5)
    run = stage("approach_user", {"user": USER}, navigate_to=[slow])
    assert run.run() is Status.FAILURE
    assert run.why().code == "timed_out"
    assert "navigate to" in run.why().reason
    assert run.clock.now() == pytest.approx(120.5)
    assert len(run.calls("navigate_to")) == 2


def test_inputs_reach_the_skills(stage):
    run = stage("approach_user", {"user": "{x: 3 m, y: 2 m, yaw: 90 deg}", "safe_distance": "80 cm"})
    run.run()
    call = run.calls("propose_approach_pose")[0]
    assert (call["user"].x, call["safe_distance"]) == (3.0, 0.8)


@pytest.mark.parametrize("tenth", range(0, 125, 4))
def test_a_stop_at_any_moment_leaves_nothing(stage, tenth):
    late = Step(failure("no_path", "x"), after=1.0, accept_after=0.5, cancel_takes=0.3)
    run = stage(
        "approach_user", {"user": USER}, navigate_to=[late, Step(success(), after=10.0, cancel_takes=1.0)]
    )
    run.stop_at(tenth / 10)
