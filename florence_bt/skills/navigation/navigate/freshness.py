"""When the robot was last told where it is and what is around it; without both it does not move."""

from __future__ import annotations

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import Odometry


class Freshness:
    """Remembers the newest scan of each sensor and says what is missing.

    Args:
        timeout: Older data counts as missing, in seconds; data from as far ahead too, because it would look
            fresh for too long after the sensor has fallen silent.
        scan_timeout: A sensor of which nothing has come for so long counts as missing, in seconds. Scans that
            come regularly may be older: on a busy machine all are late.
        required: The sensors without which the robot does not move.
    """

    def __init__(self, timeout: float, scan_timeout: float, required: tuple[str, ...]) -> None:
        self._timeout = timeout
        self._scan_timeout = scan_timeout
        self._required = required
        self._scans: dict[str, float] = {}
        self._arrived: dict[str, float] = {}

    def saw(self, source: str, stamp: float, arrived: float) -> None:
        """A scan came."""
        self._scans[source] = stamp
        self._arrived[source] = arrived

    def missing(
        self, now: float, odometry: Odometry | None, map_from_odom: Pose2 | None, *, needs_map: bool
    ) -> tuple[str, str] | None:
        """What is missing, as (code, reason); None when all is there."""
        if odometry is None or not odometry.pose.is_finite():
            return "no_pose", "the base says nothing about its odometry"
        if abs(now - odometry.stamp) > self._timeout:
            return "no_pose", f"the odometry is not of the last {self._timeout:g} s"
        if needs_map and (map_from_odom is None or not map_from_odom.is_finite()):
            return "no_pose", "the robot does not know where it is in the map"
        for source in self._required:
            stamp = self._scans.get(source)
            if stamp is None:
                return "no_scan", f"no scan of {source!r} has come yet"
            if abs(now - stamp) > self._timeout:
                return "no_scan", f"the last scan of {source!r} is not of the last {self._timeout:g} s"
            if not 0.0 <= now - self._arrived[source] <= self._scan_timeout:
                return "no_scan", f"no scan of {source!r} has come for {self._scan_timeout:g} s"
        return None
