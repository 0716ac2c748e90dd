"""Whole missions in the rig: the same parts as on the robot, in one process, on a manual clock."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.runtime.journal import JournalReader
from florence_bt.runtime.run import MissionRequest, RunStatus
from florence_bt.simulation.home.closeness import closeness
from florence_bt.simulation.home.flat import Solid, load_flat
from florence_bt.simulation.home.people import PersonSpec
from tests.sweeps import sweep

pytestmark = pytest.mark.slow

ROUND = (
    *("kitchen", "living_room", "bedroom", "bathroom", "study", "hall"),
    *("living_room", "kitchen", "hall"),
)
"""From the hall through each of the six doors, both ways."""


def speed(rig, seconds=0.5):
    """How fast the robot really moves, m/s."""
    before = rig.world.robot_pose
    rig.clock.advance(seconds)
    return rig.world.robot_pose.distance_to(before) / seconds


def test_goto_user_ends_politely_before_the_person(tmp_path):
    rig = make_rig(seed=1, runs_folder=tmp_path)
    run = rig.run("goto_user")
    assert run.status is RunStatus.SUCCEEDED, run.reason
    rig.clock.advance(1.0)
    end = closeness(rig.world.robot_pose, rig.world.person_pose("user"))
    assert end.distance == pytest.approx(0.5, abs=0.1)
    assert end.facing <= math.radians(15.0)
    assert rig.world.contacts == []
    # What the mission says agrees with the truth.
    assert run.outputs["user"].distance_to(rig.world.person_pose("user")) < 0.1
    record = rig.records[0]
    assert record.looks and record.path[0][1].distance_to(rig.world.flat.start) < 0.1
    result = json.loads((record.folder / "result.json").read_text())
    assert result["status"] == "SUCCEEDED" and len(result["looks"]) == len(record.looks)


def test_the_same_seed_gives_the_same_run_bit_for_bit(tmp_path):
    journals = []
    for folder in ("first", "second"):
        rig = make_rig(seed=7, person="bathroom", runs_folder=tmp_path / folder)
        run = rig.executor.trigger(MissionRequest("goto_user", caller="test"))
        rig.clock.advance(12.0)
        rig.executor.stop("enough")
        rig.clock.advance(2.0)
        with JournalReader(tmp_path / folder) as reader:
            journals.append((reader.run(run.run_id), reader.events(run.run_id)))
        journals.append((tmp_path / folder / run.run_id / "result.json").read_bytes())
    assert journals[:2] == journals[2:]


def test_another_seed_gives_another_run(tmp_path):
    rigs = [make_rig(seed=seed, person="bathroom") for seed in (7, 8)]
    for rig in rigs:
        rig.executor.trigger(MissionRequest("goto_user", caller="test"))
        rig.clock.advance(5.0)
    first, second = (rig.world.robot_pose for rig in rigs)
    assert first != second
    assert first.distance_to(rigs[0].world.flat.start) > 0.1, "they drive"


def test_a_person_elsewhere_than_believed_is_looked_for_all_round_and_the_robot_stands_still():
    rig = make_rig(seed=4, person="bathroom", user_room="living_room")
    run = rig.run("goto_user")
    assert run.status is RunStatus.FAILED
    assert run.code == "nobody_met"
    assert run.reason == "nobody was met in the living_room: the robot got to 2 of 2 places to look from"
    rig.clock.advance(1.5)
    assert speed(rig) == pytest.approx(0.0, abs=1e-4)
    assert rig.world.contacts == []


def test_a_bumper_that_stays_pressed_is_the_failure_of_the_mission(monkeypatch):
    rig = make_rig(seed=3, person="absent")
    monkeypatch.setattr(rig.world, "bumpers", lambda: (rig.clock.now() > 6.0, False))
    run = rig.run("goto_room", {"room": "kitchen"})
    assert (run.status, run.code) == (RunStatus.FAILED, "bumper")
    assert "the left bumper is pressed" in run.reason
    assert run.ended < 9.0


@pytest.mark.parametrize(("x", "y"), sweep([(6.5, 2.95), (7.4, 3.05)], every=2))
def test_it_drives_round_a_shoe_that_the_laser_does_not_see(x, y):
    flat = load_flat()
    shoe = Solid("shoe", x, y, 0.3, (0.05, 0.14), 0.0, 0.0, 0.1, (40, 40, 40))
    rig = make_rig(seed=3, person="absent", flat=replace(flat, solids=(*flat.solids, shoe)))
    run = rig.run("goto_room", {"room": "kitchen"})
    assert run.status is RunStatus.SUCCEEDED, run.reason
    assert rig.world.contacts == []


def test_it_drives_through_every_door_and_touches_nothing():
    rig = make_rig(seed=3, person="absent")
    for room in ROUND:
        run = rig.run("goto_room", {"room": room})
        assert run.status is RunStatus.SUCCEEDED, f"{room}: {run.reason}"
        here = rig.world.robot_pose
        assert here.distance_to(rig.world.flat.room(room).hotspot.pose) < 0.15
    assert rig.world.contacts == []


@pytest.mark.parametrize("moment", sweep([0.05, 0.0, 0.5, 3.0, 17.0, 26.0, 21.0], every=3))
def test_a_stop_at_any_moment_stops_the_robot(moment):
    rig = make_rig(seed=1, person="kitchen")
    run = rig.executor.trigger(MissionRequest("goto_user", caller="test"))
    rig.clock.advance(moment)
    rig.executor.stop("enough")
    rig.clock.advance(2.0)
    assert run.status is RunStatus.STOPPED
    assert speed(rig) == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize(
    ("mission", "inputs", "message"),
    [
        ("goto_usr", {}, "goto_user"),
        ("goto_user", {"safe_distance": "0.5 kg"}, "safe_distance"),
        ("goto_user", {"safe_distance": "9 m"}, "safe_distance"),
        ("goto_pose", {"x": "1 m"}, "y"),
    ],
)
def test_bad_requests_move_nothing(mission, inputs, message):
    rig = make_rig(seed=1, person="absent")
    with pytest.raises(ConfigError, match=message):
        rig.executor.trigger(MissionRequest(mission, inputs))
    assert speed(rig, 1.0) == pytest.approx(0.0, abs=1e-4)


def test_an_unknown_room_fails_with_the_rooms_that_exist():
    rig = make_rig(seed=1, person="absent")
    run = rig.run("goto_room", {"room": "kitchn"})
    assert run.status is RunStatus.FAILED and run.code == "unknown_hotspot" and "kitchen" in run.reason


def test_a_goal_in_a_wall_fails_and_nothing_moves():
    rig = make_rig(seed=1, person="absent")
    wall = rig.world.flat.solids[0]
    run = rig.run("goto_pose", {"x": f"{wall.x} m", "y": f"{wall.y} m", "phi": "0 deg"})
    assert run.status is RunStatus.FAILED and run.code in ("goal_occupied", "goal_outside", "no_path")
    assert speed(rig) == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize(("p2r", "r2p"), [(0.0, 0.0), (-90.0, 90.0)], ids=["before", "beside"])
def test_approach_me_ends_where_the_goal_says(p2r, r2p):
    person, start = Pose2(4.2, 5.2, math.pi), Pose2(2.4, 5.2, 0.0)
    rig = make_rig(seed=1, person=PersonSpec("user", person, "standing"), start=start)
    orientations = {"desired_p2r_orientation": f"{p2r} deg", "desired_r2p_orientation": f"{r2p} deg"}
    run = rig.run("approach_me", {"x": "1.8 m", **orientations})
    assert run.status is RunStatus.SUCCEEDED, run.reason
    rig.clock.advance(1.0)
    robot, angle = rig.world.robot_pose, math.pi + math.radians(p2r)
    goal = Pose2(person.x + 0.8 * math.cos(angle), person.y + 0.8 * math.sin(angle))
    assert robot.distance_to(goal) < 0.15
    wanted = angle + math.pi - math.radians(r2p)
    assert abs(angle_difference(robot.yaw, wanted)) < 0.12
    assert rig.world.contacts == []
    assert speed(rig) == pytest.approx(0.0, abs=1e-4)


def test_approach_me_without_anybody_there_fails_and_moves_nothing():
    rig = make_rig(seed=1, person="absent", start=Pose2(2.4, 5.2, 0.0))
    run = rig.run("approach_me", {"x": "1.5 m"})
    assert (run.status, run.code) == (RunStatus.FAILED, "user_lost")
    assert rig.world.robot_pose.distance_to(Pose2(2.4, 5.2)) < 0.02
