"""Runs and their trees as the mission server tells them, as values."""

from __future__ import annotations

from florence_interfaces import msg as florence

from florence_bt.ros.validation import BadMessage, problem_with
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.runtime.viewers.snapshot import STATUS
from florence_bt.trees.drawings.ascii import TreeRow

_STATUSES = {number: status for status, number in STATUS.items()}


def run_tree_from_ros(message: florence.RunTree) -> RunTree:
    """Convert a run with its tree.

    Raises:
        BadMessage: There is no such run, as of a mission server of another version.
    """
    problem = problem_with(message)
    if problem is not None:
        raise BadMessage(f"the tree of the run cannot be read: {problem}", "a mission server of this version")
    return RunTree(
        run_id=message.run_id,
        mission=message.mission,
        state=message.state,
        caller=message.caller,
        seconds=message.seconds if message.seconds >= 0.0 else None,
        notes=tuple(message.notes),
        nodes=tuple(map(_row_from_ros, message.nodes)),
        text=message.text,
        outputs=dict(zip(message.output_names, message.output_values, strict=False)),
        why=message.why,
        warnings=tuple(message.warnings),
    )


def _row_from_ros(node: florence.TreeNode) -> TreeRow:
    seconds = node.seconds if node.seconds >= 0.0 else None
    return TreeRow(node.depth, _STATUSES[node.status], node.title, node.says, seconds, node.left, node.call)
