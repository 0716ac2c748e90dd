"""The Kinect's laser as a component: depth pictures in, and three scans of them out.

Source: document, section 3.7.1.
"""

from __future__ import annotations

from florence_bt.core.errors import FlorenceError
from florence_bt.core.ports import Delivery, Picture, Ports, Topic
from florence_bt.core.sensing import DepthImage, LaserScan
from florence_bt.core.topic_names import KINECT_LOW_SCAN, KINECT_OVERHANG_SCAN
from florence_bt.core.topics import DEPTH, KINECT_SCAN
from florence_bt.skills.filters.depth_to_laser.fake_laser import (
    FakeLaser,
    FakeLaserParameters,
    Throttle,
    ThrottleParameters,
)
from florence_bt.skills.filters.depth_to_laser.low_obstacles import LowObstacleParameters, LowObstacles
from florence_bt.skills.filters.depth_to_laser.overhangs import OverhangParameters, Overhangs

LOW_SCAN = Topic(KINECT_LOW_SCAN, LaserScan, Delivery.SENSOR)
OVERHANG_SCAN = Topic(KINECT_OVERHANG_SCAN, LaserScan, Delivery.SENSOR)


class DepthProjecting:
    """Makes ``kinect_scan``, ``kinect_low_scan`` of what is too low for that, and ``kinect_overhang_scan``.

    Works only while somebody listens, as the old nodelet did (REFERENCE 6.1).
    """

    def __init__(
        self,
        ports: Ports,
        tall: FakeLaserParameters,
        low: LowObstacleParameters,
        overhangs: OverhangParameters,
        throttle: ThrottleParameters,
    ) -> None:
        self._ports = ports
        self._laser = FakeLaser(tall)
        self._low = LowObstacles.between(tall, low)
        self._overhangs = Overhangs.within(tall, overhangs)
        self._throttle = Throttle(throttle)
        self._scans = ports.output(KINECT_SCAN)
        self._low_scans = ports.output(LOW_SCAN)
        self._overhang_scans = ports.output(OVERHANG_SCAN)
        ports.listen(DEPTH, self._take)

    def _take(self, taken: Picture[DepthImage]) -> None:
        if not self._scans.listeners or not self._throttle.admits(taken.stamp):
            return
        try:
            picture = taken.read()
            scan = self._laser.project(picture)
        except FlorenceError as error:
            self._ports.warn(f"depth picture dropped: {error}", DEPTH)
            return
        self._scans.send(scan)
        if self._low is not None:
            self._low_scans.send(self._low.project(picture, scan))
        if self._overhangs is not None:
            self._overhang_scans.send(self._overhangs.project(picture))
