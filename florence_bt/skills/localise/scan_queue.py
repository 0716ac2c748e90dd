"""Scans wait here until the odometry has caught up with them, so that each meets the pose it was taken at."""

from __future__ import annotations

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import LaserScan, Odometry
from florence_bt.core.transforms import TransformBuffer, TransformUnavailable

_ODOM, _BASE = "odom", "base"


class ScanQueue:
    """Keeps the newest scan of each source and the odometry of the last seconds.

    Attributes:
        odometry: The newest odometry, None before the first.
    """

    def __init__(self, keep_s: float = 3.0) -> None:
        self._poses = TransformBuffer(keep_s)
        self._waiting: dict[str, LaserScan] = {}
        self.odometry: Odometry | None = None

    def add_odometry(self, odometry: Odometry) -> None:
        """Remember where the base was."""
        if not odometry.pose.is_finite():
            return
        self._poses.set_moving(_ODOM, _BASE, odometry.stamp, odometry.pose)
        if self.odometry is None or odometry.stamp >= self.odometry.stamp:
            self.odometry = odometry

    def add_scan(self, source: str, scan: LaserScan) -> None:
        """Queue a scan; an older one of the same source that still waits is dropped."""
        self._waiting[source] = scan

    def take_ready(self) -> list[tuple[str, LaserScan, Pose2]]:
        """Every scan whose moment the odometry has reached, with base_footprint in the odometry frame."""
        if self.odometry is None:
            return []
        ready = []
        for source, scan in tuple(self._waiting.items()):
            if scan.stamp > self.odometry.stamp:
                continue
            del self._waiting[source]
            try:
                ready.append((source, scan, self._poses.lookup_pose(_ODOM, _BASE, scan.stamp)))
            except TransformUnavailable:
                # Older than the odometry that is known: this scan cannot be placed.
                continue
        return ready
