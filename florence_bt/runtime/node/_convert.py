"""Plain data of the runtime to messages. Nothing is decided here."""

from __future__ import annotations

import uuid
from collections.abc import Mapping

from diagnostic_msgs.msg import KeyValue as DiagnosticValue
from florence_interfaces import msg as florence
from florence_interfaces.msg import MissionInfo, MissionPort, RunState
from py_trees_ros_interfaces.msg import Behaviour, BehaviourTree, KeyValue
from unique_identifier_msgs.msg import UUID

from florence_bt.core.declaration import Port
from florence_bt.runtime.run import MissionRun
from florence_bt.runtime.status import RUN_STATES
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.runtime.viewers.snapshot import STATUS, NodeSnapshot
from florence_bt.trees.drawings.ascii import TreeRow
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.quantities import format_value


def run_state_to_ros(run: MissionRun) -> RunState:
    """Convert the state of a run, in the document's words (REFERENCE 10)."""
    return RunState(
        run_id=run.run_id,
        mission=run.mission,
        state=RUN_STATES[run.status],
        code=run.code,
        reason=run.reason or run.paused,
    )


def run_tree_to_ros(tree: RunTree) -> florence.RunTree:
    """Convert a run with its tree for those who show it."""
    return florence.RunTree(
        run_id=tree.run_id,
        mission=tree.mission,
        state=tree.state,
        caller=tree.caller,
        seconds=-1.0 if tree.seconds is None else tree.seconds,
        notes=tree.notes,
        nodes=[_row_to_ros(row) for row in tree.nodes],
        text=tree.text,
        output_names=list(tree.outputs),
        output_values=list(tree.outputs.values()),
        why=tree.why,
        warnings=tree.warnings,
    )


def _row_to_ros(row: TreeRow) -> florence.TreeNode:
    return florence.TreeNode(
        depth=row.depth,
        status=STATUS[row.status],
        left=row.left,
        call=row.call,
        title=row.title,
        says=row.says,
        seconds=-1.0 if row.seconds is None else row.seconds,
    )


def mission_to_ros(mission: Mission, problem: str) -> MissionInfo:
    """Convert a mission as its file declares it."""
    return MissionInfo(
        name=mission.name,
        description=mission.description,
        on_restart=mission.on_restart,
        inputs=[port_to_ros(name, port) for name, port in mission.inputs.items()],
        outputs=[port_to_ros(name, port) for name, port in mission.outputs.items()],
        file=str(mission.file),
        problem=problem,
        version=mission.version,
    )


def port_to_ros(name: str, port: Port) -> MissionPort:
    """Convert an input or output; its values as texts that a caller may give."""
    return MissionPort(
        name=name,
        type=port.kind.value,
        description=port.description,
        required=port.required,
        default_value="" if port.required else format_value(port.default, port.kind),
        minimum="" if port.minimum is None else format_value(port.minimum, port.kind),
        maximum="" if port.maximum is None else format_value(port.maximum, port.kind),
    )


def snapshot_to_ros(
    nodes: tuple[NodeSnapshot, ...], values: Mapping[str, str], *, changed: bool
) -> BehaviourTree:
    """Convert a tree for the ecosystem's watchers, with the keys on the visited path and their values."""
    return BehaviourTree(
        behaviours=[_node_to_ros(node) for node in nodes],
        changed=changed,
        blackboard_on_visited_path=[DiagnosticValue(key=key, value=value) for key, value in values.items()],
    )


def _node_to_ros(node: NodeSnapshot) -> Behaviour:
    return Behaviour(
        name=node.name,
        class_name=node.class_name,
        own_id=_uuid_to_ros(node.own_id),
        parent_id=_uuid_to_ros(node.parent_id),
        tip_id=_uuid_to_ros(node.tip_id),
        child_ids=[_uuid_to_ros(child) for child in node.child_ids],
        current_child_id=_uuid_to_ros(node.current_child_id),
        type=int(node.type),
        additional_detail=node.additional_detail,
        blackbox_level=node.blackbox_level,
        status=node.status,
        message=node.message,
        is_active=node.is_active,
        blackboard_access=[KeyValue(key=key, value=how) for key, how in node.access],
    )


def _uuid_to_ros(value: uuid.UUID | None) -> UUID:
    return UUID() if value is None else UUID(uuid=list(value.bytes))
