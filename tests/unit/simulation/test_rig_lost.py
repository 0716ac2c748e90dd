"""A robot of the rig that somebody carries."""

from __future__ import annotations

import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.run import MissionRequest
from tools.lost import CASES, STARTED, LostRun, Places, rows_of


@pytest.mark.slow
def test_a_robot_that_is_carried_arrives_all_the_same() -> None:
    rig = make_rig(person="absent", seed=3)
    places = Places(rig.world.flat, 3)
    goal = places.away(rig.world.robot_pose, 2.0)
    inputs = {"x": goal.x, "y": goal.y, "phi": goal.yaw}
    there = places.away(rig.world.robot_pose, 2.0)
    odometry = rig.robot.odometry.pose
    rig.world.carry_robot(there)
    assert rig.world.robot_pose.distance_to(there) < 1e-6
    assert rig.robot.odometry.pose == odometry
    run = rig.executor.trigger(MissionRequest("goto_pose", inputs, caller="test"))
    while not run.status.final:
        rig.clock.run_next()
    assert run.status.value.lower() == "succeeded", run.reason
    assert rig.world.robot_pose.distance_to(goal) < 0.2
    assert rig.world.contacts == []


def test_who_begins_elsewhere_than_it_believes() -> None:
    rig = make_rig(person="absent", seed=3, believed=Pose2(1.0, 1.0))
    assert rig.pose.distance_to(Pose2(1.0, 1.0)) < 0.01
    assert rig.world.robot_pose.distance_to(rig.world.flat.start) < 0.05


def test_a_success_elsewhere_is_not_counted_as_arrived() -> None:
    runs = [
        LostRun("flat", 1, case, succeeded=True, arrived=case != STARTED, reason="", seconds=9.0, contacts=())
        for case in CASES
    ]
    assert [row[1:3] for row in rows_of(runs)] == [["1 of 1", "0"], ["1 of 1", "0"], ["0 of 1", "1"]]
