"""The ports of a component on ROS: at this door values become messages, and messages values."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields
from functools import partial
from typing import Any, Generic, TypeVar

from builtin_interfaces.msg import Duration
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Odometry as OdometryMsg
from nav_msgs.msg import Path
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_msgs.msg import Bool, Float64, String

from florence_bt.core.clock import Clock
from florence_bt.core.diagnosis import Diagnoses
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import FramedPath, FramedPose, Pose2, Twist2, problem_with_quaternion
from florence_bt.core.interfaces import load_interface
from florence_bt.core.outcome import Outcome
from florence_bt.core.ports import WARNING_PERIOD_S, Action, Delivery, Fields, Output, Picture, Service, Topic
from florence_bt.core.sensing import (
    CameraModel,
    ColourImage,
    DepthImage,
    LaserScan,
    OccupancyGrid,
    Odometry,
    PoseEstimate,
)
from florence_bt.core.topics import DIAGNOSES
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.conversions import (
    camera_info_to_ros,
    camera_model_from_ros,
    colour_from_ros,
    colour_to_ros,
    depth_from_ros,
    depth_to_ros,
    duration_from_ros,
    duration_to_ros,
    estimate_from_ros,
    estimate_to_ros,
    frame_from_ros,
    grid_from_ros,
    odometry_from_ros,
    path_to_ros,
    pose_from_ros,
    pose_stamped_to_ros,
    pose_to_ros,
    scan_from_ros,
    scan_to_ros,
    stamp_from_ros,
    stamp_to_ros,
    twist_from_ros,
    twist_to_ros,
)
from florence_bt.ros.diagnostics import diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import COMMAND, LATCHED, RELIABLE, SENSOR, STATE
from florence_bt.ros.tf import TransformBroadcaster, TransformListener

T = TypeVar("T")
ToRos = Callable[[Any], Any]
FromRos = Callable[[Any], Any]

_QOS = {
    Delivery.SENSOR: SENSOR,
    Delivery.STATE: STATE,
    Delivery.COMMAND: COMMAND,
    Delivery.RELIABLE: RELIABLE,
    Delivery.LATCHED: LATCHED,
}
_PUBLISHED = {**_QOS, Delivery.STATE: RELIABLE, Delivery.COMMAND: RELIABLE}
"""Of publishers: those that hear each reading, too, can listen."""
_PLAIN = {bool: Bool, float: Float64, str: String}
_MESSAGES: Mapping[type, tuple[type, Callable[[Any], Any], ToRos | None]] = {
    LaserScan: (LaserScanMsg, scan_from_ros, scan_to_ros),
    Odometry: (OdometryMsg, odometry_from_ros, None),
    OccupancyGrid: (OccupancyGridMsg, grid_from_ros, None),
    PoseEstimate: (PoseWithCovarianceStamped, estimate_from_ros, estimate_to_ros),
    Twist2: (Twist, twist_from_ros, twist_to_ros),
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
    def listeners(self) -> int:
        """Count those who have subscribed."""
        return int(self._publisher.get_subscription_count())

    def send(self, value: T) -> None:
        """Publish a value."""
        self._publisher.publish(self._to_ros(value))


class _PictureOutput(Generic[T]):
    """A topic of pictures that is published, and beside it what their camera is."""

    def __init__(self, node: FlorenceNode, topic: Topic[Any]) -> None:
        self._node = node
        self._images = node.create_publisher(Image, topic.name, SENSOR)
        self._cameras = node.create_publisher(CameraInfo, _camera_of(topic), SENSOR)
        self._to_ros: ToRos = depth_to_ros if topic.kind is DepthImage else colour_to_ros

    @property
    def listeners(self) -> int:
        """The number of those that have subscribed to either."""
        return int(self._images.get_subscription_count() + self._cameras.get_subscription_count())

    def send(self, picture: Picture[T]) -> None:
        """Read a picture and publish it."""
        image: Any = self._node.stamped(picture.read())  # type: ignore[type-var]
        self._cameras.publish(camera_info_to_ros(image.camera, image.frame_id, image.stamp))
        self._images.publish(self._to_ros(image))


class _Goals:
    """An action that is served."""

    def __init__(self, node: FlorenceNode, server: SingleGoalServer, interface: Any) -> None:
        self._node, self._server, self._interface = node, server, interface

    @property
    def active(self) -> bool:
        """Tell whether a goal is being worked on."""
        return self._server.active

    def feedback(self, feedback: Fields) -> None:
        """Publish feedback."""
        self._server.publish_feedback(_filled(self._interface.Feedback(), feedback, self._node))

    def finish(self, result: Fields, outcome: Outcome) -> None:
        """End the goal."""
        self._server.finish(_filled(self._interface.Result(), result, self._node), outcome)


class RosPorts:
    """Connects a component with ROS.

    Args:
        node: Publishes, subscribes and serves.
        to_ros: How values become messages, by topic, where neither their type nor their fields say it.
        from_ros: How messages become values, likewise.
    """

    def __init__(
        self,
        node: FlorenceNode,
        to_ros: Mapping[Topic[Any], ToRos] | None = None,
        from_ros: Mapping[Topic[Any], FromRos] | None = None,
    ) -> None:
        self._node = node
        self._to_ros, self._from_ros = to_ros or {}, from_ros or {}
        self._broadcaster: TransformBroadcaster | None = None
        self._worker: ThreadPoolExecutor | None = None
        self._warned: dict[Hashable, float] = {}

    @property
    def clock(self) -> Clock:
        """The node's timebase."""
        return self._node.timebase

    @property
    def steady(self) -> Clock:
        """The time of this machine."""
        return self._node.steady

    def output(self, topic: Topic[T]) -> Output[T]:
        """Make a publisher; of pictures also one of what their camera is."""
        if topic.kind in (DepthImage, ColourImage):
            return _PictureOutput(self._node, topic)  # type: ignore[return-value]
        message_type, to_ros = self._message_of(topic)
        publisher = self._node.create_publisher(message_type, topic.name, _PUBLISHED[topic.delivery])
        return _Output(publisher, to_ros)

    def listen(self, topic: Topic[Any], take: Callable[[Any], None]) -> _Listening:
        """Subscribe; what is no value of the topic's kind is left out, with a warning."""
        if topic.kind is DepthImage:
            return self._listen_to_depth(topic, take)
        if topic.kind is ColourImage:
            read: Callable[[Any], Any] = self._colour_picture
            return self._subscribed(topic, Image, read, take)
        message_type, from_ros = self._value_of(topic)
        return self._subscribed(topic, message_type, lambda message: self._timed(from_ros(message)), take)

    def listen_to_frames(self, *, moving: bool = True) -> TransformListener:
        """Listen to ``/tf_static``, and to ``/tf`` when those that move are wanted."""
        return TransformListener(self._node, moving=moving)

    def send_frame(self, parent: str, child: str, when: float, pose: Pose2) -> None:
        """Publish on ``/tf``."""
        if self._broadcaster is None:
            self._broadcaster = TransformBroadcaster(self._node)
        self._broadcaster.send(parent, child, when, pose)

    def serve(self, service: Service, answer: Callable[[Any], Fields]) -> None:
        """Serve a service."""

        def respond(message: Any, response: Any) -> Any:
            return _filled(response, answer(_read(service.request, message)), self._node)

        self._node.create_service(load_interface(service.interface), service.name, respond)

    def serve_goals(
        self, action: Action, begin: Callable[[Any], str | None], cancel: Callable[[], None]
    ) -> _Goals:
        """Serve an action."""
        interface = load_interface(action.interface)
        server = SingleGoalServer(
            self._node,
            interface,
            action.name,
            on_goal=lambda message: begin(_read(action.goal, message)),
            on_cancel=cancel,
            bad_goal_code=action.bad_goal_code,
        )
        return _Goals(self._node, server, interface)

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

    def tell(self, text: str, *, good: bool) -> None:
        """Log it."""
        # One line of code each: rclpy refuses another severity from the same line.
        if good:
            self._node.get_logger().info(text)
        else:
            self._node.get_logger().warning(text)

    def warn(self, text: str, about: Hashable = None, period_s: float = WARNING_PERIOD_S) -> None:
        """Log a warning."""
        now = self._node.steady.now()
        if now - self._warned.get(about, -period_s) >= period_s:
            self._warned[about] = now
            self._node.get_logger().warning(text)

    def refuse(self, source: str, problem: str) -> None:
        """Count it among the node's refused messages."""
        self._node.health.count_refused(source, problem)

    def _message_of(self, topic: Topic[Any]) -> tuple[type, ToRos]:
        """Return the message type of a topic, and how a value becomes such a message."""
        if topic in self._to_ros:
            return _message_type(topic), self._to_ros[topic]
        if topic == DIAGNOSES:
            return DiagnosticArray, self._diagnostics
        if topic.kind in _PLAIN:
            plain = _PLAIN[topic.kind]
            return plain, lambda value: plain(data=value)
        if topic.interface:
            message_type = load_interface(topic.interface)
            return message_type, lambda value: _filled(
                message_type(), asdict(self._stamped(value)), self._node
            )
        message_type, _, to_ros = _MESSAGES[topic.kind]
        assert to_ros is not None, f"{topic.name} needs an entry in to_ros"
        return message_type, lambda value: to_ros(self._stamped(value))

    def _value_of(self, topic: Topic[Any]) -> tuple[type, FromRos]:
        """Return the message type of a topic, and how such a message becomes a value."""
        if topic in self._from_ros:
            return _message_type(topic), self._from_ros[topic]
        if topic.kind in _PLAIN:
            return _PLAIN[topic.kind], lambda message: message.data
        if topic.interface:
            return load_interface(topic.interface), partial(_read, topic.kind)
        message_type, from_ros, _ = _MESSAGES[topic.kind]
        return message_type, from_ros

    def _subscribed(
        self,
        topic: Topic[Any],
        message_type: type,
        read: Callable[[Any], Any],
        take: Callable[[Any], None],
    ) -> _Listening:
        return _Listening(self._node, [self._subscription(topic, message_type, read, take)])

    def _subscription(
        self,
        topic: Topic[Any],
        message_type: type,
        read: Callable[[Any], Any],
        take: Callable[[Any], None],
    ) -> Subscription:
        def receive(message: Any) -> None:
            try:
                value = read(message)
            except FlorenceError as error:
                self.warn(f"{topic.name} is left out: {error}", topic)
                return
            take(value)

        return self._node.create_subscription(message_type, topic.name, receive, _QOS[topic.delivery])

    def _listen_to_depth(self, topic: Topic[Any], take: Callable[[Any], None]) -> _Listening:
        """Subscribe to depth pictures and, beside them, to what their camera is."""
        camera: list[CameraModel] = []

        def learn(model: CameraModel) -> None:
            camera[:] = [model]

        def receive(message: Image) -> None:
            if camera:
                read = partial(depth_from_ros, message, camera[0])
                take(self._picture(message, read))

        about = Topic(_camera_of(topic), CameraModel, Delivery.SENSOR)
        known = self._subscription(about, CameraInfo, camera_model_from_ros, learn)
        return _Listening(
            self._node, [known, self._node.create_subscription(Image, topic.name, receive, SENSOR)]
        )

    def _colour_picture(self, message: Image) -> _Picture[ColourImage]:
        # Of colour pictures only the pixels count so far; no camera_info is subscribed to for them.
        camera = CameraModel(message.width, message.height, 1.0, 1.0, 0.0, 0.0)
        return self._picture(message, partial(colour_from_ros, message, camera))

    def _picture(self, message: Image, read: Callable[[], T]) -> _Picture[T]:
        stamp = self._node.time_of(stamp_from_ros(message.header.stamp))
        return _Picture(stamp, lambda: self._timed(read()))

    def _diagnostics(self, told: Diagnoses) -> DiagnosticArray:
        return diagnostics_to_ros(told.found, self._node.get_name(), told.hardware, self._node.stamp())

    def _timed(self, value: Any) -> Any:
        return self._node.timed(value) if hasattr(value, "stamp") else value

    def _stamped(self, value: Any) -> Any:
        return self._node.stamped(value) if hasattr(value, "stamp") else value


def _camera_of(topic: Topic[Any]) -> str:
    """Name the topic on which the camera of pictures is told."""
    return f"{topic.name.rpartition('/')[0]}/camera_info"


def _message_type(topic: Topic[Any]) -> type:
    return load_interface(topic.interface) if topic.interface else _MESSAGES[topic.kind][0]


def _read(kind: type, message: Any) -> Any:
    """Make a dataclass of the fields that a message has of the same names."""
    return kind(**{field.name: _value(getattr(message, field.name)) for field in fields(kind)})


def _value(field: Any) -> Any:
    """Return what a field of a message says."""
    match field:
        case PoseStamped():
            return _framed(field, "")
        case Path():
            return tuple(_framed(pose, field.header.frame_id) for pose in field.poses)
        case Duration():
            return duration_from_ros(field)
        case list():
            return tuple(_value(each) for each in field)
        case _:
            return field


def _framed(message: PoseStamped, frame: str) -> FramedPose:
    """Return a pose; one without a frame is in the frame of what holds it."""
    q = message.pose.orientation
    problem = problem_with_quaternion(q.x, q.y, q.z, q.w)
    pose = Pose2() if problem else pose_from_ros(message.pose)
    return FramedPose(pose, frame_from_ros(message.header.frame_id or frame), problem)


def _filled(message: Any, values: Fields, node: FlorenceNode) -> Any:
    """Set the fields of a message to the values that there are for them by name, and its stamp."""
    kinds = message.get_fields_and_field_types()
    for name in kinds.keys() & values.keys():
        setattr(message, name, _field(kinds[name], values[name], node))
    if "header" in kinds:
        message.header.stamp = stamp_to_ros(values["stamp"] if "stamp" in values else node.stamp())
    return message


def _field(kind: str, value: Any, node: FlorenceNode) -> Any:
    match value:
        case FramedPose():
            return pose_stamped_to_ros(value.pose, value.frame, node.stamp())
        case FramedPath():
            return path_to_ros(value.poses, value.frame, node.stamp())
        case tuple() if kind == "sequence<geometry_msgs/Pose>":
            return [pose_to_ros(pose) for pose in value]
        case _ if kind == "builtin_interfaces/Duration":
            return duration_to_ros(value)
        case _ if kind == "builtin_interfaces/Time":
            return stamp_to_ros(value)
        case _:
            return value


def _hand_over(future: Future[T], done: Callable[[T], None]) -> None:
    if not future.cancelled():
        done(future.result())
