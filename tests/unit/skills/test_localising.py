"""Localisation as a component: what it does with maps, scans, odometry and poses that come when they come."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.diagnosis import Severity
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.sensing import PoseEstimate
from florence_bt.core.topics import DIAGNOSES, MAP, ODOMETRY, POSE, SCAN
from florence_bt.simulation.rig.wires import Link, Wires
from florence_bt.skills.navigation.localisation.localising import (
    INITIAL_POSE,
    LOSE,
    PARTICLES,
    Localising,
    LocalisingParameters,
)
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.localisation.saved_pose import load_pose, save_pose
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, World, make_map

START = Pose2(1.0, 2.4, 0.0)
STEP_S, SCAN_EVERY = 0.02, 5
INITIAL = {"initial_x": START.x, "initial_y": START.y, "initial_yaw": START.yaw}


class Surroundings:
    """A robot in two rooms that tells its odometry at 50 Hz and its scans at 10 Hz, and who hears it."""

    def __init__(self, links: dict[str, Link] | None = None, **own: Any) -> None:
        self.clock = ManualClock()
        self.world = World(START, seed=2)
        self.wires = Wires(self.clock, [("base_footprint", "laser", UPSIDE_DOWN_LASER)], links)
        self.hardware = self.wires.ports("hardware")
        self.map, self.initial = self.hardware.output(MAP), self.hardware.output(INITIAL_POSE)
        self.odometry, self.scans = self.hardware.output(ODOMETRY), self.hardware.output(SCAN)
        parameters = LocalisingParameters(**(INITIAL | own))
        self.localising = Localising(self.wires.ports("localiser"), LocaliserParameters(), parameters)
        self.frames = self.hardware.listen_to_frames()
        self.poses: list[PoseEstimate] = []
        self.hardware.listen(POSE, self.poses.append)
        self.diagnoses: list[Any] = []
        self.hardware.listen(DIAGNOSES, self.diagnoses.append)
        self.steps = 0

    def step(self, *, scan: bool = True) -> None:
        """Let 20 ms pass; each fifth time the laser has gone round."""
        self.world.advance(STEP_S)
        self.steps += 1
        if scan and self.steps % SCAN_EVERY == 0:
            self.scans.send(self.world.scan())
        self.clock.advance_to(self.world.now)
        self.odometry.send(self.world.odometry())
        self.hardware.send_frame("odom", "base_footprint", self.world.now, self.world.odom)
        self.clock.advance(0.0)

    def play(self, seconds: float, *, scan: bool = True) -> None:
        for _ in range(round(seconds / STEP_S)):
            self.step(scan=scan)

    @property
    def place(self) -> Pose2:
        return self.frames.buffer.lookup_pose("map", "base_footprint")


def told(pose: Pose2, frame: str = "map", deviation: float = 0.0) -> PoseEstimate:
    return PoseEstimate(0.0, frame, pose, np.diag([deviation**2] * 3))


def test_the_initial_pose_counts_before_the_first_scan() -> None:
    around = Surroundings()
    around.map.send(make_map())
    around.play(0.2, scan=False)
    assert around.place == START
    assert around.poses == [], "no scan has confirmed it"


def test_a_scan_waits_for_the_odometry_of_its_moment() -> None:
    around = Surroundings({ODOMETRY.name: Link(delay=0.3)})
    around.map.send(make_map())
    around.world.command = Twist2(0.3, 0.5)
    around.play(3.0)
    at = {round(estimate.stamp, 3): estimate.pose for estimate in around.poses}
    assert at, "scans were used although the odometry is 0.3 s behind"
    there = Surroundings()
    there.map.send(make_map())
    there.world.command = around.world.command
    there.play(3.0)
    for estimate in there.poses[: len(at)]:
        assert at[round(estimate.stamp, 3)].distance_to(estimate.pose) < 0.01


def test_the_place_is_stamped_ahead_of_the_odometry_and_not_of_the_clock() -> None:
    around = Surroundings({ODOMETRY.name: Link(delay=0.5)})
    around.map.send(make_map())
    around.play(2.0)
    newest = around.frames.buffer.latest_stamp("odom")
    assert newest == pytest.approx(around.clock.now() - 0.5 + 0.04 + 0.2, abs=0.03)


def test_the_place_is_told_again_and_again_without_scans() -> None:
    around = Surroundings()
    around.map.send(make_map())
    around.play(1.0)
    counted = len(around.poses)
    around.play(1.0, scan=False)
    newest = around.frames.buffer.latest_stamp("odom")
    assert newest is not None and newest > around.clock.now()
    assert len(around.poses) <= counted + 1


@pytest.mark.parametrize("with_map", [True, False])
@pytest.mark.parametrize(("pose", "frame"), [(Pose2(1.0, 1.0), "odom"), (Pose2(500.0, 1.0), "map")])
def test_a_pose_of_another_frame_or_off_the_map_is_refused(pose: Pose2, frame: str, with_map: bool) -> None:
    around = Surroundings()
    if with_map:
        around.map.send(make_map())
        around.play(0.1)
    around.initial.send(told(pose, frame))
    around.play(0.1)
    if not with_map:
        around.map.send(make_map())
        around.play(0.1)
    assert around.wires.refused == {INITIAL_POSE.name: 1}
    assert around.place.distance_to(START) < 0.05


@pytest.mark.parametrize("with_map", [True, False])
def test_a_pose_that_was_told_counts_also_when_the_map_comes_later(with_map: bool) -> None:
    around = Surroundings(initial_x=6.0, initial_y=4.0)
    if with_map:
        around.map.send(make_map())
        around.play(1.0)
    around.initial.send(told(START @ Pose2(0.1, 0.1, 0.1), deviation=0.2))
    around.play(0.1)
    around.map.send(make_map())
    around.play(1.0)
    assert around.place.distance_to(START) < 0.03


def test_the_last_pose_is_kept_and_comes_before_the_initial_one(tmp_path: Path) -> None:
    file = tmp_path / "pose.json"
    save_pose(file, START @ Pose2(0.05, 0.0, 0.03), make_map())
    around = Surroundings(initial_x=6.0, pose_file=str(file))
    around.map.send(make_map())
    around.play(0.1, scan=False)
    assert around.frames.buffer.latest_stamp("odom") is None, "it is published once a scan has fitted there"
    around.play(3.0)
    assert around.place.distance_to(START) < 0.03
    kept = load_pose(file, make_map())
    assert kept is not None and kept.distance_to(START) < 0.03
    file.unlink()
    around.world.command = Twist2(0.3, 0.0)
    around.play(1.0)
    around.localising.close()
    kept = load_pose(file, make_map())
    assert kept is not None and kept.distance_to(around.world.pose) < 0.1


def test_a_map_that_comes_anew_keeps_the_place_and_that_it_is_lost() -> None:
    around = Surroundings()
    around.map.send(make_map())
    around.play(1.0)
    around.map.send(make_map())
    around.play(0.2)
    assert around.place.distance_to(START) < 0.05
    around.wires.services[LOSE.name]({})
    around.map.send(make_map())
    around.play(0.1)
    assert around.localising.localiser is not None and around.localising.localiser.lost


def test_while_it_is_lost_nothing_is_published_and_the_diagnosis_says_so() -> None:
    around = Surroundings()
    around.map.send(make_map())
    around.play(1.1)
    (found,) = around.diagnoses[-1].found.values()
    assert found.level is Severity.OK
    around.wires.services[LOSE.name]({})
    counted, newest = len(around.poses), around.frames.buffer.latest_stamp("odom")
    around.play(1.1)
    assert (len(around.poses), around.frames.buffer.latest_stamp("odom")) == (counted, newest)
    (found,) = around.diagnoses[-1].found.values()
    assert found.level is Severity.WARN and "lost" in found.message


def test_particles_are_sent_while_somebody_looks() -> None:
    around = Surroundings()
    around.map.send(make_map())
    clouds: list[Any] = []
    around.hardware.listen(PARTICLES, clouds.append)
    around.play(1.0)
    assert clouds and len(clouds[-1].poses) == LocaliserParameters().particles
    assert all(abs(pose.yaw) <= math.pi for pose in clouds[-1].poses)
