"""A robot that begins where it was last, and what is told of how well it is localised."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.skills.navigation.localisation.localiser import Localiser
from florence_bt.skills.navigation.localisation.quality import diagnosis_of
from florence_bt.skills.navigation.localisation.saved_pose import load_pose, save_pose
from tests.unit.skills.navigation_world import WALLS, World, make_map
from tests.unit.skills.test_relocaliser import FURNITURE, drive, error, take

THERE = Pose2(5.0, 1.2, -2.5)


def test_a_saved_pose_is_read_back(tmp_path: Path) -> None:
    file = tmp_path / "pose.json"
    assert load_pose(file, make_map()) is None
    save_pose(file, Pose2(1.0, 1.0), make_map())
    save_pose(file, THERE, make_map())
    assert load_pose(file, make_map()) == THERE
    assert [each.name for each in tmp_path.iterdir()] == ["pose.json"]


def test_a_pose_of_another_map_is_none(tmp_path: Path) -> None:
    save_pose(tmp_path / "pose.json", THERE, make_map())
    assert load_pose(tmp_path / "pose.json", make_map(WALLS[:-1])) is None


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"map": 1', '{"map": "MAP", "x": 1, "y": null, "yaw": 0}'])
def test_a_damaged_file_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "pose.json"
    save_pose(file, THERE, make_map())
    name = file.read_text().split('"')[3]
    file.write_text(text.replace("MAP", name))
    with pytest.raises(ConfigError, match="remove it"):
        load_pose(file, make_map())


@pytest.mark.parametrize("pose", [Pose2(10_001.0, 0.0), Pose2(0.0, -10_001.0), Pose2(0.0, 0.0, 7000.0)])
def test_a_pose_where_no_robot_is_is_refused(tmp_path: Path, pose: Pose2) -> None:
    file = tmp_path / "pose.json"
    save_pose(file, pose, make_map())
    with pytest.raises(ConfigError, match=r"no robot is at .*\(would have worked: to remove it\)"):
        load_pose(file, make_map())


def resumed(at: Pose2) -> tuple[World, Localiser]:
    boxes = [*WALLS, *FURNITURE]
    world = World(at, boxes=boxes, seed=4, odometry_noise=0.02)
    localiser = Localiser(make_map(boxes), seed=4)
    localiser.resume(THERE, (0.1, 0.1, 0.05))
    return world, localiser


def test_a_robot_that_was_not_moved_goes_on_where_it_was() -> None:
    world, localiser = resumed(THERE @ Pose2(0.05, 0.0, 0.02))
    localiser.believe(world.odom)
    assert localiser.map_from_odom is None  # not before a scan has fitted
    take(world, localiser)
    assert error(world, localiser) < 0.05


def test_a_robot_that_was_carried_while_it_was_off_never_tells_the_old_place() -> None:
    world, localiser = resumed(Pose2(1.0, 3.0, 0.4))
    world.command = Twist2(0.1, 0.5)
    for _ in range(50):
        world.advance(0.1)
        take(world, localiser)
        if localiser.map_from_odom is not None:
            assert error(world, localiser) < 0.2
    assert not localiser.lost


def test_the_diagnosis_says_how_well_the_place_is_known() -> None:
    world, localiser = resumed(THERE)
    assert diagnosis_of(localiser).level == Severity.WARN
    take(world, localiser)
    known = diagnosis_of(localiser)
    assert known.level == Severity.OK
    assert float(known.values["part of the scan that fits the map"]) > 0.9
    assert float(known.values["standard deviation, metres"]) < 0.1
    localiser.lose()
    assert "lost" in diagnosis_of(localiser).message
    assert drive(world, localiser, Twist2(0.1, 0.5), 0.5)


@pytest.mark.parametrize("off", [Pose2(100.0, 30.0), Pose2(-100.0)])
def test_a_place_off_the_map_is_doubtful_and_then_lost(off: Pose2) -> None:
    """Nothing contradicts there; nothing supports it, either."""
    world, localiser = resumed(Pose2(1.0, 1.0, 0.4))
    localiser.set_pose(off @ world.pose, (0.1, 0.1, 0.05))
    localiser.believe(world.odom)
    take(world, localiser)
    told = [np.sqrt(localiser.covariance.diagonal())]
    assert diagnosis_of(localiser).level == Severity.WARN
    assert not localiser.lost
    driven = 0.0
    while not localiser.lost:
        world.pose, world.odom = world.pose @ Pose2(0.1, 0.0, 0.1), world.odom @ Pose2(0.1, 0.0, 0.1)
        take(world, localiser)
        told.append(np.sqrt(localiser.covariance.diagonal()))
        driven += 0.1
        assert driven < 5.0
    assert driven > 0.5
    assert told[-2][0] > told[0][0] + 0.1
    # And on it goes until it is found.
    for _ in range(40):
        world.pose, world.odom = world.pose @ Pose2(0.02, 0.0, 0.2), world.odom @ Pose2(0.02, 0.0, 0.2)
        take(world, localiser)
    assert not localiser.lost
    assert error(world, localiser) < 0.1
    assert diagnosis_of(localiser).level == Severity.OK
    assert np.sqrt(localiser.covariance.diagonal())[0] < 0.1


@pytest.mark.parametrize("step", [0.1, 0.5])
def test_how_soon_a_place_off_the_map_is_lost_counts_in_metres_not_in_scans(step: float) -> None:
    world, localiser = resumed(Pose2(1.0, 1.0, 0.0))
    localiser.set_pose(Pose2(100.0, 100.0), (0.1, 0.1, 0.05))
    driven, way = 0.0, 1.0
    while not localiser.lost:
        way = -way if not 0.5 < world.pose.x + way * step < 3.4 else way
        world.pose = world.pose @ Pose2(way * step)
        world.odom = world.odom @ Pose2(way * step)
        take(world, localiser)
        driven += step
        assert driven < 6.0
    assert 2.0 < driven < 4.5
