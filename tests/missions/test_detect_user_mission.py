"""The stop-and-go search (REFERENCE 12.2).

One turn and look: 0.1 s stop + 2 s turn + 1 s settle + 0.1 s start + the look.
"""

import math

import pytest
from py_trees.common import Status

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure, success
from florence_bt.testing.mocks import Step

NOBODY = Step(failure("no_user_seen", "nobody was in front of the camera"), after=5.0)
FOUND = Step(success(user=Pose2(3.0, 2.0, math.pi), distance=2.0, user_id=7), after=1.0)
STEP_S = 0.1 + 2.0 + 1.0 + 0.1


@pytest.mark.parametrize("look", [1, 2, 5, 8])
def test_found_at_a_look(stage, look):
    # (look - 1) rounds of 8.2 s, one of 4.2 s, 0.1 s for the last stop
    run = stage("detect_user", look_for_user=[NOBODY] * (look - 1) + [FOUND])
    assert run.run() is Status.SUCCESS
    assert run.clock.now() == pytest.approx((look - 1) * (STEP_S + 5.0) + STEP_S + 1.0 + 0.1)
    assert run.tree.outputs() == {"user": Pose2(3.0, 2.0, math.pi), "distance": 2.0, "user_id": 7}
    assert [call["angle"] for call in run.calls("turn")] == [pytest.approx(math.radians(45))] * look
    one_look = ["stop_tracker", "turn", "start_tracker", "look_for_user"]
    assert run.started == one_look * look + ["stop_tracker"]


def test_nobody_in_a_full_circle(stage):
    run = stage("detect_user", look_for_user=[NOBODY])
    assert run.run() is Status.FAILURE
    why = run.why()
    assert (why.code, why.reason) == ("no_user_seen", "no user seen in 8 of 8 looks")
    assert why.path.endswith("look for user")
    assert len(run.calls("look_for_user")) == 8
    assert not run.tracker_is_on
    assert run.tree.outputs() == {}


def test_a_failing_turn_ends_the_search(stage):
    blocked = Step(failure("collision_ahead", "a chair is in the way"), after=1.0)
    run = stage("detect_user", turn=[Step(success(), after=2.0), blocked], look_for_user=[NOBODY])
    assert run.run() is Status.FAILURE
    assert (run.why().code, run.why().reason) == ("collision_ahead", "a chair is in the way")
    assert len(run.calls("look_for_user")) == 1
    assert not run.tracker_is_on


def test_a_turn_that_never_ends_is_timed_out(stage):
    run = stage("detect_user", turn=[Step(None, cancel_takes=0.2)])
    assert run.run() is Status.FAILURE
    assert run.why().code == "timed_out"
    assert run.clock.now() == pytest.approx(0.1 + run.declarations["turn"].deadline_s + 0.2)


def test_a_lost_tracker_ends_the_search(stage):
    run = stage(
        "detect_user", start_tracker=[Step(failure("server_lost", "no tracker is running"), after=5.0)]
    )
    assert run.run() is Status.FAILURE
    assert run.why().code == "server_lost"
    assert run.started[-1] == "stop_tracker"


def test_a_tracker_that_cannot_be_stopped_does_not_spoil_a_find(stage):
    run = stage(
        "detect_user",
        stop_tracker=[Step(success(), after=0.1), Step(failure("server_lost", "the tracker is gone"))],
    )
    assert run.run() is Status.SUCCESS


def test_inputs_reach_the_skills(stage):
    run = stage(
        "detect_user",
        {"looks": "4", "step": "90 deg", "settle": "0 s", "window": "2 s"},
        look_for_user=[NOBODY],
    )
    assert run.run() is Status.FAILURE
    assert run.why().reason == "no user seen in 4 of 4 looks"
    assert run.calls("turn")[0]["angle"] == pytest.approx(math.pi / 2)
    assert run.calls("look_for_user")[0] == {"window": 2.0}


@pytest.mark.parametrize("tenth", range(0, 180, 3))
def test_a_stop_at_any_moment_stops_everything_and_the_tracker(stage, tenth):
    run = stage("detect_user", look_for_user=[NOBODY])
    run.stop_at(tenth / 10)
    assert run.started[-1] == "stop_tracker"
    assert not run.tracker_is_on
