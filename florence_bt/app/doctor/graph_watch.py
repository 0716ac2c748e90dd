"""Looks at the ROS graph for a few seconds."""

from __future__ import annotations

import time

import rclpy

from florence_bt.app.bringup.locks import bring_up_here
from florence_bt.app.doctor.graph import GraphView, is_partial
from florence_bt.app.runs.client import MISSION_SERVER
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.heard import Heard, age_text
from florence_bt.core.topic_names import CLOCK
from florence_bt.ros.arguments import start_ros
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.robot_state import BATTERY, RobotState

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
        return watch(loop, node, RobotState(node), least, most)
    finally:
        node.shut_down()
        loop.close()
        node.destroy_node()
        rclpy.try_shutdown(context=context)


def watch(loop: SpinLoop, node: FlorenceNode, state: RobotState, least: float, most: float) -> GraphView:
    """See the same from a node; the times are as those of :func:`watch_graph`."""
    battery = state.listen(BATTERY)
    state.listen_to_diagnostics()

    def view() -> GraphView:
        nodes, here = node.get_node_names_and_namespaces(), node.get_namespace()
        names = (f"{where.rstrip('/')}/{name}" for name, where in nodes if where == here and name != NAME)
        elsewhere = {where for name, where in nodes if where != here and name == MISSION_SERVER}
        told = battery.fresh
        return GraphView(
            tuple(sorted(names)),
            node.count_publishers(CLOCK),
            None if told is None else told.charge,
            {name: _said(heard) for name, heard in state.diagnoses()},
            tuple(sorted(elsewhere)),
        )

    def more_to_see(seen: GraphView) -> bool:
        return is_partial(seen) or (not seen.nodes and bring_up_here())

    begin = time.monotonic()
    while (passed := time.monotonic() - begin) < least or (passed < most and more_to_see(view())):
        loop.spin_once(0.1)
    return view()


def _said(heard: Heard[Diagnosis]) -> tuple[int, str]:
    """Return the level and the text of a diagnosis; one that is not repeated any more is stale."""
    assert heard.last is not None
    if heard.fresh is not None:
        return heard.fresh.level, heard.fresh.message
    return Severity.STALE, f"has said nothing for {age_text(heard.age)}; before that: {heard.last.message}"
