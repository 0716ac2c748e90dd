"""Scans wait here until the odometry has caught up with them, so that each meets the pose it was taken at."""

from __future__ import annotations

from collections import deque

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan, Odometry
from florence_bt.core.transforms import TransformBuffer, TransformUnavailable

_ODOM, _BASE = "odom", "base"
MOST_SCANS_WAITING = 10
"""Scans of one source that wait at most; an odometry that is further behind is of no use."""


class ScanQueue:
    """Keeps the newest scans of each source and the odometry of the last seconds.

    Attributes:
        odometry: The newest odometry, None before the first.
    """

    def __init__(self, keep_s: float = 3.0) -> None:
        self._poses = TransformBuffer(keep_s)
        self._waiting: dict[str, deque[LaserScan]] = {}
        self.odometry: Odometry | None = None

    def clear(self) -> None:
        """Forget everything: the clock has jumped, and what was on its way may count as the newest."""
        self._poses.clear_moving()
        self._waiting.clear()
        self.odometry = None

    def add_odometry(self, odometry: Odometry) -> None:
        """Remember where the base was."""
        if not odometry.pose.is_finite():
            return
        self._poses.set_moving(_ODOM, _BASE, odometry.stamp, odometry.pose)
        if self.odometry is None or odometry.stamp >= self.odometry.stamp:
            self.odometry = odometry

    def add_scan(self, source: str, scan: LaserScan) -> None:
        """Queue a scan. Older ones wait on: an odometry that is always late never reaches the newest."""
        self._waiting.setdefault(source, deque(maxlen=MOST_SCANS_WAITING)).append(scan)

    def take_ready(self) -> list[tuple[str, LaserScan, Pose2]]:
        """Return the newest scan of each source whose middle the odometry has reached; drop older ones.

        Returns:
            Source, scan and the pose of base_footprint in the odometry frame at the scan's middle.
        """
        if self.odometry is None:
            return []
        ready = []
        for source, waiting in self._waiting.items():
            scan = None
            while waiting and waiting[0].middle_stamp <= self.odometry.stamp:
                scan = waiting.popleft()
            if scan is None:
                continue
            try:
                ready.append((source, scan, self._poses.lookup_pose(_ODOM, _BASE, scan.middle_stamp)))
            except TransformUnavailable:
                # Older than the odometry that is known: this scan cannot be placed.
                continue
        return ready
