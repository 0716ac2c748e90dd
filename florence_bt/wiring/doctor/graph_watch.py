"""Looks at the ROS graph for a few seconds."""

from __future__ import annotations

import math
import time
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import BatteryState

from florence_bt.ros.environment import stay_on_this_machine
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE
from florence_bt.wiring.doctor.graph import GraphView

NAME = "florence_doctor"


def watch_graph(seconds: float) -> GraphView:
    """See who is there and what the drivers say.

    Args:
        seconds: How long to look; discovery and diagnostics at 1 Hz take two.
    """
    stay_on_this_machine()
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    loop = SpinLoop(context)
    node = FlorenceNode(NAME, context=context)
    try:
        loop.add(node)
        return _watch(loop, node, seconds)
    finally:
        node.shut_down()
        loop.close()
        node.destroy_node()
        rclpy.try_shutdown(context=context)


def _watch(loop: SpinLoop, node: FlorenceNode, seconds: float) -> GraphView:
    diagnostics: dict[str, tuple[int, str]] = {}
    charge: list[float] = []

    def on_diagnostics(message: Any) -> None:
        for status in message.status:
            level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
            diagnostics[status.name] = (level, status.message)

    def on_battery(message: Any) -> None:
        if math.isfinite(message.percentage):
            charge.append(float(message.percentage))

    node.create_subscription(DiagnosticArray, "diagnostics", on_diagnostics, RELIABLE)
    node.create_subscription(BatteryState, "battery_state", on_battery, RELIABLE)
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        loop.spin_once(min(left, 0.1))
    names = [
        f"{namespace.rstrip('/')}/{name}"
        for name, namespace in node.get_node_names_and_namespaces()
        if name != NAME
    ]
    return GraphView(
        tuple(sorted(names)), node.count_publishers("/clock"), charge[-1] if charge else None, diagnostics
    )
