"""How long the doctor looks at the ROS graph, on a clock of the test's own."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from florence_bt.app.doctor import graph_watch
from florence_bt.app.doctor.graph import GraphView, wanted_nodes


class Graph:
    """A node, its loop and the time; the nodes of a system are discovered after a while."""

    def __init__(self, in_sight_s: float) -> None:
        self.now = 0.0
        self._in_sight_s = in_sight_s
        self._hear = {}

    def spin_once(self, timeout_s):
        self.now += timeout_s
        if self.now > self._in_sight_s:
            self._hear["battery_state"](SimpleNamespace(percentage=0.5))
            self._hear["diagnostics"](
                SimpleNamespace(status=[SimpleNamespace(level=0, name="n", message="")])
            )

    def create_subscription(self, kind, topic, callback, quality):
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
    view = graph_watch._watch(graph, graph, 2.5, 15.0)
    assert graph.now == pytest.approx(ends_s, abs=0.25)
    assert bool(view.nodes) == (in_sight_s < ends_s + 0.25)
