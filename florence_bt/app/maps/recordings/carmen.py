"""Logs of CARMEN, as they are published: FLASER or ROBOTLASER1 with the odometry, one record a line.

Source: the manual of CARMEN, chapter "Logger"; the files of the Radish repository. In raw logs a FLASER holds
the laser's and the robot's pose by the odometry. In logs that GMapping has corrected both are the corrected
pose, and the line ODOM before it is raw odometry, as seen from the corrected pose of the FLASER before.
"""

from __future__ import annotations

import contextlib
import gzip
import math
import zlib
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import IO, cast

import numpy as np
from numpy.typing import NDArray

from florence_bt.app.maps.recordings.recording import RecordedScan
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3
from florence_bt.ros.validation import MIN_BEAM_STEP_RAD

FRAME = "laser"
LONGEST_M = 20.0
"""Longer ranges are no measurements: these lasers give some 80 m, or 50 m, where nothing came back."""
_FARTHEST_MOUNT_M = 1.5
"""A laser that seems to be farther from the robot's middle is a log whose two poses mean something else."""
_LOOK_AHEAD = 2000
"""Lines in which a log shows whether it was corrected."""
_BAD_FILE = (EOFError, OSError, zlib.error, UnicodeDecodeError)


def read_carmen(path: Path, mount: Transform3 | None = None) -> Iterator[RecordedScan]:
    """Read the scans of a log.

    Args:
        path: The log, perhaps compressed by gzip.
        mount: The laser's frame in the robot's; None for what the log says.

    Raises:
        ConfigError: It cannot be read, is damaged, or is no such log.
    """
    log = _Log(path, mount)
    found = False
    size = max(1, path.stat().st_size)
    number = 0
    try:
        with path.open("rb") as raw, _text(raw, path) as lines:
            log.corrected = _is_corrected(path)
            for number, line in enumerate(lines, 1):
                recorded = log.take(line.split(), number, raw.tell() / size)
                if recorded is not None:
                    found = True
                    yield recorded
    except _BAD_FILE as error:
        problem = "the log ends too early, or is damaged" if not isinstance(error, OSError) else str(error)
        raise ConfigError(problem, file=path, line=number + 1, valid=["a whole copy of it"]) from error
    if not found:
        valid = ["a log of CARMEN", "a bag of ROS (.mcap, .db3, .bag, or the folder of a rosbag2)"]
        raise ConfigError("it has no line FLASER or ROBOTLASER1", file=path, valid=valid)


def _text(raw: IO[bytes], path: Path) -> IO[str]:
    if path.suffix == ".gz":
        return cast("IO[str]", gzip.open(raw, "rt"))
    return path.open(encoding="utf-8")


def _is_corrected(path: Path) -> bool:
    """Tell whether GMapping has written a log: it repeats each corrected pose as odometry at time zero."""
    pose: list[str] = []
    with contextlib.suppress(*_BAD_FILE), path.open("rb") as raw, _text(raw, path) as lines:
        for line in islice(lines, _LOOK_AHEAD):
            words = line.split()
            if words[:1] == ["NEFF"]:
                return True
            if words[:1] == ["FLASER"] and words[1:2] and words[1].isdigit():
                pose = words[2 + int(words[1]) :][:3]
            elif (
                words[:1] == ["ODOM"] and pose and words[1:4] == pose and words[7:8] in (["0"], ["0.000000"])
            ):
                return True
    return False


class _Log:
    """The knowledge of a log between two of its lines."""

    def __init__(self, path: Path, mount: Transform3 | None) -> None:
        self._path, self._mount = path, mount
        self.corrected = False
        # Of a corrected log: the last ODOM, the last reference, and where the raw odometry is.
        self._told: Pose2 | None = None
        self._reference: Pose2 | None = None
        self._odom = Pose2()

    def take(self, words: Sequence[str], number: int, read: float) -> RecordedScan | None:
        kind = words[0] if words else ""
        if kind not in ("ODOM", "FLASER", "ROBOTLASER1"):
            return None
        try:
            if kind == "ODOM":
                self._told = _pose(words[1:4])
                return None
            return (self._flaser if kind == "FLASER" else self._robotlaser)(words, min(1.0, read))
        except (ValueError, IndexError) as error:
            problem = f"this {kind} is cut, or is no line of CARMEN: {error}"
            raise ConfigError(problem, file=self._path, line=number, valid=["a whole copy of it"]) from error

    def _flaser(self, words: Sequence[str], read: float) -> RecordedScan:
        count = int(words[1])
        ranges = _numbers(words[2 : 2 + count], count)
        laser, robot = _pose(words[2 + count : 5 + count]), _pose(words[5 + count : 8 + count])
        # 180 or 360 beams are those of 181 or 361 without the last one.
        scan = _scan(ranges, float(words[8 + count]), -math.pi / 2, math.pi / (count - count % 2), LONGEST_M)
        if not self.corrected:
            return RecordedScan(scan, self._mounted(laser, robot), robot, read)
        if self._reference is not None and self._told is not None:
            self._odom = self._odom @ self._reference.inverse() @ self._told
        self._reference = laser
        return RecordedScan(scan, self._mounted(laser, laser), self._odom, read, laser)

    def _robotlaser(self, words: Sequence[str], read: float) -> RecordedScan:
        start, step, longest = float(words[2]), float(words[4]), float(words[5])
        count = int(words[8])
        if abs(step) < MIN_BEAM_STEP_RAD:
            raise ValueError(f"its beams are {step:g} rad apart")
        ranges = _numbers(words[9 : 9 + count], count)
        rest = words[10 + count + int(words[9 + count]) :]
        laser, robot = _pose(rest[0:3]), _pose(rest[3:6])
        scan = _scan(ranges, float(rest[11]), start, step, min(longest, LONGEST_M))
        return RecordedScan(scan, self._mounted(laser, robot), robot, read)

    def _mounted(self, laser: Pose2, robot: Pose2) -> Transform3:
        """Return the mount, as the first scan tells it."""
        if self._mount is None:
            seen = robot.inverse() @ laser
            near = math.hypot(seen.x, seen.y) <= _FARTHEST_MOUNT_M
            self._mount = Transform3.from_pose2(seen if near else Pose2())
        return self._mount


def _pose(words: Sequence[str]) -> Pose2:
    x, y, yaw = map(float, words)
    return Pose2(x, y, yaw)


def _numbers(words: Sequence[str], count: int) -> NDArray[np.float32]:
    if len(words) != count or count < 2:
        raise ValueError(f"{len(words)} ranges of {count}")
    return np.array(words, np.float32)


def _scan(ranges: NDArray[np.float32], stamp: float, start: float, step: float, longest: float) -> LaserScan:
    return LaserScan(
        stamp=stamp,
        frame_id=FRAME,
        angle_min=start,
        angle_increment=step,
        range_min=0.0,
        range_max=longest,
        ranges=np.where(ranges < longest, ranges, np.where(np.isnan(ranges), ranges, np.float32(np.inf))),
    )
