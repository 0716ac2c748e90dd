"""The last pose of the robot in a file, so that a restart needs none."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.text_files import decode, read_bytes, replace_text


def identity_of(grid: OccupancyGrid) -> str:
    """Name a map so that no other one has its name: a pose means nothing in another one."""
    # Rounded: a message has float32 here.
    origin = grid.origin
    place = f"{grid.resolution:.6f} {origin.x:.3f} {origin.y:.3f} {origin.yaw:.4f} {grid.cells.shape}"
    return hashlib.sha256(place.encode() + grid.cells.tobytes()).hexdigest()[:16]


def save_pose(path: Path, pose: Pose2, grid: OccupancyGrid) -> None:
    """Write where the robot is, in one step.

    Args:
        path: The file; its folder must exist.
        pose: base_footprint in the map frame.
        grid: The map.

    Raises:
        OSError: It cannot be written.
    """
    replace_text(path, pose_text(pose, grid))


def pose_text(pose: Pose2, grid: OccupancyGrid) -> str:
    """Return what is in the file of a pose (base_footprint in the map frame)."""
    return json.dumps({"map": identity_of(grid), "x": pose.x, "y": pose.y, "yaw": pose.yaw})


def load_pose(path: Path, grid: OccupancyGrid) -> Pose2 | None:
    """Load the pose that the robot had in this map.

    Returns:
        base_footprint in the map frame; None when there is no file, or it is about another map.

    Raises:
        ConfigError: The file cannot be read.
    """
    if not os.path.lexists(path):
        return None
    try:
        entries = json.loads(decode(read_bytes(path), path))
        if entries["map"] != identity_of(grid):
            return None
        pose = Pose2(float(entries["x"]), float(entries["y"]), float(entries["yaw"]))
    except (ConfigError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"it holds no pose: {error}", file=path, valid=["to remove it"]) from error
    if not pose.is_within_limits():
        raise ConfigError(f"no robot is at {pose}", file=path, valid=["to remove it"])
    return pose
