"""The ports of a component on ROS: at this door values become messages, and messages values."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields, is_dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Odometry as OdometryMsg
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_msgs.msg import Bool, Float64, String

from florence_bt.core.clock import Clock
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.interfaces import load_interface
from florence_bt.core.outcome import Outcome
from florence_bt.core.ports import Action, Delivery, Service, Topic
from florence_bt.core.sensing import CameraModel, ColourImage, DepthImage, LaserScan, OccupancyGrid, Odometry
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.conversions import (
    camera_model_from_ros,
    colour_from_ros,
    depth_from_ros,
    grid_from_ros,
    odometry_from_ros,
    scan_from_ros,
    scan_to_ros,
    stamp_from_ros,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR, STATE
from florence_bt.ros.tf import TransformBroadcaster, TransformListener

T = TypeVar("T")
ToRos = Callable[[Any], Any]
WARNING_PERIOD_S = 5.0
"""Between two warnings about one thing, seconds (chosen)."""

_QOS = {
    Delivery.SENSOR: SENSOR,
    Delivery.STATE: STATE,
    Delivery.RELIABLE: RELIABLE,
    Delivery.LATCHED: LATCHED,
}
_PLAIN = {bool: Bool, float: Float64, str: String}
_MESSAGES: Mapping[type, tuple[type, Callable[[Any], Any], ToRos | None]] = {
    LaserScan: (LaserScanMsg, scan_from_ros, scan_to_ros),
    Odometry: (OdometryMsg, odometry_from_ros, None),
    OccupancyGrid: (OccupancyGridMsg, grid_from_ros, None),
}
"""Of values of ``core``: their message, and how one becomes the other; None where more is needed for that."""


@dataclass(slots=True)
class _Picture(Generic[T]):
    """A picture that is decoded when somebody reads it."""

    stamp: float
    _read: Callable[[], T]

    def read(self) -> T:
        """Decode it."""
        return self._read()


class _Listening:
    """Subscriptions that are open until it is closed."""

    def __init__(self, node: FlorenceNode, subscriptions: list[Subscription]) -> None:
        self._node, self._subscriptions = node, subscriptions

    def close(self) -> None:
        """Unsubscribe."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions = []


class _Output(Generic[T]):
    """A topic that is published."""

    def __init__(self, publisher: Publisher, to_ros: ToRos) -> None:
        self._publisher, self._to_ros = publisher, to_ros

    @property
    def wanted(self) -> bool:
        """Whether anybody has subscribed."""
        return bool(self._publisher.get_subscription_count())

    def send(self, value: T) -> None:
        """Publish a value."""
        self._publisher.publish(self._to_ros(value))


class _Goals:
    """An action that is served."""

    def __init__(self, server: SingleGoalServer, interface: Any) -> None:
        self._server, self._interface = server, interface

    @property
    def active(self) -> bool:
        """Whether a goal is being worked on."""
        return self._server.active

    def feedback(self, feedback: Any) -> None:
        """Publish feedback."""
        self._server.publish_feedback(self._interface.Feedback(**asdict(feedback)))

    def finish(self, result: Any, outcome: Outcome) -> None:
        """End the goal."""
        self._server.finish(self._interface.Result(**asdict(result)), outcome)


class RosPorts:
    """Connects a component with ROS.

    Args:
        node: Publishes, subscribes and serves.
        to_ros: How values become messages, by topic, where neither their type nor their fields say it.
    """

    def __init__(self, node: FlorenceNode, to_ros: Mapping[Topic[Any], ToRos] | None = None) -> None:
        self._node = node
        self._to_ros = to_ros or {}
        self._broadcaster: TransformBroadcaster | None = None
        self._worker: ThreadPoolExecutor | None = None
        self._warned: dict[Hashable, float] = {}

    @property
    def clock(self) -> Clock:
        """The node's timebase."""
        return self._node.timebase

    def output(self, topic: Topic[T]) -> _Output[T]:
        """Make a publisher."""
        message_type, to_ros = self._message_of(topic)
        publisher = self._node.create_publisher(message_type, topic.name, _QOS[topic.delivery])
        return _Output(publisher, to_ros)

    def listen(self, topic: Topic[Any], take: Callable[[Any], None]) -> _Listening:
        """Subscribe; what is no value of the topic's kind is left out, with a warning."""
        if topic.kind is DepthImage:
            return self._listen_to_depth(topic, take)
        if topic.kind is ColourImage:
            read: Callable[[Any], Any] = self._colour_picture
            return self._subscribed(topic, Image, read, take)
        message_type, from_ros, _ = _MESSAGES[topic.kind]
        return self._subscribed(topic, message_type, lambda message: self._timed(from_ros(message)), take)

    def listen_to_frames(self) -> TransformListener:
        """Listen to ``/tf`` and ``/tf_static``."""
        return TransformListener(self._node)

    def send_frame(self, parent: str, child: str, when: float, pose: Pose2) -> None:
        """Publish on ``/tf``."""
        if self._broadcaster is None:
            self._broadcaster = TransformBroadcaster(self._node)
        self._broadcaster.send(parent, child, when, pose)

    def serve(self, service: Service, answer: Callable[[], Any]) -> None:
        """Serve a service."""

        def respond(_: Any, response: Any) -> Any:
            return _filled(response, answer())

        self._node.create_service(load_interface(service.interface), service.name, respond)

    def serve_goals(
        self, action: Action, begin: Callable[[Any], str | None], cancel: Callable[[], None]
    ) -> _Goals:
        """Serve an action."""
        interface = load_interface(action.interface)
        names = [field.name for field in fields(action.goal)]

        def on_goal(message: Any) -> str | None:
            return begin(action.goal(**{name: getattr(message, name) for name in names}))

        server = SingleGoalServer(self._node, interface, action.name, on_goal=on_goal, on_cancel=cancel)
        return _Goals(server, interface)

    def work(self, task: Callable[[], T], done: Callable[[T], None]) -> None:
        """Work on a thread; what is not done when the node is closed is forgotten."""
        if self._worker is None:
            self._worker = ThreadPoolExecutor(1, self._node.get_name())
            self._node.on_close(partial(self._worker.shutdown, cancel_futures=True))
        future = self._worker.submit(task)
        future.add_done_callback(lambda each: self._node.call_soon(partial(_hand_over, each, done)))

    def on_time_jump(self, callback: Callable[[], None]) -> None:
        """Call back when the ROS clock has jumped."""
        self._node.ros_timebase.on_reset(callback)

    def warn(self, text: str, about: Hashable = None) -> None:
        """Log a warning."""
        now = self._node.steady.now()
        if now - self._warned.get(about, -WARNING_PERIOD_S) >= WARNING_PERIOD_S:
            self._warned[about] = now
            self._node.get_logger().warning(text)

    def _message_of(self, topic: Topic[Any]) -> tuple[type, ToRos]:
        """Return the message type of a topic, and how a value becomes such a message."""
        if topic in self._to_ros:
            return load_interface(topic.interface), self._to_ros[topic]
        if topic.kind in _PLAIN:
            plain = _PLAIN[topic.kind]
            return plain, lambda value: plain(data=value)
        if topic.interface:
            message_type = load_interface(topic.interface)
            return message_type, lambda value: _filled(message_type(), value)
        message_type, _, to_ros = _MESSAGES[topic.kind]
        assert to_ros is not None, f"{topic.name} needs an entry in to_ros"
        return message_type, lambda value: to_ros(self._node.stamped(value))

    def _subscribed(
        self,
        topic: Topic[Any],
        message_type: type,
        read: Callable[[Any], Any],
        take: Callable[[Any], None],
    ) -> _Listening:
        def receive(message: Any) -> None:
            try:
                value = read(message)
            except FlorenceError as error:
                self.warn(f"{topic.name} is left out: {error}", topic)
                return
            take(value)

        qos = _QOS[topic.delivery]
        return _Listening(
            self._node, [self._node.create_subscription(message_type, topic.name, receive, qos)]
        )

    def _listen_to_depth(self, topic: Topic[Any], take: Callable[[Any], None]) -> _Listening:
        """Subscribe to depth pictures and, beside them, to what their camera is."""
        camera: list[CameraModel] = []
        info = f"{topic.name.rpartition('/')[0]}/camera_info"

        def learn(model: CameraModel) -> None:
            camera[:] = [model]

        def receive(message: Image) -> None:
            if camera:
                read = partial(depth_from_ros, message, camera[0])
                take(self._picture(message, read))

        known = self._subscribed(
            Topic(info, CameraModel, Delivery.SENSOR), CameraInfo, camera_model_from_ros, learn
        )
        pictures = self._node.create_subscription(Image, topic.name, receive, SENSOR)
        return _Listening(self._node, [*known._subscriptions, pictures])

    def _colour_picture(self, message: Image) -> _Picture[ColourImage]:
        # Of colour pictures only the pixels count so far; no camera_info is subscribed to for them.
        camera = CameraModel(message.width, message.height, 1.0, 1.0, 0.0, 0.0)
        return self._picture(message, partial(colour_from_ros, message, camera))

    def _picture(self, message: Image, read: Callable[[], T]) -> _Picture[T]:
        stamp = self._node.time_of(stamp_from_ros(message.header.stamp))
        return _Picture(stamp, lambda: self._timed(read()))

    def _timed(self, value: Any) -> Any:
        return self._node.timed(value) if hasattr(value, "stamp") else value


def _filled(message: Any, value: Any) -> Any:
    """Set the fields of a message that a dataclass has by name."""
    assert is_dataclass(value)
    for field in fields(value):
        setattr(message, field.name, getattr(value, field.name))
    return message


def _hand_over(future: Future[T], done: Callable[[T], None]) -> None:
    if not future.cancelled():
        done(future.result())
