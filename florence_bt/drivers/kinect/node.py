"""The ROS node of the Kinect: source, thread and messages around the driver."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from sensor_msgs.msg import CameraInfo, Image

from florence_bt.core.clock import call_every
from florence_bt.core.errors import DeviceError
from florence_bt.drivers.connection import Connection
from florence_bt.drivers.diagnosis import Diagnosis, Level
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.frames import DepthFrame, Frame
from florence_bt.drivers.kinect.transport import FrameSource, SocketFrameSource
from florence_bt.ros.conversions import camera_info_to_ros, colour_to_ros, depth_to_ros
from florence_bt.ros.diagnostics import diagnostics_to_ros
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
        self._colour_requested = True
        self._newest: dict[type, tuple[Frame, float]] = {}
        self._newest_lock = threading.Lock()
        self._depth = self.create_publisher(Image, "camera/depth/image", SENSOR)
        self._depth_info = self.create_publisher(CameraInfo, "camera/depth/camera_info", SENSOR)
        self._colour = self.create_publisher(Image, "camera/rgb/image_color", SENSOR)
        self._colour_info = self.create_publisher(CameraInfo, "camera/rgb/camera_info", SENSOR)
        self._diagnostics = self.create_publisher(DiagnosticArray, "diagnostics", RELIABLE)
        self._reports = call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._report)
        self._connection: Connection[FrameSource, Frame] = Connection(
            self.timebase,
            self.call_soon,
            lambda: open_source(self._settings.source),
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
        self._connection.works()
        self._colour_requested = True
        self.get_logger().info(f"frames come from {self._settings.source}")

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
            "Depth Pictures": str(self._driver.depth_pictures),
        }
        if self._connection.problem:
            return Diagnosis(Level.ERROR, self._connection.problem, values)
        if self._driver.silent(now):
            return Diagnosis(Level.ERROR, "no depth pictures arrive", values)
        return Diagnosis(Level.OK, "depth pictures arrive", values)

    def _report(self) -> None:
        now = self.timebase.now()
        found = {"Kinect": self._diagnose(now)}
        self._diagnostics.publish(diagnostics_to_ros(found, self.get_name(), self._settings.source, now))
