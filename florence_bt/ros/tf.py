"""Transforms over ROS: a listener that fills a buffer, and broadcasters."""

from __future__ import annotations

from collections.abc import Iterable

from rclpy.node import Node
from tf2_msgs.msg import TFMessage

from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3, TransformBuffer
from florence_bt.ros.conversions import (
    planar_transform_from_ros,
    stamp_from_ros,
    transform_from_ros,
    transform_to_ros,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import TF, TF_LISTENER, TF_STATIC, TF_STATIC_LISTENER

TF_TOPIC, TF_STATIC_TOPIC = "/tf", "/tf_static"


class TransformListener:
    """Keeps a buffer of everything on ``/tf`` (its part in the plane) and ``/tf_static``.

    When the clock is set back the moving frames are forgotten, as in tf2.

    Args:
        node: Subscribes.
        moving: Also listen to moving frames. That is expensive, and not needed for the mounting of a sensor.

    Attributes:
        buffer: What was received.
    """

    def __init__(self, node: FlorenceNode, *, moving: bool = True) -> None:
        self.buffer = TransformBuffer()
        self._node = node
        node.ros_timebase.on_reset(self.buffer.clear_moving)
        self._subscriptions = [
            node.create_subscription(TFMessage, TF_STATIC_TOPIC, self._on_static, TF_STATIC_LISTENER)
        ]
        if moving:
            self._subscriptions.append(
                node.create_subscription(TFMessage, TF_TOPIC, self._on_moving, TF_LISTENER)
            )

    def close(self) -> None:
        """Unsubscribe; the buffer keeps what was received."""
        self._node.ros_timebase.forget_reset(self.buffer.clear_moving)
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    def _on_moving(self, message: TFMessage) -> None:
        for parent, child, stamp, pose in map(planar_transform_from_ros, message.transforms):
            self.buffer.set_moving(parent, child, stamp, pose)

    def _on_static(self, message: TFMessage) -> None:
        for parent, child, _, transform in map(transform_from_ros, message.transforms):
            self.buffer.set_static(parent, child, transform)


class TransformBroadcaster:
    """Publishes where moving frames are."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(TFMessage, TF_TOPIC, TF)

    def send(self, parent: str, child: str, stamp: float, pose: Pose2) -> None:
        """Publish where a frame was at a moment."""
        self.send_all(stamp, [(parent, child, pose)])

    def send_all(self, stamp: float, frames: Iterable[tuple[str, str, Pose2 | Transform3]]) -> None:
        """Publish where some frames (parent, child, transform) were at a moment, in one message."""
        transforms = [transform_to_ros(parent, child, stamp, where) for parent, child, where in frames]
        self._publisher.publish(TFMessage(transforms=transforms))


class StaticTransformBroadcaster:
    """Publishes where fixed frames are, all of them in one latched message."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(TFMessage, TF_STATIC_TOPIC, TF_STATIC)
        self._node = node
        self._sent: dict[str, tuple[str, Transform3]] = {}

    def send(self, transforms: Iterable[tuple[str, str, Transform3]]) -> None:
        """Publish (parent, child, transform) of some frames; earlier ones stay in the message."""
        for parent, child, transform in transforms:
            self._sent[child] = (parent, transform)
        stamp = stamp_from_ros(self._node.get_clock().now().to_msg())
        self._publisher.publish(
            TFMessage(
                transforms=[
                    transform_to_ros(parent, child, stamp, transform)
                    for child, (parent, transform) in self._sent.items()
                ]
            )
        )
