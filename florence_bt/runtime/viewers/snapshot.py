"""A running tree as plain data, as the watchers of the py_trees ecosystem want to see it. No ROS in here.

The fields and their values are those of ``py_trees_ros_interfaces`` (``florence_bt.runtime.node`` fills its
messages from this data). What py_trees keeps in one global blackboard are here the keys of the mission and of
each mission that it calls; see :mod:`florence_bt.runtime.viewers.variables`.
"""

from __future__ import annotations

import enum
import uuid
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from py_trees.behaviour import Behaviour
from py_trees.common import BlackBoxLevel, Status
from py_trees.composites import Composite, Parallel, Selector, Sequence
from py_trees.decorators import Decorator

from florence_bt.behaviours.cleaning_up import Finally
from florence_bt.behaviours.looping import ForEach, Loop
from florence_bt.behaviours.parallel import CountingParallel

WITH_MEMORY = "WithMemory"


class NodeType(enum.IntEnum):
    """The types of nodes, for a watcher that draws them."""

    BEHAVIOUR = 1
    SEQUENCE = 2
    SELECTOR = 3
    PARALLEL = 4
    DECORATOR = 6


STATUS: Mapping[Status, int] = {
    Status.INVALID: 1,
    Status.RUNNING: 2,
    Status.SUCCESS: 3,
    Status.FAILURE: 4,
}
LEVEL: Mapping[BlackBoxLevel, int] = {
    BlackBoxLevel.DETAIL: 1,
    BlackBoxLevel.COMPONENT: 2,
    BlackBoxLevel.BIG_PICTURE: 3,
    BlackBoxLevel.NOT_A_BLACKBOX: 4,
}


@dataclass(frozen=True, slots=True)
class NodeSnapshot:
    """One node at one moment.

    Attributes:
        name: Its name.
        class_name: Module and class.
        own_id: Unlike that of every other node.
        parent_id: None for the root.
        tip_id: The node below that decided last; None for a leaf and for a node that was not reached.
        child_ids: The children in their order.
        current_child_id: The current child of a composite.
        type: What it is.
        additional_detail: ``WithMemory``, or the policy of a parallel.
        blackbox_level: How far a drawing may fold it.
        status: One of :data:`STATUS`.
        message: What it says about itself.
        is_active: Whether it lies on the path that the last tick went.
        access: (key, ``r`` or ``w``) for every key that it reads or writes.
    """

    name: str
    class_name: str
    own_id: uuid.UUID
    parent_id: uuid.UUID | None
    tip_id: uuid.UUID | None
    child_ids: tuple[uuid.UUID, ...]
    current_child_id: uuid.UUID | None
    type: NodeType
    additional_detail: str
    blackbox_level: int
    status: int
    message: str
    is_active: bool
    access: tuple[tuple[str, str], ...] = ()


Accesses = Mapping[uuid.UUID, tuple[tuple[str, str], ...]]
"""Node id -> the keys that the node reads and writes."""


def snapshot_of(
    root: Behaviour, accesses: Accesses, before: Mapping[uuid.UUID, Status]
) -> tuple[NodeSnapshot, ...]:
    """Look at a tree that was just ticked.

    Args:
        root: The tree.
        accesses: The keys that each node uses, by node id.
        before: The statuses that the watcher knows, by node id: what changed since lies on the path that was
            ticked, also below a composite with memory, which does not ask finished children again.

    Returns:
        Every node, parents before their children.
    """
    active = set(active_nodes(root, before))
    return tuple(_node(node, node.id in active, accesses) for node in _parents_first(root))


def active_nodes(root: Behaviour, before: Mapping[uuid.UUID, Status]) -> Iterator[uuid.UUID]:
    """Yield the nodes on the path that the last tick went."""
    if root.status is Status.INVALID:
        return
    yield root.id
    remembers = isinstance(root, (Sequence, Selector)) and root.memory
    for child in root.children:
        news = child.status is Status.RUNNING or before.get(child.id, Status.INVALID) is not child.status
        if news or not remembers:
            yield from active_nodes(child, before)


def statuses(root: Behaviour) -> dict[uuid.UUID, Status]:
    """Return the status of every node by its id, for the next :func:`snapshot_of`."""
    return {node.id: node.status for node in _parents_first(root)}


def type_of(node: Behaviour) -> NodeType:
    """Return what a node is drawn as.

    A watcher rebuilds the tree from its own classes and knows five. Composites of ours that choose among
    their children are selectors to it, those that do one after the other are sequences.
    """
    if isinstance(node, (Parallel, CountingParallel)):
        return NodeType.PARALLEL
    if isinstance(node, (Sequence, Finally)):
        return NodeType.SEQUENCE
    if isinstance(node, Selector):
        return NodeType.SELECTOR
    if isinstance(node, (Decorator, Loop, ForEach)) and len(node.children) == 1:
        return NodeType.DECORATOR
    return NodeType.SELECTOR if isinstance(node, Composite) else NodeType.BEHAVIOUR


def detail_of(node: Behaviour) -> str:
    """Return the detail that a watcher shows beside the type."""
    if isinstance(node, Parallel):
        return type(node.policy).__name__.removeprefix("Success")
    if isinstance(node, CountingParallel) and node.wanted is not None:
        return f"OnSelected({', '.join(str(node.children.index(child)) for child in node.wanted)})"
    if isinstance(node, CountingParallel):
        limit = "" if node.fail is None else f", Fail({node.fail})"
        return f"Succeed({node.succeed}){limit}"
    remembers = isinstance(node, (Sequence, Selector)) and node.memory
    return WITH_MEMORY if remembers else ""


def _node(node: Behaviour, active: bool, accesses: Accesses) -> NodeSnapshot:
    tip = node.tip()
    current = getattr(node, "current_child", None) if isinstance(node, Composite) else None
    return NodeSnapshot(
        name=node.name,
        class_name=f"{type(node).__module__}.{type(node).__name__}",
        own_id=node.id,
        parent_id=node.parent.id if node.parent is not None else None,
        tip_id=tip.id if tip is not None and tip is not node else None,
        child_ids=tuple(child.id for child in node.children),
        current_child_id=current.id if current is not None else None,
        type=type_of(node),
        additional_detail=detail_of(node),
        blackbox_level=LEVEL[node.blackbox_level],
        status=STATUS[node.status],
        message=node.feedback_message,
        is_active=active,
        access=accesses.get(node.id, ()),
    )


def _parents_first(root: Behaviour) -> Iterator[Behaviour]:
    yield root
    for child in root.children:
        yield from _parents_first(child)
