"""The tree and its keys for the watchers of the py_trees ecosystem, made only while somebody watches.

Topics and services are those that ``py_trees_ros`` offers below its node's name; our node is ``florence_bt``.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from py_trees.common import Status
from py_trees_ros_interfaces.msg import BehaviourTree, SnapshotStreamParameters
from py_trees_ros_interfaces.srv import (
    CloseBlackboardStream,
    CloseSnapshotStream,
    GetBlackboardVariables,
    OpenBlackboardStream,
    OpenSnapshotStream,
    ReconfigureSnapshotStream,
)
from std_msgs.msg import String

from florence_bt.core.errors import ConfigError
from florence_bt.ros.latched_publisher import LatchedPublisher
from florence_bt.ros.node import FlorenceNode
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.node._convert import activity_to_ros, snapshot_to_ros, variables_to_ros
from florence_bt.runtime.node._streams import ViewerStream, ViewerStreams
from florence_bt.runtime.run import MissionRun
from florence_bt.runtime.viewers.snapshot import NodeSnapshot, snapshot_of, statuses
from florence_bt.runtime.viewers.streams import StreamParameters, checked_variables, keys_text
from florence_bt.runtime.viewers.tick_statistics import TickStatisticsWindow
from florence_bt.runtime.viewers.variables import Activity, Variables, changes, lookup, variables_of
from florence_bt.trees.language.compile import CompiledTree


@dataclass(frozen=True, slots=True)
class _Board:
    """What a watcher of keys wants: some or all (empty), on the visited path only, with what happened."""

    names: tuple[str, ...]
    visited: bool
    activity: bool


class Watching:
    """Serves ``florence_bt/snapshots``, ``florence_bt/snapshot_streams/*`` and ``blackboard_streams/*``.

    Args:
        node: The node that serves them.
        tree_now: The tree of the current run, None when nothing runs.
    """

    def __init__(self, node: FlorenceNode, tree_now: Callable[[], CompiledTree | None]) -> None:
        self._node = node
        self._tree_now = tree_now
        self._tree: CompiledTree | None = None
        self._variables: Variables | None = None
        self._ticks = TickStatisticsWindow()
        self._count = 0
        self._looked = False
        self._nodes: tuple[NodeSnapshot, ...] = ()
        self._known: dict[uuid.UUID, Status] = {}
        self._values: dict[str, Any] = {}
        self._activity: list[Activity] = []
        self._snapshots: ViewerStreams[StreamParameters] = ViewerStreams(
            node, BehaviourTree, folder="snapshot_streams", automatic="_snapshots_", show=self._show
        )
        self._boards: ViewerStreams[_Board] = ViewerStreams(
            node, String, folder="blackboard_streams", automatic="_watcher_", show=self._show_board_to_joiner
        )
        self._default: ViewerStream[StreamParameters] = ViewerStream(
            LatchedPublisher(node, BehaviourTree, "~/snapshots", on_join=lambda: self._show(self._default)),
            StreamParameters(),
        )
        self._create_services()

    def _create_services(self) -> None:
        for kind, name, callback in (
            (OpenSnapshotStream, "snapshot_streams/open", self._on_open),
            (ReconfigureSnapshotStream, "snapshot_streams/reconfigure", self._on_reconfigure),
            (CloseSnapshotStream, "snapshot_streams/close", self._snapshots.on_close),
            (GetBlackboardVariables, "blackboard_streams/get_variables", self._on_get_variables),
            (OpenBlackboardStream, "blackboard_streams/open", self._on_open_board),
            (CloseBlackboardStream, "blackboard_streams/close", self._boards.on_close),
        ):
            self._node.create_service(kind, f"~/{name}", callback)

    # ---- what happens -----------------------------------------------------------------------------------

    def on_event(self, run: MissionRun, event: RunEvent) -> None:
        """A run began or ended."""
        if event.kind is EventKind.STARTED:
            self._forget_tree()
            self._tree = self._tree_now()
        elif event.kind is EventKind.ENDED and self._tree is not None and self._tree_now() is None:
            if self._tree.root.status is Status.INVALID and not self._nodes_are_final():
                self._look()  # it was stopped, which no tick has shown
                self._show_all()
            self._tree = None

    def after_tick(self, run: MissionRun, duration: float) -> None:
        """A tick of the current run is over.

        Args:
            run: The run.
            duration: How long the tick took, seconds.
        """
        self._count = run.ticks
        self._ticks.add(self._node.timebase.now(), duration)
        if self._tree is None:
            return
        streams = len(self._snapshots) or len(self._boards)
        if streams or self._default_is_wanted(self._tree) or self._tree.root.status is not Status.RUNNING:
            self._look()
            self._show_all()
        else:
            self._looked = False

    def _default_is_wanted(self, tree: CompiledTree) -> bool:
        """Whether the default topic has to show this tick.

        Without a listener only that a tree begins or has ended, so that no tree of an earlier run is latched.
        """
        publisher = self._default.publisher
        at_an_end = self._count == 1 or tree.root.status is not Status.RUNNING
        return bool(publisher.listeners) or (publisher.holds and at_an_end)

    def _forget_tree(self) -> None:
        self._variables = None
        self._ticks = TickStatisticsWindow()
        self._count = 0
        self._nodes, self._known, self._values, self._activity = (), {}, {}, []
        self._looked = False

    def _nodes_are_final(self) -> bool:
        return bool(self._nodes) and self._nodes[0].status in (3, 4)

    def _look(self) -> None:
        """Take note of the tree and its keys as they stand."""
        self._looked = True
        if self._tree is None:
            return
        if self._variables is None:
            self._variables = variables_of(self._tree)
        root = self._tree.root
        self._nodes = snapshot_of(root, self._variables.accesses, self._known)
        self._known = statuses(root)
        values = self._variables.values()
        self._activity = changes(self._values, values, self._variables.writers)
        self._values = values

    def _show_all(self) -> None:
        if self._tree is not None and self._default_is_wanted(self._tree):
            self._show_if_due(self._default)
        # Also those that nobody listens to yet: the topic itself gives a new subscriber the last message.
        for stream in self._snapshots:
            self._show_if_due(stream)
        for board in self._boards:
            self._show_board(board)

    # ---- snapshots --------------------------------------------------------------------------------------

    def _show_if_due(self, stream: ViewerStream[StreamParameters]) -> None:
        since = self._node.steady.now() - stream.shown_at
        if stream.wanted.due(changed=self._nodes != stream.shown, since_last=since):
            self._publish(stream)

    def _show(self, stream: ViewerStream[StreamParameters]) -> None:
        """Somebody has begun to watch: the state of the moment."""
        if not self._looked:
            self._look()
        if self._nodes and not (stream.publisher.serves_new_subscribers and stream.shown is self._nodes):
            self._publish(stream)

    def _publish(self, stream: ViewerStream[StreamParameters]) -> None:
        changed = self._nodes != stream.shown
        statistics = self._node.stamped(self._ticks.as_of(self._count))
        message = snapshot_to_ros(self._nodes, changed=changed, statistics=statistics)
        if stream.wanted.data and self._variables is not None:
            names = self._variables.used_by(node.own_id for node in self._nodes if node.is_active)
            message.blackboard_on_visited_path = variables_to_ros(
                {name: lookup(self._values, name) for name in names}
            )
        if stream.wanted.activity:
            message.blackboard_activity = activity_to_ros(self._activity)
        stream.publisher.publish(message)
        stream.shown = self._nodes
        stream.shown_at = self._node.steady.now()

    def _on_open(
        self, request: OpenSnapshotStream.Request, response: OpenSnapshotStream.Response
    ) -> OpenSnapshotStream.Response:
        try:
            response.topic_name = self._snapshots.open(request.topic_name, _parameters(request.parameters))
        except ConfigError as error:
            # The answer has no field for a reason; an empty topic says that there is none.
            self._node.get_logger().warning(f"snapshot stream refused: {error}")
        return response

    def _on_reconfigure(
        self, request: ReconfigureSnapshotStream.Request, response: ReconfigureSnapshotStream.Response
    ) -> ReconfigureSnapshotStream.Response:
        stream = self._snapshots.find(request.topic_name)
        try:
            parameters = _parameters(request.parameters)
        except ConfigError as error:
            self._node.get_logger().warning(f"snapshot stream not changed: {error}")
            return response
        if stream is not None:
            stream.wanted = parameters
        response.result = stream is not None
        return response

    # ---- keys -------------------------------------------------------------------------------------------

    def _on_get_variables(
        self, request: GetBlackboardVariables.Request, response: GetBlackboardVariables.Response
    ) -> GetBlackboardVariables.Response:
        if not self._looked:
            self._look()
        response.variables = self._variables.names() if self._variables is not None else []
        return response

    def _on_open_board(
        self, request: OpenBlackboardStream.Request, response: OpenBlackboardStream.Response
    ) -> OpenBlackboardStream.Response:
        try:
            names = checked_variables(request.variables)
            board = _Board(names, request.filter_on_visited_path, request.with_activity_stream)
            response.topic = self._boards.open("", board)
        except ConfigError as error:
            self._node.get_logger().warning(f"blackboard stream refused: {error}")
        return response

    def _show_board_to_joiner(self, stream: ViewerStream[_Board]) -> None:
        """Somebody has begun to watch: the blackboard watcher does not ask for what was published earlier."""
        self._show_board(stream, joined=not stream.publisher.serves_new_subscribers)

    def _show_board(self, stream: ViewerStream[_Board], *, joined: bool = False) -> None:
        if not self._looked:
            self._look()
        if self._variables is None:
            return
        names = self._names_of(stream.wanted, self._variables, self._values)
        shown = {name: lookup(self._values, name) for name in names}
        if shown == stream.shown and not joined:
            return
        activity = [item for item in self._activity if item.key in names] if stream.wanted.activity else None
        stream.publisher.publish(String(data=keys_text(self._values, names, activity)))
        stream.shown = shown

    def _names_of(self, board: _Board, variables: Variables, values: Mapping[str, Any]) -> list[str]:
        names = list(board.names or values)
        if not board.visited:
            return names
        visited = variables.used_by(node.own_id for node in self._nodes if node.is_active)
        return [name for name in names if name.partition(".")[0] in visited]


def _parameters(message: SnapshotStreamParameters) -> StreamParameters:
    return StreamParameters(message.snapshot_period, message.blackboard_data, message.blackboard_activity)
