"""The ROS node of the Kinect: source, thread and messages around the driver."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from sensor_msgs.msg import CameraInfo, Image, PointCloud2

from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.errors import DeviceError, DeviceTimeout
from florence_bt.core.sensing import DepthImage
from florence_bt.core.topic_names import (
    COLOUR_CAMERA_INFO,
    COLOUR_IMAGE,
    DEPTH_CAMERA_INFO,
    DEPTH_IMAGE,
    DEPTH_POINTS,
    RAW_DEPTH_IMAGE,
)
from florence_bt.drivers.connection import Connection
from florence_bt.drivers.kinect.camera import depth_to_points
from florence_bt.drivers.kinect.codec import millimetres_from_metres
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.frames import DepthFrame, Frame, VideoFrame
from florence_bt.drivers.kinect.sources import FrameSource, open_source
from florence_bt.ros.conversions import (
    camera_info_to_ros,
    colour_to_ros,
    depth_to_ros,
    millimetres_to_ros,
    points_to_ros,
)
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import SENSOR

DIAGNOSTICS_PERIOD_S = 1.0
BLIND = "no pixel of the depth images has a distance: is the lens covered, or does the sun shine into it?"


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
        self._depth = self.create_publisher(Image, DEPTH_IMAGE, SENSOR)
        self._raw = self.create_publisher(Image, RAW_DEPTH_IMAGE, SENSOR)
        self._points = self.create_publisher(PointCloud2, DEPTH_POINTS, SENSOR)
        self._depth_info = self.create_publisher(CameraInfo, DEPTH_CAMERA_INFO, SENSOR)
        self._colour = self.create_publisher(Image, COLOUR_IMAGE, SENSOR)
        self._coloured = [
            self.create_publisher(PointCloud2, name, SENSOR)
            for name in ("camera/rgb/points", "camera/depth_registered/points")
        ]
        self._colour_info = self.create_publisher(CameraInfo, COLOUR_CAMERA_INFO, SENSOR)
        self._diagnostics = diagnostics_publisher(self)
        self._reports = call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._report)
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
        self._connection.open()

    def close(self) -> None:
        """Let go of the source."""
        self._reports.cancel()
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
            self._connection.works()
            image = self._driver.depth(frame, arrived)
            if image is not None:
                self._publish_depth(image)
            self._request_colour()
        elif self._colour_wanted():
            self._publish_colour(frame, arrived)

    def _publish_depth(self, image: DepthImage) -> None:
        image = self.stamped(image)
        frame_id, stamp = image.frame_id, image.stamp
        self._depth_info.publish(camera_info_to_ros(image.camera, frame_id, stamp))
        self._depth.publish(depth_to_ros(image))
        if self._raw.get_subscription_count():
            self._raw.publish(millimetres_to_ros(millimetres_from_metres(image.depth), frame_id, stamp))
        if self._points.get_subscription_count():
            points = depth_to_points(image.depth, image.camera)
            self._points.publish(points_to_ros(points, frame_id, stamp))

    def _publish_colour(self, frame: VideoFrame, arrived: float) -> None:
        colour = self._driver.colour(frame, arrived)
        if self._colour.get_subscription_count() + self._colour_info.get_subscription_count():
            stamp = self.stamp(colour.stamp)
            self._colour_info.publish(camera_info_to_ros(colour.camera, colour.frame_id, stamp))
            self._colour.publish(colour_to_ros(self.stamped(colour)))
        wanted = [publisher for publisher in self._coloured if publisher.get_subscription_count()]
        coloured = self._driver.coloured_points(colour) if wanted else None
        if coloured is not None:
            image, points = coloured
            message = points_to_ros(points, image.frame_id, self.stamp(image.stamp))
            for publisher in wanted:
                publisher.publish(message)

    def _colour_wanted(self) -> bool:
        publishers = (self._colour, self._colour_info, *self._coloured)
        return any(publisher.get_subscription_count() for publisher in publishers)

    def _request_colour(self) -> None:
        """Have no colour images made and sent for nobody."""
        wanted, source = self._colour_wanted(), self._connection.device
        if source is None or wanted == self._colour_requested:
            return
        try:
            source.request(colour=wanted)
            self._colour_requested = wanted
        except DeviceError as error:
            self._connection.lose(error)

    def _diagnose(self, now: float) -> Diagnosis:
        values = {
            "Source": self._settings.source,
            "Frequency": f"{self._driver.rate(now):.2f}",
            "Depth Images": str(self._driver.depth_images),
            "Times Lost": str(self._connection.lost),
        }
        if self._connection.problem:
            return Diagnosis(Severity.ERROR, self._connection.problem, values)
        if self._driver.silent(now):
            return Diagnosis(Severity.ERROR, "no depth images arrive", values)
        if self._driver.blind:
            return Diagnosis(Severity.WARN, BLIND, values)
        return Diagnosis(Severity.OK, "depth images arrive", values)

    def _report(self) -> None:
        now = self.timebase.now()
        found = {"Kinect": self._diagnose(now)}
        self._diagnostics.publish(
            diagnostics_to_ros(found, self.get_name(), self._settings.source, self.stamp())
        )
        if self._driver.silence(self._opened, now) > self._settings.reopen_timeout_s:
            self._connection.lose(
                DeviceTimeout(
                    f"no depth image for {self._settings.reopen_timeout_s:g} s: the Kinect is opened again"
                )
            )
