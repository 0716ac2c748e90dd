"""The laser combinator as a component: ``scan`` and ``kinect_scan`` in, ``scan_combined`` out.

Source: document, section 3.7.1.
"""

from __future__ import annotations

from florence_bt.core.ports import Delivery, Ports, Topic
from florence_bt.core.sensing import LaserScan
from florence_bt.core.topic_names import SCAN_COMBINED
from florence_bt.core.topics import KINECT_SCAN, SCAN
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.skills.filters.laser_combinator.combinator import LaserCombinator
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters

COMBINED = Topic(SCAN_COMBINED, LaserScan, Delivery.SENSOR)


class LaserCombining:
    """Combines whenever a Kinect scan comes and both scans are fresh."""

    def __init__(self, ports: Ports, parameters: CombinatorParameters) -> None:
        self._ports = ports
        self._combinator = LaserCombinator(parameters)
        # Frames are needed to move the Kinect's points only, and only until the mounting is known.
        self._frames = ports.listen_to_frames() if parameters.project_origin else None
        self._combined = ports.output(COMBINED)
        ports.listen(SCAN, self._take_laser)
        ports.listen(KINECT_SCAN, self._take_kinect)

    def _take_laser(self, scan: LaserScan) -> None:
        self._send(self._combinator.update_laser(scan, self._ports.clock.now()))

    def _take_kinect(self, scan: LaserScan) -> None:
        self._learn_mounting(self._combinator.parameters.kinect_frame_id or scan.frame_id)
        self._send(self._combinator.update_kinect(scan, self._ports.clock.now()))

    def _learn_mounting(self, kinect_frame: str) -> None:
        laser_frame = self._combinator.laser_frame
        if self._frames is None or laser_frame is None:
            return
        try:
            self._combinator.laser_from_kinect = self._frames.buffer.lookup(laser_frame, kinect_frame)
        except TransformUnavailable as error:
            self._ports.warn(f"nothing combined yet: {error}", KINECT_SCAN)
            return
        frames, self._frames = self._frames, None
        self._ports.clock.call_at(self._ports.clock.now(), frames.close)

    def _send(self, scan: LaserScan | None) -> None:
        if scan is not None:
            self._combined.send(scan)
