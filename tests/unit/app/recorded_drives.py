"""Recordings of a short drive, written as bytes for the readers: bags by rosbags, CARMEN by hand."""

from __future__ import annotations

import gzip
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from tests.unit.skills.navigation_world import UPSIDE_DOWN_LASER, World
from tests.unit.skills.test_localise_accuracy import raw
from tests.unit.skills.test_slam import RING, START, laps

STEPS, PERIOD_S = 40, 0.2
MOUNT = UPSIDE_DOWN_LASER


@dataclass(frozen=True)
class Moment:
    """One scan of the drive, and where the wheels say that the base was."""

    stamp: float
    scan: LaserScan
    odom: Pose2


def moments(steps: int = STEPS, first: float = 100.0) -> list[Moment]:
    """The drive along the first side of the block."""
    world, found = World(START, boxes=list(RING), seed=5), []
    for number, motion in enumerate(list(laps(1))[:steps]):
        world.now = first + PERIOD_S * number
        found.append(Moment(world.now, raw(world.scan()), world.odom))
        world.pose, world.odom = world.pose @ motion, world.odom @ motion
    return found


def write_carmen(path: Path, drive: Sequence[Moment], offset: float = 0.0) -> Path:
    """A raw log of a laser that is mounted upright, so far in front of the middle."""
    lines = ["# message formats defined: PARAM ODOM FLASER", "PARAM robot_use_laser on 0 host 0"]
    for each in drive:
        ranges = np.where(np.isfinite(each.scan.ranges), each.scan.ranges, 81.83)
        # 181 beams from -90 to 90 degrees; the scan turns the other way.
        angles = np.radians(np.arange(-90.0, 91.0))
        beams = np.interp(-angles, each.scan.angles(), ranges)
        laser, robot = each.odom @ Pose2(offset), each.odom
        poses = " ".join(f"{value:.6f}" for pose in (laser, robot) for value in (pose.x, pose.y, pose.yaw))
        lines.append(
            f"ODOM {robot.x:.6f} {robot.y:.6f} {robot.yaw:.6f} 0 0 0 {each.stamp:.3f} host {each.stamp:.3f}"
        )
        lines.append(
            f"FLASER {len(beams)} {' '.join(f'{beam:.3f}' for beam in beams)} {poses} {each.stamp:.3f} host 0"
        )
    text = "\n".join(lines) + "\n"
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())
    return path


STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types


def _make(name: str, *values: Any) -> Any:
    return TYPES[name](*values)


def _stamp(seconds: float) -> Any:
    nanoseconds = round(seconds * 1e9)
    return _make("builtin_interfaces/msg/Time", nanoseconds // 10**9, nanoseconds % 10**9)


def _header(frame: str, seconds: float) -> Any:
    return _make("std_msgs/msg/Header", _stamp(seconds), frame)


def _quaternion(yaw: float) -> Any:
    return _make("geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def scan_message(scan: LaserScan, stamp: float, frame: str) -> Any:
    """The scan as sensor_msgs/LaserScan."""
    return _make(
        "sensor_msgs/msg/LaserScan",
        _header(frame, stamp),
        scan.angle_min,
        scan.angle_max,
        scan.angle_increment,
        0.0,
        0.1,
        scan.range_min,
        scan.range_max,
        scan.ranges,
        np.empty(0, np.float32),
    )


def odometry_message(odom: Pose2, stamp: float) -> Any:
    """The odometry as nav_msgs/Odometry."""
    point = _make("geometry_msgs/msg/Point", odom.x, odom.y, 0.0)
    pose = _make("geometry_msgs/msg/Pose", point, _quaternion(odom.yaw))
    zero = _make("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0)
    twist = _make("geometry_msgs/msg/Twist", zero, zero)
    nothing = np.zeros(36)
    return _make(
        "nav_msgs/msg/Odometry",
        _header("odom", stamp),
        "base_footprint",
        _make("geometry_msgs/msg/PoseWithCovariance", pose, nothing),
        _make("geometry_msgs/msg/TwistWithCovariance", twist, nothing),
    )


def transform_message(parent: str, child: str, stamp: float, transform: Transform3) -> Any:
    """A message of tf with one transform."""
    x, y, z = map(float, transform.translation)
    move = _make(
        "geometry_msgs/msg/Transform",
        _make("geometry_msgs/msg/Vector3", x, y, z),
        _make("geometry_msgs/msg/Quaternion", *transform.quaternion()),
    )
    stamped = _make("geometry_msgs/msg/TransformStamped", _header(parent, stamp), child, move)
    return _make("tf2_msgs/msg/TFMessage", [stamped])


def write_bag(
    path: Path,
    drive: Sequence[Moment],
    *,
    storage: StoragePlugin = StoragePlugin.MCAP,
    scans: Sequence[str] = ("/scan",),
    odometry: bool = True,
    odom_tf: bool = False,
    mount: bool = True,
    odom_late_s: float = 0.0,
    compression: CompressionMode = CompressionMode.NONE,
) -> Path:
    """A rosbag2 of the drive; the laser hangs upside down."""
    writer = Writer(path, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        for moment, topic, message in _messages(drive, scans, odometry, odom_tf, mount, odom_late_s):
            kind = message.__msgtype__
            connection = next((each for each in writer.connections if each.topic == topic), None)
            connection = connection or writer.add_connection(topic, kind, typestore=STORE)
            writer.write(connection, round(moment * 1e9), STORE.serialize_cdr(message, kind))
    return path


def _messages(
    drive: Sequence[Moment],
    scans: Sequence[str],
    odometry: bool,
    odom_tf: bool,
    mount: bool,
    odom_late_s: float,
) -> Iterator[tuple[float, str, Any]]:
    timed: list[tuple[float, str, Any]] = []
    if mount:
        stamp = drive[0].stamp
        timed.append((stamp, "/tf_static", transform_message("base_footprint", "laser", stamp, MOUNT)))
    for each in drive:
        timed += [(each.stamp + 0.01, topic, scan_message(each.scan, each.stamp, "laser")) for topic in scans]
        late = each.stamp + odom_late_s
        if odometry:
            timed.append((late, "/odom", odometry_message(each.odom, each.stamp)))
        if odom_tf:
            pose = Transform3.from_pose2(each.odom)
            timed.append((late, "/tf", transform_message("odom", "base_footprint", each.stamp, pose)))
    yield from sorted(timed, key=lambda item: item[0])
