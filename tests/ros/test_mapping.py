"""A map that is made while the robot drives, over ROS."""

from __future__ import annotations

import re
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from florence_interfaces.msg import TurtlebotSensorState
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Odometry as OdometryMsg
from sensor_msgs.msg import LaserScan as LaserScanMsg

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan, Odometry
from florence_bt.ros.conversions import grid_from_ros, odometry_to_ros, pose_from_ros, scan_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR, STATE
from florence_bt.ros.tf import StaticTransformBroadcaster, TransformListener
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.skills.navigation.map_server.map_file import load_map
from florence_bt.skills.navigation.mapping.drive import load_drive
from florence_bt.skills.navigation.mapping.node import MappingNode
from florence_bt.skills.navigation.mapping.slam import Slam
from tests.ros.conftest import GENEROUS_S
from tests.two_rooms import write_two_rooms
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, World

pytestmark = pytest.mark.ros


class Driver:
    """A robot in two rooms, which publishes what it senses, and hears what the mapping tells."""

    def __init__(self, ros: Any) -> None:
        self.ros = ros
        self.node = ros.add(FlorenceNode("driver"))
        self.world = World(pose=Pose2(1.0, 2.5, 0.0))
        self.maps: list[Any] = []
        self.poses: list[Pose2] = []
        self.diagnoses: list[Any] = []
        create = self.node.create_publisher
        self._base = self.node.create_publisher(TurtlebotSensorState, "turtlebot_node/sensor_state", RELIABLE)
        self._scans = create(LaserScanMsg, "scan", SENSOR)
        self._odometry = create(OdometryMsg, "odom", STATE)
        self._static = StaticTransformBroadcaster(self.node)
        self._static.send([("base_footprint", "laser", UPSIDE_DOWN_LASER)])
        listen = self.node.create_subscription
        listen(OccupancyGridMsg, "map", lambda message: self.maps.append(grid_from_ros(message)), LATCHED)
        listen(PoseWithCovarianceStamped, "amcl_pose", self._on_pose, LATCHED)
        listen(DiagnosticArray, "diagnostics", self._on_diagnostics, RELIABLE)
        self.frames = TransformListener(self.node)

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        self.poses.append(pose_from_ros(message.pose.pose))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.diagnoses += [status for status in message.status if status.name.startswith("mapping: Place")]

    def sense(self) -> None:
        """Publish a scan and the odometry around it until it counts: a new node may not know the frames."""
        self.ros.spin_until(lambda: self._scans.get_subscription_count() and self._odometry_is_heard())
        scan = self.world.scan()  # compiles first
        told, due = len(self.poses), 0.0

        def is_placed() -> bool:
            nonlocal due
            if time.monotonic() > due:
                due = time.monotonic() + 10.0
                self._publish(scan)
            return len(self.poses) > told

        self.ros.spin_until(is_placed)

    def bump(self, bits: int) -> None:
        """Publish that the bumper is pressed."""
        message = TurtlebotSensorState(bumps_wheeldrops=bits)
        message.header.stamp = self.node.get_clock().now().to_msg()
        self._base.publish(message)

    def _publish(self, scan: LaserScan) -> None:
        now = self.node.timebase.now()
        for stamp in (now - 0.02, now + 0.05):
            odometry = Odometry(stamp, self.world.odom)
            self._odometry.publish(odometry_to_ros(odometry, "odom", "base_footprint"))
        self._scans.publish(scan_to_ros(replace(scan, stamp=now)))

    def _odometry_is_heard(self) -> bool:
        return bool(self._odometry.get_subscription_count())

    def drive_to(self, x: float) -> None:
        """Drive straight on, at a speed that a robot has: the stamps are of this machine's time."""
        while self.world.pose.x < x:
            self.ros.spin_for(0.2)
            step = Pose2(0.1, 0.0)
            self.world.pose, self.world.odom = self.world.pose @ step, self.world.odom @ step
            self.sense()


def test_the_map_grows_and_the_robot_is_in_it(ros: Any, tmp_path: Path) -> None:
    drive = tmp_path / "mapping.drive"
    settings = {"map_update_period": 0.1, "drive_file": str(drive)}
    node = ros.add(MappingNode(parameters=settings))
    driver = Driver(ros)
    driver.sense()
    first = ros.spin_until(lambda: driver.maps)[0]
    driver.drive_to(3.0)
    while len(driver.maps) < 3:
        driver.sense()
    assert np.count_nonzero(driver.maps[-1].cells == 0) > np.count_nonzero(first.cells == 0)
    assert driver.poses[-1].distance_to(Pose2(2.0, 0.0)) < 0.1, "the map begins where the robot did"
    place = driver.frames.buffer.lookup_pose("map", "odom") @ driver.world.odom
    assert place.distance_to(driver.poses[-1]) < 0.1
    ros.spin_until(lambda: any(status.values for status in driver.diagnoses))
    values = {value.key: value.value for value in driver.diagnoses[-1].values}
    assert float(values["m"]) > 1.0 and float(values["m2"]) > 5.0
    ros.close_node(node)
    kept = load_drive(drive)
    assert len(kept.scans) > 3

    again = ros.add(MappingNode(parameters={**settings, "resumed_drive": str(drive)}))
    before = len(driver.maps)
    driver.sense()
    ros.spin_until(lambda: len(driver.maps) > before)
    assert driver.poses[-1].distance_to(Pose2(2.0, 0.0)) < 0.15, "it goes on where it ended"
    ros.close_node(again)


def test_what_a_bumper_meets_is_a_wall_of_the_map(ros: Any) -> None:
    ros.add(MappingNode(parameters={"map_update_period": 0.1}))
    driver = Driver(ros)
    driver.sense()
    driver.drive_to(1.8)

    def before_it() -> Any:
        grid = driver.maps[-1]
        return grid.cells[grid.cell_of(driver.world.pose.x - 1.0 + 0.2, 0.0)]

    assert before_it() == 0
    while before_it() != 100:
        driver.bump(3)
        driver.sense()


class NothingIsTouched(Slam):
    """Cannot take what a bumper meets."""

    def touched(self, odom_pose: Pose2) -> None:
        raise ConfigError("no wall here")


def test_an_error_of_the_thread_ends_the_node(ros: Any) -> None:
    ros.add(MappingNode(NothingIsTouched))
    driver = Driver(ros)
    driver.sense()
    with pytest.raises(ConfigError, match="no wall here"):
        ros.spin_until(lambda: driver.bump(1))


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_the_robot_explores_by_itself(ros_domain: int, start_process: Any, tmp_path: Path) -> None:
    home, out = write_two_rooms(tmp_path), tmp_path / "home.yaml"
    simulated = "--sim", "--world", home, "--folder", tmp_path / "up"
    florence = [sys.executable, "-m", "florence_bt.cli"]
    run = start_process(*florence, "map", "explore", out, *simulated, "--speed", "2")
    assert run.process.wait(600.0) == 0, run.output
    assert re.search(r"^the map .*; \d+ looks?.*; the robot is ", run.output, re.MULTILINE), run.output
    grid = load_map(out)
    area = np.count_nonzero(grid.cells == 0) * grid.resolution**2
    assert 14.0 < area < 18.5, "two rooms of 3 x 3 m"
    assert out.with_suffix(".drive.png").read_bytes().startswith(b"\x89PNG")
    assert len(load_hotspots(out.with_suffix(".hotspots.yaml"))) == 2, run.output
    again = start_process(*florence, "map", "explore", out, *simulated)
    assert again.process.wait(GENEROUS_S) == 2 and "--overwrite" in again.output
