"""Messages of any type with generated extremes, and an attack on a running system with them.

The generator works from the definition of a type, so that a new type needs nothing here. The attack is a node
in a process of its own that publishes on every topic somebody listens to, calls every service and sends goals
to every action that it finds in the graph.
"""

from __future__ import annotations

import array
import copy
import importlib
import math
import random
import re
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

FLOATS = (0.0, 1.0, -1.0, 1e-30, 6.3, 1e5, 1e17, -1e17, math.nan, math.inf, -math.inf)
DOUBLES = (*FLOATS, 1e308, -1e308)
TEXTS = (
    "",
    " ",
    "map",
    "odom",
    "base_footprint",
    "laser",
    "kitchen",
    "a\x85b",
    "a\u2028b",
    "\x1b[2J",
    "\U0001f916",
)
LONG_TEXT = "x" * 10_001
LENGTHS = (0, 1, 2, 7, 1_000, 30_000)
MOST_PARTS = 3
"""Of a generated sequence of messages; and how many fields of an ordinary message are spoilt at most."""

_BITS = re.compile(r"(u?)int(8|16|32|64)")
_ARRAY = re.compile(r"(.+)\[(\d+)\]")
_SEQUENCE = re.compile(r"sequence<(.+?)(?:, *(\d+))?>")
_CODES = {"float": "f", "double": "d", "uint8": "B", "octet": "B", "int8": "b"}


def load_type(name: str) -> Any:
    """Load a type by its name in the graph: ``nav_msgs/msg/Odometry``, or ``nav_msgs/Odometry``."""
    package, *middle, last = name.split("/")
    action, _, part = last.rpartition("_")  # what an action is made of
    if part in ("Goal", "Result", "Feedback"):
        return getattr(getattr(importlib.import_module(f"{package}.action"), action), part)
    module = importlib.import_module(f"{package}.{middle[0] if middle else 'msg'}")
    if part in ("FeedbackMessage", "SendGoal", "GetResult"):
        return getattr(getattr(module, action).Impl, part + ("" if part == "FeedbackMessage" else "Service"))
    return getattr(module, last)


def arbitrary(message_type: Any, rng: random.Random) -> Any:
    """Make a message, request or goal whose every field is drawn from the extremes of its type."""
    message = message_type()
    for name, kind in message_type.get_fields_and_field_types().items():
        setattr(message, name, _value(kind, rng))
    return message


def ordinary(message_type: Any, now: float) -> Any:
    """Make a message that nothing is wrong with, stamped now (seconds)."""
    message = message_type()
    _FILLED.get(message_type.__name__, lambda _: None)(message)
    for part in _parts(message):
        if type(part).__name__ == "Header":
            part.stamp.sec, part.stamp.nanosec = int(now), int(now % 1 * 1e9)
        elif type(part).__name__ == "Quaternion":
            part.w = 1.0
    return message


def spoilt(message: Any, rng: random.Random) -> Any:
    """Make a copy of an ordinary message with a few fields replaced by extremes of their types."""
    result = copy.deepcopy(message)
    places = [(part, name) for part in _parts(result) for name in part.get_fields_and_field_types()]
    for _ in range(rng.randint(1, MOST_PARTS)):
        if places:
            part, name = rng.choice(places)
            setattr(part, name, _value(part.get_fields_and_field_types()[name], rng))
    return result


def _value(kind: str, rng: random.Random) -> Any:
    """Choose a value for a field of a type as ``get_fields_and_field_types`` writes it."""
    if match := _ARRAY.fullmatch(kind):
        return _repeated(match[1], int(match[2]), rng)
    if match := _SEQUENCE.fullmatch(kind):
        length = rng.choice(LENGTHS)
        return _repeated(match[1], min(length, int(match[2] or length)), rng)
    if match := _BITS.fullmatch(kind):
        bits = int(match[2])
        low, high = (0, 2**bits - 1) if match[1] else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        return rng.choice((low, high, 0, 1, high // 2))
    if kind in ("float", "double"):
        return rng.choice(FLOATS if kind == "float" else DOUBLES)
    if kind == "boolean":
        return rng.choice((True, False))
    if kind == "octet":
        return bytes([rng.choice((0, 1, 255))])
    if kind.startswith(("string", "wstring")):
        return rng.choice((*TEXTS, LONG_TEXT))
    return arbitrary(load_type(kind), rng)


def _repeated(kind: str, length: int, rng: random.Random) -> Any:
    if "/" in kind or kind.startswith("string"):
        return [_value(kind, rng) for _ in range(length if length < 100 and "/" not in kind else MOST_PARTS)]
    value = _value(kind, rng)
    if kind == "octet":
        return [value] * length
    return array.array(_CODES[kind], [value]) * length if kind in _CODES else [value] * length


def _parts(message: Any) -> Iterator[Any]:
    """Yield a message and all messages in it."""
    yield message
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        for part in value if isinstance(value, list) else [value]:
            if hasattr(part, "get_fields_and_field_types"):
                yield from _parts(part)


def _fill_scan(message: Any) -> None:
    message.header.frame_id = "laser"
    message.angle_min, message.angle_max, message.angle_increment = -1.5, 1.5, 0.03
    message.range_min, message.range_max, message.scan_time = 0.02, 4.0, 0.1
    message.ranges = array.array("f", [2.0] * 101)


def _fill_map(message: Any) -> None:
    message.info.resolution, message.info.width, message.info.height = 0.1, 60, 50
    cells = array.array("b", [0] * 3000)
    cells[:60] = array.array("b", [100] * 60)
    message.data = cells


def _fill_image(message: Any) -> None:
    message.header.frame_id = "camera"
    message.width, message.height, message.encoding, message.step = 16, 12, "32FC1", 64
    message.data = array.array("B", array.array("f", [2.0] * 192).tobytes())


def _fill_camera(message: Any) -> None:
    message.width, message.height = 16, 12
    message.k = [20.0, 0.0, 8.0, 0.0, 20.0, 6.0, 0.0, 0.0, 1.0]


def _fill_frames(message: Any) -> None:
    frame = load_type("geometry_msgs/TransformStamped")()
    frame.header.frame_id, frame.child_frame_id = "odom", "base_footprint"
    message.transforms = [frame]


def _fill_spin(message: Any) -> None:
    message.target_yaw, message.time_allowance.sec = 1.0, 10


def _fill_home_event(message: Any) -> None:
    message.sensor, message.active = "pir", True


def _fill_run_tree(message: Any) -> None:
    from florence_interfaces.msg import TreeNode

    message.mission, message.nodes = "go", [TreeNode(status=TreeNode.RUNNING, title="go")]


_FILLED: dict[str, Callable[[Any], None]] = {
    "HomeEvent": _fill_home_event,
    "LaserScan": _fill_scan,
    "OccupancyGrid": _fill_map,
    "RunTree": _fill_run_tree,
    "Image": _fill_image,
    "CameraInfo": _fill_camera,
    "TFMessage": _fill_frames,
    "Spin_Goal": _fill_spin,
}
"""Messages that are not ordinary with zeros in them."""


@dataclass
class Report:
    """The effects of an attack.

    Attributes:
        sent: How many messages went to each topic, service and action, by its name and type.
        nodes_lost: Nodes that were in the graph before the attack and are not afterwards.
        goals: How goals ended, by status; ``rejected`` and ``no answer`` among them.
    """

    sent: Counter[str] = field(default_factory=Counter)
    nodes_lost: list[str] = field(default_factory=list)
    goals: Counter[str] = field(default_factory=Counter)

    def __str__(self) -> str:
        """Write a table for people."""
        lines = [f"{count:6} {name}" for name, count in sorted(self.sent.items())]
        lines.append(f"{sum(self.sent.values()):6} in all; goals: {dict(self.goals)}")
        lines.append(f"nodes lost: {', '.join(self.nodes_lost) or 'none'}")
        return "\n".join(lines)


QUIET = ("/rosout", "/parameter_events")
"""Topics that nodes of rclpy have for themselves."""
SETTLE_S = 3.0
"""Time for discovery before the attack, and for answers after it."""


def attack_with_messages(seconds: float, seed: int) -> Report:
    """Attack every node that this process finds, for a while.

    The environment decides which ones: ``ROS_DOMAIN_ID`` and the discovery range. The robot of the system
    under attack drives where it is told: run this on simulated hardware only.

    Args:
        seconds: How long.
        seed: Of the random numbers.
    """
    import rclpy

    rclpy.init()
    try:
        return _Attack(rclpy.create_node("attacker"), random.Random(seed)).run(seconds)
    finally:
        rclpy.shutdown()


class _Attack:
    def __init__(self, node: Any, rng: random.Random) -> None:
        self._node = node
        self._rng = rng
        self._report = Report()
        self._targets: list[Callable[[], None]] = []

    def run(self, seconds: float) -> Report:
        self._spin(SETTLE_S)
        before = set(self._node.get_node_names_and_namespaces())
        self._aim()
        self._spin(SETTLE_S)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._rng.choice(self._targets)()
            self._spin(0.002)
        self._spin(SETTLE_S)
        after = set(self._node.get_node_names_and_namespaces())
        self._report.nodes_lost = sorted(f"{space.rstrip('/')}/{name}" for name, space in before - after)
        return self._report

    def _spin(self, seconds: float) -> None:
        import rclpy

        end = time.monotonic() + seconds
        while (rest := end - time.monotonic()) > 0.0:
            rclpy.spin_once(self._node, timeout_sec=rest)

    def _aim(self) -> None:
        from rclpy.action import get_action_names_and_types

        for topic, types in self._node.get_topic_names_and_types():
            if topic not in QUIET and self._node.count_subscribers(topic):
                self._targets.append(self._topic(topic, types[0]))
        for service, types in self._node.get_service_names_and_types():
            if not service.startswith(f"/{self._node.get_name()}/"):
                self._targets.append(self._service(service, types[0]))
        for action, types in get_action_names_and_types(self._node):
            self._targets.append(self._action(action, types[0]))

    def _message(self, message_type: Any) -> Any:
        if self._rng.random() < 0.3:
            return arbitrary(message_type, self._rng)
        now = self._node.get_clock().now().nanoseconds * 1e-9
        return spoilt(ordinary(message_type, now), self._rng)

    def _topic(self, topic: str, type_name: str) -> Callable[[], None]:
        from rclpy.qos import DurabilityPolicy, QoSProfile

        message_type = load_type(type_name)
        # Reliable and latched: what every kind of subscription takes.
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = self._node.create_publisher(message_type, topic, latched)

        def send() -> None:
            publisher.publish(self._message(message_type))
            self._report.sent[f"{topic} ({type_name})"] += 1

        return send

    def _service(self, service: str, type_name: str) -> Callable[[], None]:
        service_type = load_type(type_name)
        client = self._node.create_client(service_type, service)

        def send() -> None:
            if client.service_is_ready():
                client.call_async(self._message(service_type.Request))
                self._report.sent[f"{service} ({type_name})"] += 1

        return send

    def _action(self, action: str, type_name: str) -> Callable[[], None]:
        from rclpy.action import ActionClient

        action_type = load_type(type_name)
        client = ActionClient(self._node, action_type, action)

        def ended(future: Any) -> None:
            self._report.goals[f"status {future.result().status}"] += 1

        def answered(future: Any) -> None:
            handle = future.result()
            self._report.goals["accepted" if handle.accepted else "rejected"] += 1
            if handle.accepted:
                handle.get_result_async().add_done_callback(ended)

        def send() -> None:
            if client.server_is_ready():
                client.send_goal_async(self._message(action_type.Goal)).add_done_callback(answered)
                self._report.sent[f"{action} ({type_name})"] += 1

        return send
