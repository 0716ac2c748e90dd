"""The one door to private parts of rclpy 7.1 (ROS 2 Jazzy), for what its interface has no way to do.

Two classes reach deeper because they extend classes of rclpy: the server of
:mod:`florence_bt.ros.action_server` and the subscription without callback of
:mod:`florence_bt.ros.action_client`.
"""

from __future__ import annotations

import sys
import time
from typing import Any

from rclpy.clock import Clock as RclClock
from rclpy.clock import ClockType
from rclpy.impl.rcutils_logger import Throttle
from rclpy.node import Node
from rclpy.service import Service
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMessage


def load_no_generator() -> None:
    """Keep the generator of message classes out of this process, and the parser of IDL that it loads (40 ms).

    Every message class imports ``rosidl_generator_py`` for another function; that package goes on without its
    generator, as where that is not installed. Call it before the first node is made.
    """
    sys.modules.setdefault("rosidl_generator_py.generate_py_impl", None)  # type: ignore[arg-type]


def leave_clock_topic(node: Node) -> bool:
    """End a node's own subscription to ``/clock``; False when it has none because it is on the wall clock."""
    source: Any = node._time_source
    if source._clock_sub is None:
        return False
    node.destroy_subscription(source._clock_sub)
    source._clock_sub = None
    return True


def join_clock_topic(node: Node) -> None:
    """Let a node on simulated time subscribe to ``/clock`` by itself again."""
    source: Any = node._time_source
    if source.ros_time_is_active:
        source._subscribe_to_clock_topic()


def start_time(node: Node, now: Time) -> None:
    """Give a node its first simulated time, as its own subscription would."""
    source: Any = node._time_source
    source.clock_callback(ClockMessage(clock=now.to_msg()))


def set_time(node: Node, now: Time) -> None:
    """Set the simulated time of a node; ``get_clock`` of ours would ask for the time first."""
    clock: Any = node._clock
    clock.set_ros_time_override(now)


class _LogClock(RclClock):
    """The steady clock of a machine that is up for a year more: for rclpy, the last line came at zero."""

    def now(self) -> Time:
        return Time(nanoseconds=time.monotonic_ns() + _A_YEAR_NS, clock_type=ClockType.STEADY_TIME)


_A_YEAR_NS = 365 * 86_400 * 1_000_000_000


def throttle_logs_by_steady_time() -> None:
    """Have ``throttle_duration_sec`` count steady time: no line would come until a clock has caught up."""
    Throttle.params["throttle_time_source_type"] = _LogClock(clock_type=ClockType.STEADY_TIME)


def forget(node: Node, service: Service) -> None:
    """Take a service from what the node's executor serves, without destroying it yet."""
    services: Any = node._services
    services.remove(service)
    wake: Any = node._wake_executor
    wake()
