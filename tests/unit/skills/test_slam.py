"""Mapping: the map and the pose of a robot that drives in rooms whose truth is known."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.core.sensing import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from florence_bt.skills.navigation.mapping.drive import load_drive, save_drive
from florence_bt.skills.navigation.mapping.kept_scan import keep_scan
from florence_bt.skills.navigation.mapping.parameters import SlamParameters
from florence_bt.skills.navigation.mapping.slam import Slam
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, Box, World
from tests.unit.skills.test_localise_accuracy import raw

RING: tuple[Box, ...] = (
    (-0.1, -0.1, 10.1, 0.0),
    (-0.1, 7.0, 10.1, 7.1),
    (-0.1, 0.0, 0.0, 7.0),
    (10.0, 0.0, 10.1, 7.0),
    (2.0, 2.0, 8.0, 5.0),
    (4.0, 0.0, 4.6, 0.4),
    (9.5, 3.0, 10.0, 4.1),
    (6.0, 6.4, 6.9, 7.0),
    (0.0, 5.2, 0.4, 6.0),
)
"""A corridor of 2 m around a block of 6 x 3 m, with a cupboard on each side."""
CORNERS = ((9.0, 1.0), (9.0, 6.0), (1.0, 6.0), (1.0, 1.0))
START = Pose2(1.0, 1.0)
STEP_M, STEP_RAD = 0.12, 0.15


def laps(count: int) -> Iterator[Pose2]:
    """The motions of a drive around the block, from START on."""
    here = START
    for goal in CORNERS * count:
        while abs(side := here.bearing_to(*goal)) > 1e-9:
            yield (turn := Pose2(0.0, 0.0, max(-STEP_RAD, min(STEP_RAD, side))))
            here = here @ turn
        for _ in range(round(math.dist((here.x, here.y), goal) / STEP_M)):
            yield Pose2(STEP_M)
            here = here @ Pose2(STEP_M)


def drive(slam: Slam, world: World, count: int, turn_scale: float = 0.8, way_scale: float = 1.01) -> None:
    """Drive around the block with wheels that are wrong by some parts."""
    slam.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)
    for motion in laps(count):
        world.pose = world.pose @ motion
        world.odom = world.odom @ Pose2(way_scale * motion.x, 0.0, turn_scale * motion.yaw)
        world.now += 0.1
        slam.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)


def go(slam: Slam, world: World, motions: Sequence[Pose2]) -> None:
    """Drive with good wheels; the first scan is taken where the robot stands."""
    slam.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)
    for motion in motions:
        world.pose, world.odom = world.pose @ motion, world.odom @ motion
        slam.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)


def far_cells(grid: OccupancyGrid, boxes: tuple[Box, ...], metres: float) -> float:
    """The part of the occupied cells whose middle is farther from all surfaces of the truth."""
    rows, columns = np.nonzero(grid.cells == OCCUPIED)
    x = START.x + grid.origin.x + (columns + 0.5) * grid.resolution
    y = START.y + grid.origin.y + (rows + 0.5) * grid.resolution
    nearest = np.full(len(x), np.inf)
    for x0, y0, x1, y1 in boxes:
        outside = np.hypot(
            np.maximum(0.0, np.maximum(x0 - x, x - x1)), np.maximum(0, np.maximum(y0 - y, y - y1))
        )
        inside = np.minimum(np.minimum(x - x0, x1 - x), np.minimum(y - y0, y1 - y))
        nearest = np.minimum(nearest, np.where(inside > 0, inside, outside))
    return float((nearest > metres).mean())


@pytest.mark.slow
def test_a_loop_is_closed_and_the_map_is_right() -> None:
    slam, world = Slam(), World(START, boxes=list(RING), seed=3)
    drive(slam, world, 2)
    slam.settle()
    truth = START.inverse() @ world.pose
    assert slam.loops > 0
    assert slam.revision > 0
    assert slam.torn == 0
    assert slam.pose.distance_to(truth) < 0.05
    assert abs(angle_difference(slam.pose.yaw, truth.yaw)) < math.radians(1.0)
    assert slam.pose.distance_to(slam.map_from_odom @ world.odom) < 1e-9
    assert far_cells(slam.grid(), RING, 0.15) < 0.03


def before_it(slam: Slam) -> int:
    """What the map shows where the robot would touch something."""
    grid, place = slam.grid(), slam.pose @ Pose2(0.2)
    return int(grid.cells[grid.cell_of(place.x, place.y)])


def test_what_is_touched_where_nobody_knows_leaves_no_wall() -> None:
    slam, world = Slam(), World(START, boxes=list(RING), seed=3)
    go(slam, world, [Pose2(STEP_M)] * 10)
    before = slam.grid().cells
    slam.touched(world.odom @ Pose2(-40.0, 3.0))  # the odometry was reset
    np.testing.assert_array_equal(slam.grid().cells, before)
    later = Slam()
    later.resume(slam.drive)
    before = later.grid().cells
    later.touched(Pose2())  # before its first scan
    np.testing.assert_array_equal(later.grid().cells, before)
    later.update(raw(world.scan()), UPSIDE_DOWN_LASER, Pose2())
    assert before_it(later) == FREE
    later.touched(Pose2())
    assert before_it(later) == OCCUPIED, "now it is known"


@pytest.mark.slow
def test_the_same_drive_gives_the_same_map() -> None:
    made = []
    for _ in range(2):
        slam = Slam()
        drive(slam, World(START, boxes=list(RING), seed=3), 1)
        slam.settle()
        made.append((slam.poses, slam.grid()))
    assert made[0][0] == made[1][0]
    assert (made[0][1].cells == made[1][1].cells).all()


@pytest.mark.slow
def test_somebody_who_walks_by_leaves_no_trace() -> None:
    slam, world = Slam(), World(START, boxes=list(RING), seed=3)
    for step, motion in enumerate(laps(1)):
        world.pose, world.odom = world.pose @ motion, world.odom @ motion
        leg = world.pose @ Pose2(1.2 + 0.3 * math.sin(0.3 * step), 0.6 * math.sin(0.5 * step))
        world.boxes = [*RING, (leg.x - 0.1, leg.y - 0.1, leg.x + 0.1, leg.y + 0.1)]
        slam.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)
    assert far_cells(slam.grid(), RING, 0.2) < 0.005


@pytest.mark.slow
def test_the_map_grows_while_it_drives() -> None:
    slam, drawn_at_once, world = Slam(), Slam(), World(START, boxes=list(RING), seed=3)
    assert (slam.grid().cells == UNKNOWN).all()
    known = []
    for motion in list(laps(1))[:120]:
        world.pose, world.odom = world.pose @ motion, world.odom @ motion
        scan = raw(world.scan())
        drawn_at_once.update(scan, UPSIDE_DOWN_LASER, world.odom)
        if slam.update(scan, UPSIDE_DOWN_LASER, world.odom):
            known.append(int((slam.grid().cells != UNKNOWN).sum()))
    assert known[-1] > 1.5 * known[0]
    assert (drawn_at_once.grid().cells == slam.grid().cells).all()


def test_scans_and_poses_that_say_nothing_change_nothing() -> None:
    slam, world = Slam(), World(START, boxes=list(RING), seed=3)
    assert not slam.update(raw(world.scan()), UPSIDE_DOWN_LASER, Pose2(math.nan))
    assert not slam.update(raw(world.scan(longest=0.3)), UPSIDE_DOWN_LASER, world.odom)
    assert slam.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)
    assert not slam.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)
    assert slam.pose == Pose2()


def test_what_is_beyond_the_reach_of_a_laser_says_nothing() -> None:
    """REP 117: infinite is nothing within reach, a finite range beyond it is no measurement."""
    scan = raw(World(START, boxes=list(RING), seed=3).scan())
    ranges = np.full(len(scan.ranges), np.nan, np.float32)
    reach = np.float32(scan.range_max)
    ranges[:7] = np.inf, -np.inf, reach, np.nextafter(reach, np.float32(99.0)), 65.533, 1e30, 1.0
    kept = keep_scan(replace(scan, ranges=ranges), UPSIDE_DOWN_LASER, SlamParameters())
    assert len(kept.clear) == 2, "the infinite one, and the one that is told as the reach itself"
    assert len(kept.points) == 1


def test_a_drive_goes_on_from_its_file(tmp_path: Path) -> None:
    slam, world = Slam(), World(START, boxes=list(RING), seed=3)
    moves = list(laps(1))
    go(slam, world, moves[:90])
    save_drive(tmp_path / "home.drive", slam.drive)
    assert (tmp_path / "home.drive").stat().st_size < 3_000 * len(slam.scans)
    later = Slam()
    later.resume(load_drive(tmp_path / "home.drive"))
    assert np.mean(later.grid().cells == slam.grid().cells) > 0.995
    # Its odometry begins anew, and somebody has pushed it a little.
    world.pose, world.odom = world.pose @ Pose2(0.3, 0.1, 0.3), Pose2()
    before = len(later.scans)
    go(later, world, moves[90:100])
    truth = START.inverse() @ world.pose
    assert later.pose.distance_to(truth) < 0.15
    assert len(later.scans) > before
    assert later.torn == slam.torn + 1


def write_arrays(file: Path, arrays: dict[str, np.ndarray]) -> None:
    with file.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]


def test_what_was_touched_is_a_wall_when_the_drive_goes_on(tmp_path: Path) -> None:
    slam, world = Slam(), World(START, boxes=list(RING), seed=3)
    go(slam, world, [Pose2(STEP_M)] * 10)
    assert before_it(slam) == FREE
    slam.touched(world.odom)
    file = tmp_path / "home.drive"
    save_drive(file, slam.drive)
    later = Slam()
    later.resume(load_drive(file))
    place = slam.pose @ Pose2(0.2)
    grid = later.grid()
    assert grid.cells[grid.cell_of(place.x, place.y)] == OCCUPIED
    with np.load(file) as saved:
        arrays = {name: saved[name] for name in saved.files}
    older = {name: array for name, array in arrays.items() if name not in ("touched", "touches")}
    write_arrays(file, older)
    assert load_drive(file).touches == ()
    write_arrays(file, {**arrays, "touched": np.array([99])})
    with pytest.raises(ConfigError, match="a touch is at a scan that is not there"):
        load_drive(file)


@pytest.mark.parametrize("data", [b"", b"PK no drive", b"\x93NUMPY"])
def test_what_is_no_drive_is_refused(tmp_path: Path, data: bytes) -> None:
    (file := tmp_path / "home.drive").write_bytes(data)
    with pytest.raises(ConfigError, match=r"home\.drive"):
        load_drive(file)
    with pytest.raises(ConfigError, match="none"):
        load_drive(tmp_path / "none.drive")


@pytest.mark.slow
def test_a_drive_that_is_damaged_anywhere_is_refused_or_read(tmp_path: Path) -> None:
    slam, world = Slam(), World(START, boxes=list(RING), seed=3)
    go(slam, world, [Pose2(STEP_M)] * 4)
    file = tmp_path / "home.drive"
    save_drive(file, slam.drive)
    whole, refused = file.read_bytes(), 0
    for place in range(0, len(whole), max(1, len(whole) // 400)):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 0x55]) + whole[place + 1 :])
        try:
            load_drive(file)
        except ConfigError:
            refused += 1
    assert refused > 200


def test_a_robot_whose_odometry_starts_anew_is_where_it_was() -> None:
    slam, world = Slam(), World(START, boxes=list(RING), seed=3)
    moves = list(laps(1))
    go(slam, world, moves[:40])
    world.odom = world.odom @ Pose2(500.0, 20.0, 2.0)
    go(slam, world, moves[40:50])
    assert slam.pose.distance_to(START.inverse() @ world.pose) < 0.15
    assert slam.pose.distance_to(slam.map_from_odom @ world.odom) < 1e-6


def test_a_map_that_is_too_large_is_an_error() -> None:
    slam, world = Slam(SlamParameters(resolution=0.001)), World(START, boxes=list(RING), seed=3)
    slam.update(raw(world.scan()), UPSIDE_DOWN_LASER, world.odom)
    with pytest.raises(ConfigError, match="larger cells"):
        slam.grid()


def test_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gtsam", None)
    with pytest.raises(ConfigError, match="gtsam"):
        Slam()
