"""A recording in any format: scans, and where the odometry saw the base meanwhile."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.maps.recordings.bag_files import bags_in, is_bag
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3

_MAGIC = {b"\x89MCAP": ".mcap", b"SQLite format 3": ".db3", b"#ROSBAG": ".bag"}

_MOST_NAMED = 5
"""Recordings that an error offers. Chosen."""


@dataclass(frozen=True, slots=True)
class Choices:
    """The choices where a recording offers more, or less, than is needed.

    Attributes:
        scan: The topic of the laser; None for the only one.
        odometry: The topic of the odometry; None for the only one, or tf when there is none.
        odom_frame: The frame of the odometry in tf.
        base_frame: The robot's frame; None for the one that the odometry names, or the usual ones.
        mount: The laser's frame in the robot's, where the recording does not know it.
        urdf: A description of the robot (URDF, xacro) that knows it.
    """

    scan: str | None = None
    odometry: str | None = None
    odom_frame: str = "odom"
    base_frame: str | None = None
    mount: Transform3 | None = None
    urdf: Path | None = None


@dataclass(frozen=True, slots=True)
class RecordedScan:
    """One scan of a recording.

    Attributes:
        scan: As the laser gave it.
        mount: The laser's frame in the base's.
        odom: The base in the odometry's frame when the scan was taken.
        read: The part of the recording that is read so far, 0 to 1.
        reference: Where the log says that the robot really was; only corrected logs of CARMEN know.
    """

    scan: LaserScan
    mount: Transform3
    odom: Pose2
    read: float
    reference: Pose2 | None = None


def read_recording(path: Path, choices: Choices | None = None) -> Iterator[RecordedScan]:
    """Read the scans of a recording in the order in which they were taken.

    Args:
        path: A log of CARMEN, perhaps compressed by gzip; an MCAP, db3 or ROS 1 bag file,
            perhaps compressed by zstd, or cut off; a rosbag2's folder, perhaps without its metadata.
        choices: Which of its topics and frames; nothing of a log of CARMEN can be chosen but the mount.

    Raises:
        ConfigError: It cannot be read, has no scans or no odometry, or more than one of them.
    """
    choices = choices or Choices()
    if not path.exists():
        raise ConfigError("there is no such recording", file=path, valid=_recordings_near(path))
    if path.is_dir() or is_bag(path):
        from florence_bt.app.maps.recordings.bags import read_bag

        return read_bag(path, choices)
    from florence_bt.app.maps.recordings.carmen import read_carmen

    with path.open("rb") as file:
        start = file.read(16)
    for magic, suffix in _MAGIC.items():
        if start.startswith(magic):
            raise ConfigError(f"this is a {suffix} file", file=path, valid=[f"the name {path.name}{suffix}"])
    return read_carmen(path, choices.mount)


def _recordings_near(path: Path) -> Sequence[str]:
    """Return the bags in the folder, most alike first; what a recording is when there are none."""
    try:
        bags = bags_in(path.parent)
    except OSError:
        bags = []
    near = closest_first(str(path), bags)[:_MOST_NAMED]
    return near or ["an MCAP file, the folder of a rosbag2, or a log of CARMEN"]
