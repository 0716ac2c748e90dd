"""Stamps of the future, and a clock that is set back, freeze nothing and make nothing look fresh."""

from __future__ import annotations

import numpy as np
import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan, Odometry
from florence_bt.core.transforms import Transform3, TransformBuffer, TransformUnavailable
from florence_bt.skills.navigation.localisation.scan_queue import ScanQueue
from florence_bt.skills.navigation.navigate.navigator import SensorTimeouts


def scan_at(stamp: float) -> LaserScan:
    return LaserScan(stamp, "laser", 0.0, 0.1, 0.0, 4.0, np.ones(10, np.float32))


def test_one_scan_of_the_future_does_not_hide_that_the_laser_is_dead() -> None:
    fresh = SensorTimeouts(0.5, 0.25, ("scan",))
    odometry = Odometry(100.0, Pose2())
    fresh.saw("scan", 109.0, 100.0)
    missing = fresh.missing(100.0, odometry)
    assert missing is not None and missing[0] == "no_scan"
    fresh.saw("scan", 100.0, 100.0)
    assert fresh.missing(100.0, odometry) is None
    missing = fresh.missing(101.0, Odometry(101.0, Pose2()))
    assert missing is not None and missing[0] == "no_scan"


def test_the_robot_does_not_move_on_odometry_of_the_future() -> None:
    fresh = SensorTimeouts(0.5, 0.25, ())
    missing = fresh.missing(100.0, Odometry(109.0, Pose2()))
    assert missing is not None and missing[0] == "no_pose"


def test_a_queue_that_was_cleared_takes_what_is_older() -> None:
    queue = ScanQueue()
    queue.add_odometry(Odometry(100.0, Pose2(1.0)))
    queue.clear()
    assert queue.odometry is None and queue.take_ready() == []
    queue.add_scan("scan", scan_at(40.0))
    queue.add_odometry(Odometry(40.0, Pose2(2.0)))
    assert [pose for _, _, pose in queue.take_ready()] == [Pose2(2.0)]


def test_a_buffer_that_was_cleared_keeps_what_never_moves() -> None:
    buffer = TransformBuffer()
    buffer.set_static("base", "laser", Transform3.identity())
    buffer.set_moving("map", "odom", 2e9, Pose2(9.0))
    buffer.clear_moving()
    with pytest.raises(TransformUnavailable):
        buffer.lookup("map", "odom")
    buffer.set_moving("map", "odom", 40.0, Pose2(1.0))
    assert buffer.lookup_pose("map", "odom") == Pose2(1.0)
    assert buffer.frames() == ("laser", "odom")
