"""Mapping as a component: what it does with scans, odometry and the bumper, and what it tells."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.diagnosis import Severity
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.sensing import FREE, OccupancyGrid
from florence_bt.core.topic_names import PLACE_STATUS
from florence_bt.core.topics import DIAGNOSES, MAP, ODOMETRY, POSE, SCAN
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.rig.wires import Link, Wires
from florence_bt.skills.navigation.mapping.drive import MappedDrive, load_drive
from florence_bt.skills.navigation.mapping.growing_map import GrowingMapParameters
from florence_bt.skills.navigation.mapping.kept_scan import KeptScan
from florence_bt.skills.navigation.mapping.map_making import (
    BUMPS,
    Bumps,
    MapMaking,
    MapMakingParameters,
)
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, World

STEP_S, SCAN_EVERY = 0.02, 5
CORRECTION = Pose2(0.5, 0.0)
RIGHT, LEFT = 1, 2


class Maker:
    """Makes a map of one free cell for each scan; it knows that the odometry frame lies half a metre on."""

    loops = 0
    map_from_odom = CORRECTION

    def __init__(self) -> None:
        self.odom_poses: list[Pose2] = []
        self.touches: list[Pose2] = []

    @property
    def pose(self) -> Pose2:
        return CORRECTION @ self.odom_poses[-1]

    def update(self, scan: Any, laser_in_base: Transform3, odom_pose: Pose2) -> bool:
        self.odom_poses.append(odom_pose)
        return True

    def touched(self, odom_pose: Pose2) -> None:
        self.touches.append(odom_pose)

    @property
    def drive(self) -> MappedDrive:
        none, one = np.zeros((0, 2), np.float32), np.ones((1, 2), np.float32)
        scan = KeptScan(0.0, np.zeros(2, np.float32), one, none)
        return MappedDrive((scan,), (self.pose,), (self.pose,), (0.0,), (False,), ())

    def resume(self, drive: MappedDrive) -> None:
        self.resumed = drive

    def grid(self) -> OccupancyGrid:
        return OccupancyGrid(0.1, Pose2(), np.full((1, len(self.odom_poses)), FREE, np.int8))


class Surroundings:
    """A robot that drives on, with a laser at 10 Hz and odometry at 50 Hz, and who hears of its map."""

    def __init__(self, links: dict[str, Link] | None = None, **own: Any) -> None:
        self.clock = ManualClock()
        self.world = World(Pose2(1.0, 2.5))
        self.world.command = Twist2(0.3, 0.0)
        self.wires = Wires(self.clock, [("base_footprint", "laser", UPSIDE_DOWN_LASER)], links)
        self.hardware = self.wires.ports("hardware")
        self.odometry, self.scans = self.hardware.output(ODOMETRY), self.hardware.output(SCAN)
        self.bumps = self.hardware.output(BUMPS)
        self.maker = Maker()
        self.ports = self.wires.ports("mapping")
        self.making = MapMaking(self.ports, self.maker, GrowingMapParameters(), MapMakingParameters(**own))
        self.heard: dict[str, list[Any]] = {}
        for topic in (MAP, POSE, DIAGNOSES):
            listener: Callable[[Any], None] = self.heard.setdefault(topic.name, []).append
            self.hardware.listen(topic, listener)
        self.frames = self.hardware.listen_to_frames()

    def play(self, seconds: float, *, scan: bool = True) -> None:
        for step in range(round(seconds / STEP_S)):
            self.world.advance(STEP_S)
            if scan and step % SCAN_EVERY == 0:
                self.scans.send(self.world.scan())
            self.clock.advance_to(self.world.now)
            self.odometry.send(self.world.odometry())
            self.clock.advance(0.0)


def test_the_map_comes_once_a_second_and_the_place_with_each_scan() -> None:
    around = Surroundings()
    around.play(3.0)
    assert len(around.heard[MAP.name]) == 3
    assert len(around.heard[POSE.name]) == 30
    last = around.heard[POSE.name][-1]
    assert last.pose == CORRECTION @ around.maker.odom_poses[-1] and last.frame == "map"
    assert around.frames.buffer.lookup_pose("map", "odom") == CORRECTION


def test_a_scan_is_placed_where_the_robot_was_when_it_was_taken() -> None:
    prompt, late = Surroundings(), Surroundings({ODOMETRY.name: Link(delay=0.3)})
    for around in (prompt, late):
        around.play(3.0)
    poses = late.maker.odom_poses
    assert len(poses) > 20
    for one, other in zip(poses, prompt.maker.odom_poses, strict=False):
        assert one.distance_to(other) < 1e-6


def test_while_the_maker_is_busy_scans_are_left_out_and_touches_are_not() -> None:
    around = Surroundings()
    waiting: list[tuple[Callable[[], Any], Callable[[Any], None]]] = []
    around.ports.work = lambda task, done: waiting.append((task, done))  # type: ignore[method-assign]
    around.play(2.0)
    assert len(waiting) == 5
    around.bumps.send(Bumps(LEFT))
    around.play(0.1, scan=False)
    assert len(waiting) == 6
    for task, done in waiting:
        done(task())
    assert len(around.maker.odom_poses) == 5 and len(around.maker.touches) == 1
    around.play(1.0)
    assert len(waiting) == 11


def test_the_bumper_counts_once_while_it_is_pressed() -> None:
    around = Surroundings()
    around.bumps.send(Bumps(LEFT | RIGHT))
    around.play(0.1, scan=False)
    assert around.maker.touches == [], "nobody knows where the robot is before the first odometry"
    for bits in (0, LEFT | RIGHT, LEFT | RIGHT, LEFT, 0, 4, RIGHT):
        around.bumps.send(Bumps(bits))
        around.play(0.1, scan=False)
    assert [np.sign(round(touch.yaw, 6)) for touch in around.maker.touches] == [0.0, -1.0]


def test_the_drive_is_kept_now_and_then_and_in_the_end(tmp_path: Path) -> None:
    file = tmp_path / "mapping.drive"
    around = Surroundings(drive_file=str(file), drive_period=1.0)
    around.play(0.5)
    assert not file.exists()
    around.play(1.0)
    assert len(load_drive(file).scans) == 1
    file.unlink()
    around.making.close()
    assert file.exists()
    again = Surroundings(resumed_drive=str(file))
    assert len(again.maker.resumed.scans) == 1


def test_a_drive_that_cannot_be_kept_is_told_and_the_map_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    around = Surroundings(drive_file=str(tmp_path / "no" / "mapping.drive"), drive_period=0.5)
    warned: list[str] = []
    monkeypatch.setattr(around.ports, "warn", lambda text, *about: warned.append(text))
    around.play(2.0)
    assert len(warned) == 3 and all("the drive is not kept" in text for text in warned)
    assert len(around.heard[POSE.name]) == 20


def test_it_is_told_how_far_the_map_is() -> None:
    around = Surroundings()
    around.play(1.1, scan=False)
    (found,) = around.heard[DIAGNOSES.name][-1].found.values()
    assert found.level is Severity.WARN
    around.play(2.0)
    found = around.heard[DIAGNOSES.name][-1].found[PLACE_STATUS]
    assert found.level is Severity.OK and float(found.values["m"]) == pytest.approx(0.5, abs=0.1)
