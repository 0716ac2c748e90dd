"""Looks at the ROS graph for a few seconds."""

from __future__ import annotations

import math
import time
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import BatteryState

from florence_bt.app.bringup.locks import bring_up_here
from florence_bt.app.doctor.graph import GraphView, is_partial
from florence_bt.app.runs.client import MISSION_SERVER
from florence_bt.ros.arguments import start_ros
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE

NAME = "florence_doctor"


def watch_graph(least: float, most: float) -> GraphView:
    """See which nodes are there and what the drivers publish.

    Args:
        least: How long to look, in seconds; discovery and diagnostics at 1 Hz take two on an idle machine.
        most: How long to look when a part of a system has not been seen by then, or nothing although a
            bring-up goes on here.
    """
    context = rclpy.Context()
    start_ros(context)
    loop = SpinLoop(context)
    node = FlorenceNode(NAME, context=context, of_a_command=True)
    try:
        loop.add(node)
        return _watch(loop, node, least, most)
    finally:
        node.shut_down()
        loop.close()
        node.destroy_node()
        rclpy.try_shutdown(context=context)


def _watch(loop: SpinLoop, node: FlorenceNode, least: float, most: float) -> GraphView:
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

    def view() -> GraphView:
        nodes, here = node.get_node_names_and_namespaces(), node.get_namespace()
        names = (f"{where.rstrip('/')}/{name}" for name, where in nodes if where == here and name != NAME)
        elsewhere = {where for name, where in nodes if where != here and name == MISSION_SERVER}
        last = charge[-1] if charge else None
        return GraphView(
            tuple(sorted(names)),
            node.count_publishers("/clock"),
            last,
            dict(diagnostics),
            tuple(sorted(elsewhere)),
        )

    def more_to_see(seen: GraphView) -> bool:
        return is_partial(seen) or (not seen.nodes and bring_up_here())

    begin = time.monotonic()
    while (passed := time.monotonic() - begin) < least or (passed < most and more_to_see(view())):
        loop.spin_once(0.1)
    return view()
