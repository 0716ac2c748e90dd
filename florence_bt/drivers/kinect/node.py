"""The ROS node of the Kinect: source, thread and messages around the driver and its component."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from sensor_msgs.msg import Image, PointCloud2

from florence_bt.core.clock import call_every
from florence_bt.core.errors import DeviceError, DeviceTimeout
from florence_bt.drivers.connection import Connection
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.frames import DepthFrame, Frame
from florence_bt.drivers.kinect.seeing import (
    COLOURED_POINTS,
    DEPTH_POINTS,
    RAW_DEPTH,
    REGISTERED_POINTS,
    CameraSeeing,
    Millimetres,
    Points,
)
from florence_bt.drivers.kinect.sources import FrameSource, open_source
from florence_bt.ros.conversions import millimetres_to_ros, points_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts

CHECK_PERIOD_S = 1.0
"""Between two looks whether the source is silent."""
CLOUDS = (DEPTH_POINTS, COLOURED_POINTS, REGISTERED_POINTS)


class KinectNode(FlorenceNode):
    """Publishes depth images with their camera model, and diagnostics; while somebody looks also colour
    images, points, coloured points, and depth in whole millimetres.

    Opens the source again, with growing pauses, whenever it is lost. A slow executor gets the newest frame of
    each kind and misses the others.

    Parameters: the fields of :class:`KinectParameters`.

    Source: document, section 2.2; REFERENCE 5.4.
    """

    parameter_classes = (KinectParameters,)

    def __init__(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        open_source: Callable[[KinectParameters], FrameSource] = open_source,
    ) -> None:
        """Make the node and try to open the source.

        Args:
            parameters: Values of parameters by name.
            open_source: Opens what the parameters name.
        """
        super().__init__("kinect_node", parameters=parameters)
        self._settings = self.read_parameters(KinectParameters)
        self._driver = KinectDriver(self._settings)
        self._colour_requested = True
        self._newest: dict[type, tuple[Frame, float]] = {}
        self._newest_lock = threading.Lock()
        self._opened = self.timebase.now()
        self._checking = call_every(self.timebase, CHECK_PERIOD_S, self._check)
        self._connection: Connection[FrameSource, Frame] = Connection(
            self.timebase,
            self.call_soon,
            lambda: open_source(self._settings),
            on_open=self._on_open,
            on_item=self._on_frame,
            on_lost=lambda _error: None,
            on_problem=lambda problem: self.get_logger().error(problem),
            delay_s=self._settings.reconnect_delay_s,
            name="the Kinect",
            on_readers_thread=True,
        )
        ports = RosPorts(self, {RAW_DEPTH: self._raw_to_ros, **dict.fromkeys(CLOUDS, self._points_to_ros)})
        self._seeing = CameraSeeing(ports, self._driver, self._connection, self._settings.source)
        self._connection.open()

    def close(self) -> None:
        """Let go of the source."""
        self._seeing.close()
        self._checking.cancel()
        self._connection.close()

    def _on_open(self, _source: FrameSource) -> None:
        self._colour_requested = True
        self._opened = self.timebase.now()
        self._request_colour()
        self.get_logger().info(f"the Kinect is open: {self._settings.source}")

    # --- the reader's thread -------------------------------------------------------------------------------

    def _on_frame(self, frame: Frame, arrived: float) -> None:
        kind = type(frame)
        with self._newest_lock:
            waiting = kind in self._newest
            self._newest[kind] = (frame, arrived)
        if not waiting:
            self.call_soon(partial(self._publish_newest, kind))

    # --- the executor's thread -----------------------------------------------------------------------------

    def _publish_newest(self, kind: type) -> None:
        with self._newest_lock:
            frame, arrived = self._newest.pop(kind)
        if self._connection.device is None:
            return
        if isinstance(frame, DepthFrame):
            self._seeing.take_depth(lambda: frame, arrived)
            self._request_colour()
        elif self._seeing.colour_wanted:
            self._seeing.take_colour(lambda: frame, arrived)

    def _raw_to_ros(self, raw: Millimetres) -> Image:
        return millimetres_to_ros(raw.depth, raw.frame_id, self.stamp(raw.stamp))

    def _points_to_ros(self, cloud: Points) -> PointCloud2:
        return points_to_ros(cloud.points, cloud.frame_id, self.stamp(cloud.stamp))

    def _request_colour(self) -> None:
        """Have no colour images made and sent for nobody."""
        wanted, source = self._seeing.colour_wanted, self._connection.device
        if source is None or wanted == self._colour_requested:
            return
        try:
            source.request(colour=wanted)
            self._colour_requested = wanted
        except DeviceError as error:
            self._connection.lose(error)

    def _check(self) -> None:
        """Open a source again that is open and sends nothing."""
        if self._driver.silence(self._opened, self.timebase.now()) > self._settings.reopen_timeout_s:
            self._connection.lose(
                DeviceTimeout(
                    f"no depth image for {self._settings.reopen_timeout_s:g} s: the Kinect is opened again"
                )
            )
