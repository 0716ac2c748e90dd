"""Hears what a running system publishes, with plain rclpy, to be compared with a recording of it."""

from __future__ import annotations

import threading
from collections import Counter
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.highlevel import AnyReader

from florence_bt.app.recording.node import INTAKE
from florence_bt.core.interfaces import load_interface

LOOK_S = 1.0
DEPTH = 1000
OF_STARTING_PROCESSES = {"/parameter_events"}
"""A process publishes on these as it starts: who has not found it by then hears nothing."""


class HeardTopics:
    """Counts every message of the topics that a recorder hears; a context manager.

    Topics on which processes publish as they start are left out.

    Attributes:
        messages: (topic, serialised message) -> how often it came.
        reliable: Topics of which none may be lost on the way.
    """

    def __init__(self) -> None:
        self.messages: Counter[tuple[str, bytes]] = Counter()
        self.reliable: set[str] = set()
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node("listener", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._topics: set[str] = set()
        self._node.create_timer(LOOK_S, self._look)
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self) -> HeardTopics:
        """Begin."""
        self._thread.start()
        return self

    def __exit__(self, *details: object) -> None:
        """End."""
        self._ending.set()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)

    def _serve(self) -> None:
        while not self._ending.is_set():
            self._executor.spin_once(0.1)

    def _look(self) -> None:
        for name, (type_name, *_) in self._node.get_topic_names_and_types():
            heard_by = {each.node_name for each in self._node.get_subscriptions_info_by_topic(name)}
            offers = [each.qos_profile for each in self._node.get_publishers_info_by_topic(name)]
            if name in self._topics | OF_STARTING_PROCESSES or INTAKE not in heard_by or not offers:
                continue
            reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offers)
            qos = QoSProfile(
                depth=DEPTH,
                reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
                durability=DurabilityPolicy.VOLATILE,
            )
            self._topics.add(name)
            if reliable:
                self.reliable.add(name)
            count = lambda data, name=name: self.messages.update([(name, bytes(data))])  # noqa: E731
            self._node.create_subscription(load_interface(type_name), name, count, qos, raw=True)


def recorded_in(file: Path) -> Counter[tuple[str, bytes]]:
    """Return what a recording holds: (topic, serialised message) -> how often."""
    with AnyReader([file]) as reader:
        return Counter((connection.topic, bytes(data)) for connection, _, data in reader.messages())
