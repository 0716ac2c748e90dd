"""Logs in the format of CARMEN: laser scans with a reference pose, and the odometry between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from florence_bt.app.maps.recordings.carmen import LONGEST_M, read_carmen
from florence_bt.app.maps.recordings.recording import RecordedScan
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan, OccupancyGrid

FREE_M = 12.0
"""Beams mark and clear cells up to here."""
LEAST_HITS, LEAST_SHARE = 2, 0.25
"""A cell is a surface when so many beams end there, and so many of those that reach it."""
MARGIN_M = 15.0


@dataclass(frozen=True, slots=True)
class Record:
    """One scan.

    Attributes:
        scan: Of a sensor at the robot's middle.
        reference: Where the robot was, map frame.
        motion: By its odometry, since the record before.
    """

    scan: LaserScan
    reference: Pose2
    motion: Pose2


def read_log(path: Path) -> list[Record]:
    """Read the scans of a log that GMapping has corrected.

    Args:
        path: The log, perhaps compressed by gzip.

    Raises:
        ConfigError: It cannot be read, or was not corrected.
    """
    found: list[Record] = []
    before: RecordedScan | None = None
    for each in read_carmen(path):
        if each.reference is None:
            raise ConfigError("the log was not corrected", file=path, valid=["one with lines NEFF"])
        motion = before.odom.inverse() @ each.odom if before else Pose2()
        found.append(Record(each.scan, each.reference, motion))
        before = each
    return found


def thinned(records: Sequence[Record], every: float) -> list[Record]:
    """Return what a slow laser would have seen: a scan after so many metres of way."""
    kept, motion, way = [records[0]], Pose2(), 0.0
    for before, record in pairwise(records):
        motion = motion @ record.motion
        way += before.reference.distance_to(record.reference)
        if way >= every:
            kept.append(replace(record, motion=motion))
            motion, way = Pose2(), 0.0
    return kept


def build_map(records: Sequence[Record], resolution: float = 0.05) -> OccupancyGrid:
    """Build a map from scans at their reference poses."""
    places = np.array([(record.reference.x, record.reference.y) for record in records])
    low, high = places.min(axis=0) - MARGIN_M, places.max(axis=0) + MARGIN_M
    columns, rows = np.ceil((high - low) / resolution).astype(int)
    hits, passes = Counts(rows, columns), Counts(rows, columns)
    along = np.arange(0.0, FREE_M, resolution)
    for record in records:
        pose, scan = record.reference, record.scan
        ranges = np.minimum(scan.ranges, LONGEST_M).astype(float)
        angles = pose.yaw + scan.angles()
        rays = np.stack([np.cos(angles), np.sin(angles)], axis=1) / resolution
        start = (np.array([pose.x, pose.y]) - low) / resolution
        free = along[None, :] < np.minimum(ranges, FREE_M)[:, None] - resolution
        passes.add((start + rays[:, None] * along[None, :, None])[free])
        ends = start + rays * ranges[:, None]
        hits.add(ends[ranges < FREE_M])
    cells = np.full((rows, columns), -1, np.int8)
    ended = hits.total()
    reached = ended + passes.total()
    cells[reached > 0] = 0
    cells[(ended >= LEAST_HITS) & (ended > LEAST_SHARE * reached)] = 100
    return OccupancyGrid(resolution, Pose2(*low.tolist()), cells)


class Counts:
    """The number of points in each cell; those of many scans are counted at once."""

    def __init__(self, rows: int, columns: int) -> None:
        self._rows, self._columns = rows, columns
        self._total = np.zeros(rows * columns)
        self._waiting: list[NDArray[np.int64]] = []

    def add(self, points: NDArray[np.float64]) -> None:
        """Count some points, shape (n, 2), in cells."""
        u, v = np.floor(points).astype(int).T
        inside = (u >= 0) & (u < self._columns) & (v >= 0) & (v < self._rows)
        self._waiting.append(v[inside] * self._columns + u[inside])
        if len(self._waiting) == 100:
            self.total()

    def total(self) -> NDArray[np.float64]:
        """Return the total, shape (rows, columns)."""
        if self._waiting:
            self._total += np.bincount(np.concatenate(self._waiting), minlength=len(self._total))
            self._waiting.clear()
        return self._total.reshape(self._rows, self._columns)
