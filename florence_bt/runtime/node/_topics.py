"""Topics of the mission server, latched: the tree as text and as nodes, and the state of the runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from florence_interfaces.msg import RunState
from florence_interfaces.msg import RunTree as RunTreeMsg
from std_msgs.msg import String

from florence_bt.core.clock import Timer
from florence_bt.core.topic_names import RUN_STATE, RUN_TREE, TREE
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.node._convert import run_state_to_ros, run_tree_to_ros
from florence_bt.runtime.run import MissionRun
from florence_bt.runtime.status import run_tree
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.trees.drawings.ascii import draw_rows
from florence_bt.trees.drawings.folding import fold_calls

TREE_PERIOD_S = 0.05
"""The least time between two trees, steady: people read them, and drawing one takes longer than a tick."""


class RunTopics:
    """Publishes ``florence_bt/tree``, ``florence_bt/run_tree`` and ``florence_bt/run_state``.

    Args:
        node: The node that publishes.
        missions: The executor whose runs are published.
        on_tree: Called with the run, its tip and its tree whenever the tree reads differently.
        warnings: Gives what people should know beside the run.
    """

    def __init__(
        self,
        node: FlorenceNode,
        missions: Executor,
        on_tree: Callable[[MissionRun, str, str], None],
        warnings: Callable[[], Iterable[str]],
    ) -> None:
        self._warnings = warnings
        self._node = node
        self._missions = missions
        self._on_tree = on_tree
        self._tree = node.create_publisher(String, TREE, LATCHED)
        self._run_tree = node.create_publisher(RunTreeMsg, RUN_TREE, LATCHED)
        self._state = node.create_publisher(RunState, RUN_STATE, LATCHED)
        self._published = ""
        self._next = 0.0
        self._later: Timer | None = None
        self._state.publish(RunState(state="IDLE"))

    def after_tick(self, run: MissionRun) -> None:
        """Publish the tree, which may read differently, now, or soon if that was done a moment ago."""
        now = self._node.steady.now()
        if now >= self._next:
            self._publish_tree(run)
        elif self._later is None:
            self._later = self._node.steady.call_at(self._next, self._publish_later)

    def on_event(self, run: MissionRun, event: RunEvent) -> None:
        """Publish what happened to a run."""
        current = self._missions.current
        if event.kind in _QUEUE_EVENTS and current is not None and current is not run:
            # A run that waits; the last message is about the one that runs.
            self._state.publish(run_state_to_ros(run))
            self._state.publish(run_state_to_ros(current))
        elif event.kind is EventKind.STARTED:
            self._published = ""
            self._state.publish(run_state_to_ros(run))
        elif event.kind in (EventKind.PAUSED, EventKind.RESUMED):
            self._state.publish(run_state_to_ros(run))
            self._publish_tree(run)
        elif event.kind is EventKind.ENDED:
            self._forget_later()
            self._state.publish(run_state_to_ros(run))
            shown = self._shown(run)
            self._publish(shown, draw_rows(fold_calls(shown.nodes)) or run.tree)

    def _publish_later(self) -> None:
        self._later = None
        current = self._missions.current
        if current is not None:
            self._publish_tree(current)

    def _publish_tree(self, run: MissionRun) -> None:
        self._forget_later()
        self._next = self._node.steady.now() + TREE_PERIOD_S
        shown = self._shown(run)
        tree = draw_rows(fold_calls(shown.nodes))
        if tree == self._published and not run.paused:
            return
        self._published = tree
        self._publish(shown, tree)
        self._on_tree(run, self._missions.tip(), tree)

    def _shown(self, run: MissionRun) -> RunTree:
        return run_tree(run, self._node.timebase.now(), nodes=self._missions.nodes_of(run))

    def _publish(self, shown: RunTree, tree: str) -> None:
        self._tree.publish(String(data=shown.text_with(tree)))
        self._run_tree.publish(run_tree_to_ros(replace(shown, warnings=tuple(self._warnings()))))

    def _forget_later(self) -> None:
        if self._later is not None:
            self._later.cancel()
            self._later = None


_QUEUE_EVENTS = (EventKind.QUEUED, EventKind.ENDED)
