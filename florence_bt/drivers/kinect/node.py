"""The ROS node of the Kinect: source, thread and messages around the driver."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.context import Context
from sensor_msgs.msg import CameraInfo, Image

from florence_bt.core.clock import Timer, call_every
from florence_bt.core.errors import DeviceError
from florence_bt.drivers.diagnosis import Diagnosis, Level
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.frames import DepthFrame, Frame
from florence_bt.drivers.kinect.transport import FrameReader, FrameSource, SocketFrameSource
from florence_bt.ros.conversions import camera_info_to_ros, colour_to_ros, depth_to_ros, stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE, SENSOR

DIAGNOSTICS_PERIOD_S = 1.0


class KinectNode(FlorenceNode):
    """Publishes depth pictures, colour pictures while somebody looks, their camera models, and diagnostics.

    Opens the source again, with growing pauses, whenever it is lost. A slow executor gets the newest frame of
    each kind and misses the others.

    Parameters: the fields of :class:`KinectParameters`.

    Source: document, section 2.2; REFERENCE 5.4.
    """

    def __init__(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        namespace: str = "",
        context: Context | None = None,
        open_source: Callable[[str], FrameSource] = SocketFrameSource,
    ) -> None:
        """Make the node and try to open the source.

        Args:
            parameters: Values of parameters by name.
            namespace: Goes before the node's name and topics.
            context: The ROS context.
            open_source: Opens what the parameter ``source`` names.
        """
        super().__init__("kinect_node", parameters=parameters, namespace=namespace, context=context)
        self._settings = self.read_parameters(KinectParameters)
        self._driver = KinectDriver(self._settings)
        self._open_source = open_source
        self._source: FrameSource | None = None
        self._reader: FrameReader | None = None
        self._colour_requested = True
        self._problem = ""
        self._attempts = 0
        self._newest: dict[type, tuple[Frame, float]] = {}
        self._newest_lock = threading.Lock()
        self._depth = self.create_publisher(Image, "camera/depth/image", SENSOR)
        self._depth_info = self.create_publisher(CameraInfo, "camera/depth/camera_info", SENSOR)
        self._colour = self.create_publisher(Image, "camera/rgb/image_color", SENSOR)
        self._colour_info = self.create_publisher(CameraInfo, "camera/rgb/camera_info", SENSOR)
        self._diagnostics = self.create_publisher(DiagnosticArray, "diagnostics", RELIABLE)
        self._retry: Timer | None = None
        self._reports = call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._report)
        self._connect()

    def close(self) -> None:
        """Let go of the source."""
        self._reports.cancel()
        if self._retry is not None:
            self._retry.cancel()
        self._release()

    # --- source -----------------------------------------------------------------------------------------

    def _connect(self) -> None:
        self._retry = None
        try:
            source = self._open_source(self._settings.source)
        except DeviceError as error:
            self._retry_later(error)
            return
        self._source, self._problem, self._attempts = source, "", 0
        self._colour_requested = True
        self._reader = FrameReader(source, self._on_frame, partial(self._on_lost, source))
        self._reader.start()
        self.get_logger().info(f"frames come from {self._settings.source}")

    def _release(self) -> None:
        source, reader = self._source, self._reader
        self._source = self._reader = None
        if reader is not None:
            reader.stop()
        if source is not None:
            source.close()

    def _retry_later(self, error: DeviceError) -> None:
        if str(error) != self._problem:
            self.get_logger().error(str(error))
        self._problem = str(error)
        delay = self._settings.reconnect_delay_s * min(2 ** min(self._attempts, 4), 10)
        self._attempts += 1
        self._retry = self.timebase.call_at(self.timebase.now() + delay, self._connect)

    def _lose(self, source: FrameSource, error: DeviceError) -> None:
        if source is self._source:
            self._release()
            self._retry_later(error)

    # --- the reader's thread -------------------------------------------------------------------------------

    def _on_frame(self, frame: Frame) -> None:
        kind, arrived = type(frame), self.timebase.now()
        with self._newest_lock:
            waiting = kind in self._newest
            self._newest[kind] = (frame, arrived)
        if not waiting:
            self.call_soon(partial(self._publish_newest, kind))

    def _on_lost(self, source: FrameSource, error: DeviceError) -> None:
        self.call_soon(lambda: self._lose(source, error))

    # --- the executor's thread -----------------------------------------------------------------------------

    def _publish_newest(self, kind: type) -> None:
        with self._newest_lock:
            frame, arrived = self._newest.pop(kind)
        if isinstance(frame, DepthFrame):
            picture = self._driver.depth(frame, arrived)
            if picture is not None:
                self._depth_info.publish(camera_info_to_ros(picture.camera, picture.frame_id, picture.stamp))
                self._depth.publish(depth_to_ros(picture))
            self._request_colour()
            return
        if self._colour_wanted():
            colour = self._driver.colour(frame, arrived)
            self._colour_info.publish(camera_info_to_ros(colour.camera, colour.frame_id, colour.stamp))
            self._colour.publish(colour_to_ros(colour))

    def _colour_wanted(self) -> bool:
        return self._colour.get_subscription_count() + self._colour_info.get_subscription_count() > 0

    def _request_colour(self) -> None:
        """Have no colour pictures made and sent for nobody."""
        wanted, source = self._colour_wanted(), self._source
        if source is None or wanted == self._colour_requested:
            return
        try:
            source.request(colour=wanted)
            self._colour_requested = wanted
        except DeviceError as error:
            self._lose(source, error)

    def _diagnose(self, now: float) -> Diagnosis:
        values = {
            "Source": self._settings.source,
            "Frequency": f"{self._driver.rate(now):.2f}",
            "Depth Pictures": str(self._driver.depth_pictures),
        }
        if self._problem:
            return Diagnosis(Level.ERROR, self._problem, values)
        if self._driver.silent(now):
            return Diagnosis(Level.ERROR, "no depth pictures arrive", values)
        return Diagnosis(Level.OK, "depth pictures arrive", values)

    def _report(self) -> None:
        now = self.timebase.now()
        found = self._diagnose(now)
        status = DiagnosticStatus(
            level=bytes([found.level]),
            name=f"{self.get_name()}: Kinect",
            message=found.message,
            hardware_id=self._settings.source,
            values=[KeyValue(key=key, value=value) for key, value in found.values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = stamp_to_ros(now)
        self._diagnostics.publish(message)
