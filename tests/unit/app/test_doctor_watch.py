"""How long the doctor looks at the ROS graph, on a clock of the test's own."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import BatteryState

from florence_bt.app.bringup.topology import DEVICE_NODES
from florence_bt.app.doctor import graph_watch
from florence_bt.app.doctor.finding import HealthLevel
from florence_bt.app.doctor.graph import GraphView, check_graph, wanted_nodes
from florence_bt.ros.robot_state import RobotState


class Graph:
    """A node, its loop and the time; the nodes of a system are discovered after a while."""

    def __init__(self, in_sight_s: float, hangs_s: float = 99.0) -> None:
        self.now = 0.0
        self.hangs_s = hangs_s
        self._in_sight_s = in_sight_s
        self._hear = {}

    def spin_once(self, timeout_s):
        self.now += timeout_s
        if self.now > self._in_sight_s:
            self._hear["battery_state"](BatteryState(percentage=0.5))
            if self.now <= self.hangs_s:
                status = [DiagnosticStatus(name=f"{name}: it", message="works") for name in DEVICE_NODES]
                self._hear["diagnostics"](DiagnosticArray(status=status))

    def steady(self):
        return self.now

    def of_stamp(self, stamp):
        return None

    def create_subscription(self, kind, topic, callback, quality, **options):
        self._hear[topic] = callback

    def get_node_names_and_namespaces(self):
        return [(name, "/") for name in wanted_nodes(GraphView())] if self.now > self._in_sight_s else []

    def get_namespace(self):
        return "/"

    def count_publishers(self, topic):
        return 0


@pytest.mark.parametrize(
    ("in_sight_s", "bring_up", "ends_s"),
    [(1.0, True, 2.5), (6.0, True, 6.0), (6.0, False, 2.5), (99.0, True, 15.0)],
)
def test_a_system_that_is_known_to_run_is_waited_for(monkeypatch, in_sight_s, bring_up, ends_s):
    graph = Graph(in_sight_s)
    monkeypatch.setattr(graph_watch.time, "monotonic", lambda: graph.now)
    monkeypatch.setattr(graph_watch, "bring_up_here", lambda: bring_up)
    view = graph_watch.watch(graph, graph, RobotState(graph, graph), 2.5, 15.0)
    assert graph.now == pytest.approx(ends_s, abs=0.25)
    assert bool(view.nodes) == (in_sight_s < ends_s + 0.25)


def test_a_driver_that_has_fallen_silent_is_a_problem_whatever_it_said_last(monkeypatch):
    graph = Graph(1.0, hangs_s=2.0)
    monkeypatch.setattr(graph_watch.time, "monotonic", lambda: graph.now)
    monkeypatch.setattr(graph_watch, "bring_up_here", lambda: False)
    view = graph_watch.watch(graph, graph, RobotState(graph, graph), 10.0, 15.0)
    found = [finding for finding in check_graph(view) if finding.group == "drivers"]
    assert [finding.level for finding in found] == [HealthLevel.PROBLEM] * len(DEVICE_NODES)
    assert {finding.found for finding in found} == {"has said nothing for 8 s; before that: works"}
