"""Transforms over ROS: a listener that fills a buffer, and broadcasters."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from tf2_msgs.msg import TFMessage

from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3, TransformBuffer
from florence_bt.ros.conversions import (
    planar_transform_from_ros,
    transform_from_ros,
    transform_to_ros,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import (
    OWN_TF_LISTENER,
    OWN_TF_STATIC_LISTENER,
    TF,
    TF_LISTENER,
    TF_STATIC,
    TF_STATIC_LISTENER,
)
from florence_bt.ros.validation import BadMessage

TF_TOPIC, TF_STATIC_TOPIC = "/tf", "/tf_static"


TF_AHEAD_S = 1.5
"""Time ahead of now at which another program's transform may be stamped: one that is stamped later stays the
newest for as long. Chosen: Nav2's AMCL stamps ``map -> odom`` 1 s ahead (its default
``transform_tolerance``)."""
ECHOES = 64
"""Messages of Florence's own, which both subscriptions hear, that are known again without being read."""
JUDGED_AFTER_S, MAX_SUSPECTS = 1.0, 1000
"""Wait of a transform of one of Florence's frames for its copy on the other subscription (seconds of the
machine), and number that may wait. Chosen: a busy node has read what came together long before."""
GOES_ON_S = 10.0
"""A second transform within this time that says something else is of somebody who goes on. One alone may be a
lost copy of a frame that jumped twice meanwhile, as ``odom`` does when the robot finds itself (chosen)."""


@dataclass(frozen=True, slots=True)
class _Suspect:
    """A transform of one of Florence's frames whose publisher is not known yet."""

    due: float
    parent: str
    child: str
    when: float
    pose: Pose2
    contradiction: str


class TransformListener:
    """Keeps a buffer of everything on ``/tf`` (its part in the plane) and ``/tf_static``.

    What Florence's nodes publish wins over what others do (:class:`TransformBuffer`); what is not used is
    counted, logged and published as every refused message, with the names of the nodes it may be of. When no
    other program publishes on the topic, it was a late or lost copy of a message of our own. The buffer's
    moments are those of the node's ``timebase``. When the clock has jumped the moving frames are forgotten,
    as in tf2.

    Args:
        node: Subscribes.
        moving: Also listen to moving frames. That is expensive, and not needed for the mounting of a sensor.

    Attributes:
        buffer: What was received.
    """

    def __init__(self, node: FlorenceNode, *, moving: bool = True) -> None:
        self.buffer = TransformBuffer()
        self._node = node
        self._echoes: deque[bytes] = deque(maxlen=ECHOES)
        self._suspects: deque[_Suspect] = deque(maxlen=MAX_SUSPECTS)
        self._last_doubt: dict[str, float] = {}
        node.ros_timebase.on_reset(self.buffer.clear_moving)
        self._subscriptions: list[Subscription] = []
        # Own messages first: then the same message is known when it comes once more from everybody's topic.
        self._subscribe(TF_STATIC_TOPIC, partial(self._on_static, own=True), OWN_TF_STATIC_LISTENER)
        self._subscribe(TF_STATIC_TOPIC, partial(self._on_static, own=False), TF_STATIC_LISTENER)
        if moving:
            self._subscribe(TF_TOPIC, self._on_own_moving, OWN_TF_LISTENER, sift=self._remember)
            self._subscribe(TF_TOPIC, self._on_moving, TF_LISTENER, sift=self._is_new)

    def _subscribe(self, topic: str, callback: Callable[..., None], qos: QoSProfile, **options: Any) -> None:
        quiet = SubscriptionEventCallbacks(use_default_callbacks=False)  # of publishers that are not our own
        subscription = self._node.create_subscription(
            TFMessage, topic, callback, qos, event_callbacks=quiet, **options
        )
        self._subscriptions.append(subscription)

    def close(self) -> None:
        """Unsubscribe; the buffer keeps what was received."""
        self._node.ros_timebase.forget_reset(self.buffer.clear_moving)
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    def _remember(self, data: bytes) -> bool:
        self._echoes.append(data)
        return True

    def _is_new(self, data: bytes) -> bool:
        return data not in self._echoes

    def _on_own_moving(self, message: TFMessage) -> None:
        for parent, child, stamp, pose in map(planar_transform_from_ros, message.transforms):
            when = self._node.time_of(stamp)
            self._tell(TF_TOPIC, self.buffer.set_moving(parent, child, when, pose, own=True))

    def _on_moving(self, message: TFMessage) -> None:
        """Take what everybody published, Florence's own included when its other copy is late."""
        for parent, child, stamp, pose in map(planar_transform_from_ros, message.transforms):
            own = self.buffer.is_own(child)
            # Of our own frames nothing is kept here, and to ask for the time keeps an idle process awake.
            ahead = 0.0 if own else stamp - (self._node.ros_timebase.ros_now_near(stamp, TF_AHEAD_S) or stamp)
            if ahead > TF_AHEAD_S:
                problem = str(
                    BadMessage(f"{child!r} is {ahead:.1f} s ahead of now", f"{TF_AHEAD_S:g} s and less")
                )
                self._node.health.count_refused(TF_TOPIC, problem)
                continue
            when = self._node.time_of(stamp)
            contradiction = self.buffer.set_moving(parent, child, when, pose)
            if own and contradiction is not None:
                due = self._node.steady.now() + JUDGED_AFTER_S
                self._suspects.append(_Suspect(due, parent, child, when, pose, contradiction))
            else:
                self._tell(TF_TOPIC, contradiction)
        self._judge()

    def _judge(self) -> None:
        """Tell of the transforms that say something else than Florence's own; a lost copy says the same."""
        now = self._node.steady.now()
        while self._suspects and self._suspects[0].due <= now:
            suspect = self._suspects.popleft()
            if self.buffer.agrees(suspect.parent, suspect.child, suspect.when, suspect.pose):
                continue
            if suspect.due - self._last_doubt.get(suspect.child, -GOES_ON_S) < GOES_ON_S:
                self._tell(TF_TOPIC, suspect.contradiction)
            self._last_doubt[suspect.child] = suspect.due

    def _on_static(self, message: TFMessage, *, own: bool) -> None:
        for parent, child, _, transform in map(transform_from_ros, message.transforms):
            self._tell(TF_STATIC_TOPIC, self.buffer.set_static(parent, child, transform, own=own))

    def _tell(self, topic: str, contradiction: str | None) -> None:
        if contradiction is None:
            return
        others = self._other_publishers(topic)
        if others:
            valid = f"another name of that frame, or the end of who publishes it: {' or '.join(others)}"
            self._node.health.count_refused(topic, str(BadMessage(contradiction, valid)))

    def _other_publishers(self, topic: str) -> list[str]:
        """Return the full names of the nodes that publish on a topic and are none of Florence's."""
        return sorted(
            {
                f"{each.node_namespace.rstrip('/')}/{each.node_name}"
                for each in self._node.get_publishers_info_by_topic(topic)
                if each.qos_profile.deadline != TF.deadline
            }
        )


class TransformBroadcaster:
    """Publishes where moving frames are."""

    def __init__(self, node: FlorenceNode) -> None:
        self._publisher = node.create_publisher(TFMessage, TF_TOPIC, TF)
        self._node = node

    def send(self, parent: str, child: str, when: float, pose: Pose2) -> None:
        """Publish where a frame was at a moment of the node's ``timebase``."""
        self.send_all(when, [(parent, child, pose)])

    def send_all(self, when: float, frames: Iterable[tuple[str, str, Pose2 | Transform3]]) -> None:
        """Publish where some frames (parent, child, transform) were at a moment, in one message."""
        stamp = self._node.stamp(when)
        transforms = [transform_to_ros(parent, child, stamp, where) for parent, child, where in frames]
        self._publisher.publish(TFMessage(transforms=transforms))


class StaticTransformBroadcaster:
    """Publishes where fixed frames are, all of them in one latched message."""

    def __init__(self, node: FlorenceNode) -> None:
        self._publisher = node.create_publisher(TFMessage, TF_STATIC_TOPIC, TF_STATIC)
        self._node = node
        self._sent: dict[str, tuple[str, Transform3]] = {}

    def send(self, transforms: Iterable[tuple[str, str, Transform3]]) -> None:
        """Publish (parent, child, transform) of some frames; earlier ones stay in the message."""
        for parent, child, transform in transforms:
            self._sent[child] = (parent, transform)
        stamp = self._node.stamp()
        self._publisher.publish(
            TFMessage(
                transforms=[
                    transform_to_ros(parent, child, stamp, transform)
                    for child, (parent, transform) in self._sent.items()
                ]
            )
        )
