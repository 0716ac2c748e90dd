"""The tree and its keys for the tree watcher of py_trees_ros, made only while somebody watches.

The topic and the services are those that ``py_trees_ros`` offers below its node's name; our node is
``florence_bt``. Every watcher shares one topic, which tells what changed.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable

from py_trees.common import Status
from py_trees_ros_interfaces.msg import BehaviourTree
from py_trees_ros_interfaces.srv import CloseSnapshotStream, OpenSnapshotStream, ReconfigureSnapshotStream

from florence_bt.ros.latched_publisher import LatchedPublisher
from florence_bt.ros.node import FlorenceNode
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.node._convert import snapshot_to_ros
from florence_bt.runtime.run import MissionRun
from florence_bt.runtime.viewers.snapshot import NodeSnapshot, snapshot_of, statuses
from florence_bt.runtime.viewers.variables import Variables, variables_of
from florence_bt.trees.language.compile import CompiledTree


class Watching:
    """Serves ``florence_bt/snapshots`` and ``florence_bt/snapshot_streams/*``, whose stream is that topic.

    Args:
        node: The node that serves them.
        tree_now: The tree of the current run, None when nothing runs.
    """

    def __init__(self, node: FlorenceNode, tree_now: Callable[[], CompiledTree | None]) -> None:
        self._tree_now = tree_now
        self._tree: CompiledTree | None = None
        self._variables: Variables | None = None
        self._looked = False
        self._nodes: tuple[NodeSnapshot, ...] = ()
        self._shown: tuple[NodeSnapshot, ...] = ()
        self._known: dict[uuid.UUID, Status] = {}
        self._values: dict[str, str] = {}
        self._publisher = LatchedPublisher(node, BehaviourTree, "~/snapshots", on_join=self._show_to_joiner)
        node.create_service(OpenSnapshotStream, "~/snapshot_streams/open", self._on_open)
        node.create_service(
            ReconfigureSnapshotStream, "~/snapshot_streams/reconfigure", self._on_known_stream
        )
        node.create_service(CloseSnapshotStream, "~/snapshot_streams/close", self._on_known_stream)

    def on_event(self, run: MissionRun, event: RunEvent) -> None:
        """Take note of a run that began or ended."""
        if event.kind is EventKind.STARTED:
            self._tree, self._variables = self._tree_now(), None
            self._nodes, self._known, self._values = (), {}, {}
            self._looked = False
        elif event.kind is EventKind.ENDED and self._tree is not None and self._tree_now() is None:
            if self._tree.root.status is Status.INVALID and not self._nodes_are_final():
                self._look()  # it was stopped, which no tick has shown
                if self._is_wanted(self._tree, at_an_end=True):
                    self._show()
            self._tree = None

    def after_tick(self, run: MissionRun) -> None:
        """Show a tick of the current run."""
        self._looked = False
        if self._tree is None:
            return
        ended = self._tree.root.status is not Status.RUNNING
        wanted = self._is_wanted(self._tree, at_an_end=ended or run.ticks == 1)
        if wanted or ended:
            self._look()
        if wanted and self._nodes != self._shown:
            self._show()

    def _is_wanted(self, tree: CompiledTree, *, at_an_end: bool) -> bool:
        """Tell whether the topic has to show the tree.

        Without a listener only that a tree begins or has ended, so that no tree of an earlier run is latched.
        """
        return bool(self._publisher.listeners) or (self._publisher.holds and at_an_end)

    def _nodes_are_final(self) -> bool:
        return bool(self._nodes) and self._nodes[0].status in (3, 4)

    def _look(self) -> None:
        """Take note of the tree and its keys as they stand."""
        self._looked = True
        if self._tree is None:
            return
        if self._variables is None or not self._variables.complete:
            self._variables = variables_of(self._tree)
        root = self._tree.root
        self._nodes = snapshot_of(root, self._variables.accesses, self._known)
        self._known = statuses(root)
        used = self._variables.used_by(node.own_id for node in self._nodes if node.is_active)
        self._values = self._variables.values_of(used)

    def _show_to_joiner(self) -> None:
        """Show the state of the moment, unless the topic itself gives it to who has just joined."""
        if not self._looked:
            self._look()
        if self._nodes and not (self._publisher.serves_new_subscribers and self._shown is self._nodes):
            self._show()

    def _show(self) -> None:
        changed = self._nodes != self._shown
        self._publisher.publish(snapshot_to_ros(self._nodes, self._values, changed=changed))
        self._shown = self._nodes

    def _on_open(
        self, request: OpenSnapshotStream.Request, response: OpenSnapshotStream.Response
    ) -> OpenSnapshotStream.Response:
        response.topic_name = self._publisher.topic
        return response

    def _on_known_stream(
        self,
        request: ReconfigureSnapshotStream.Request | CloseSnapshotStream.Request,
        response: ReconfigureSnapshotStream.Response | CloseSnapshotStream.Response,
    ) -> ReconfigureSnapshotStream.Response | CloseSnapshotStream.Response:
        """Agree when it is about the stream that there is: it stays as it is, for the other watchers."""
        response.result = request.topic_name == self._publisher.topic
        return response
