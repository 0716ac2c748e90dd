"""``florence map build``: a map from the recording of a drive."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from florence_bt.app.maps.picture import draw_drive
from florence_bt.app.maps.recordings.recording import Choices, RecordedScan, read_recording
from florence_bt.core.errors import ConfigError
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.map_server.map_writer import save_map
from florence_bt.skills.navigation.mapping.drive import SUFFIX, drive_bytes, load_drive
from florence_bt.skills.navigation.mapping.parameters import SlamParameters
from florence_bt.skills.navigation.mapping.slam import Slam

FARTHEST_MEDIAN_M = 60.0
"""No laser of a robot sees so far at most times: the ranges are not in metres."""
IMPOSSIBLE_MPS = 10.0
"""No robot drives so fast: the odometry is not in metres."""
MOST_TURN_RAD = 4.0
"""From one scan to the next, while it drives on: the headings are not in radians."""
_ODD_STEPS = 20
"""So many steps like this are no accident."""
_BACK_S = 1.0
"""A clock that goes back by so much was set, or a second recording begins."""

Tell = Callable[[float, Slam], None]
"""Is told the part of the recording that is read, and what is known so far."""


@dataclass(frozen=True, slots=True)
class Built:
    """A map that was built.

    Attributes:
        slam: What is known of the drive.
        grid: The map.
        scans: Read from the recording.
        driven_s: How long the robot has driven.
        driven_m: How far.
        took_s: How long the building took, of one core.
        problem: Why the recording was not read to its end; None when it was.
    """

    slam: Slam
    grid: OccupancyGrid
    scans: int
    driven_s: float
    driven_m: float
    took_s: float
    problem: ConfigError | KeyboardInterrupt | None = None


def output_files(out: Path) -> tuple[Path, Path, Path, Path]:
    """Return the files of a map: its description, image, picture of the drive, and the drive."""
    target = out if out.suffix else out.with_suffix(".yaml")
    return target, target.with_suffix(".pgm"), target.with_suffix(".drive.png"), target.with_suffix(SUFFIX)


def build_map(
    log: Path,
    choices: Choices,
    parameters: SlamParameters,
    *,
    resumed: Path | None = None,
    tell: Tell | None = None,
) -> Built:
    """Build a map.

    Args:
        log: The recording.
        choices: Of its topics and frames.
        parameters: Of the mapping.
        resumed: A drive (``.drive``) that the recording goes on with.
        tell: Is told how far it is, at each scan that was kept.

    Returns:
        The map; of what was read when the recording is damaged further on, or a person has interrupted.

    Raises:
        ConfigError: Nothing of the recording can be used.
    """
    slam = Slam(parameters)
    if resumed is not None:
        slam.resume(load_drive(resumed))
    before, began = len(slam.scans), time.process_time()
    watch, problem = _Plausibility(log), None
    try:
        for recorded in read_recording(log, choices):
            watch.check(recorded)
            if slam.update(recorded.scan, recorded.mount, recorded.odom) and tell is not None:
                tell(recorded.read, slam)
    except (ConfigError, KeyboardInterrupt) as error:
        if len(slam.scans) == before:
            raise
        problem = error
    if len(slam.scans) == before:
        raise ConfigError("no scan has met anything", file=log, valid=["scans of a laser that sees walls"])
    slam.settle()
    grid = slam.grid()
    poses = slam.poses
    metres = sum(one.distance_to(other) for one, other in pairwise(poses))
    took = time.process_time() - began
    return Built(slam, grid, watch.scans, watch.seconds, metres, took, problem)


def write_built(built: Built, out: Path) -> tuple[Path, Path, Path, Path]:
    """Write a map with its picture and its drive; return the files.

    Raises:
        ConfigError: They cannot be written.
    """
    description, _, picture, drive = files = output_files(out)
    shown = draw_drive(built.grid, built.slam.poses, built.slam.drive.ties)
    save_map(built.grid, description, others={picture: shown, drive: drive_bytes(built.slam.drive)})
    return files


class _Plausibility:
    """Looks for what cannot be a drive of a robot in metres, radians and seconds."""

    def __init__(self, log: Path) -> None:
        self._log = log
        self._last: RecordedScan | None = None
        self._first_stamp = 0.0
        self._fast = self._turned = 0
        self.scans = 0

    @property
    def seconds(self) -> float:
        return self._last.scan.stamp - self._first_stamp if self._last else 0.0

    def check(self, recorded: RecordedScan) -> None:
        last, self.scans = self._last, self.scans + 1
        if last is None:
            self._first_stamp = recorded.scan.stamp
            self._check_ranges(recorded)
        else:
            self._check_step(last, recorded)
        self._last = recorded

    def _check_ranges(self, recorded: RecordedScan) -> None:
        seen = recorded.scan.ranges[recorded.scan.valid()]
        if len(seen) and float(np.median(seen)) > FARTHEST_MEDIAN_M:
            problem = f"half of the laser's ranges are above {np.median(seen):.0f}: they are not in metres"
            raise ConfigError(problem, file=self._log, valid=["ranges in metres"])

    def _check_step(self, last: RecordedScan, recorded: RecordedScan) -> None:
        seconds = recorded.scan.stamp - last.scan.stamp
        if seconds < -_BACK_S:
            raise ConfigError(
                f"the clock goes back by {-seconds:.1f} s at scan {self.scans}",
                file=self._log,
                valid=["one recording for each drive", "--continue for the second one"],
            )
        metres = last.odom.distance_to(recorded.odom)
        turn = abs(recorded.odom.yaw - last.odom.yaw)
        self._fast = self._fast + 1 if metres > IMPOSSIBLE_MPS * max(seconds, 0.05) else 0
        # A turn by nearly 2 pi is one over the edge of the circle.
        odd = turn > MOST_TURN_RAD and abs(turn - math.tau) > 1.0
        self._turned += odd
        if self._fast >= _ODD_STEPS:
            problem = f"the odometry goes {metres:.0f} m within {seconds:.2f} s: it is not in metres"
            raise ConfigError(problem, file=self._log, valid=["odometry in metres and radians"])
        if self._turned >= _ODD_STEPS:
            problem = f"the odometry turns by {turn:.0f} from scan to scan: it is not in radians"
            raise ConfigError(problem, file=self._log, valid=["odometry in metres and radians"])
