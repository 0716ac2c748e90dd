"""A running tree as BehaviorTree.CPP writes it: XML with a number for each node, missions as subtrees."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from florence_btcpp.exporter import write_xml
from florence_btcpp.xml_source import Element

IDLE, RUNNING, SUCCESS, FAILURE = range(4)
"""Statuses of BehaviorTree.CPP (``NodeStatus``)."""
CALL = "CallMission"
"""The class of nodes that call a mission."""
NAMES = {"Selector": "Fallback", "CountingParallel": "Parallel"}
"""Our class -> what is the same there, where its name is another."""
FORGETFUL = {"Sequence": "ReactiveSequence", "Fallback": "ReactiveFallback"}
"""Names of those without memory."""


@dataclass(frozen=True, slots=True)
class WatchedNode:
    """One node at one moment.

    Attributes:
        own_id: Unlike that of every other node.
        name: Its title.
        kind: Its class.
        category: ``Action``, ``Control`` or ``Decorator``.
        remembers: Whether it has a memory.
        child_ids: The children in their order.
        status: One of :data:`IDLE` and the others.
    """

    own_id: bytes
    name: str
    kind: str
    category: str
    remembers: bool
    child_ids: tuple[bytes, ...]
    status: int

    @property
    def registration(self) -> str:
        """Its name among the kinds of nodes there."""
        if self.kind == CALL:
            return "SubTree"
        name = NAMES.get(self.kind, self.kind)
        return name if self.remembers else FORGETFUL.get(name, name)


class WatchedTree:
    """A tree, as long as nodes neither come nor go.

    Args:
        nodes: All nodes, the root first.
        numbers: Those that nodes have already.

    Attributes:
        numbers: Identity -> number, from 1 on.
        scopes: Name of a blackboard -> what stands before the last ``/`` in the names of its keys.
        xml: The tree as BehaviorTree.CPP writes it.
        tree_id: 16 bytes that are others when the tree is another.
    """

    def __init__(self, nodes: Sequence[WatchedNode], numbers: Mapping[bytes, int]) -> None:
        self._structure = _structure(nodes)
        self._by_id = {node.own_id: node for node in nodes}
        self.numbers = {**numbers}
        for node in nodes:
            self.numbers.setdefault(node.own_id, len(self.numbers) + 1)
        self.scopes: dict[str, str] = {}
        self._root = Element("root", {"BTCPP_format": "4"})
        self._add_tree(nodes[0].name, nodes[0], "", "", "")
        self._root.children.append(_models(nodes))
        self.xml = write_xml(self._root).encode()
        self.tree_id = hashlib.md5(self.xml, usedforsecurity=False).digest()

    def is_of(self, nodes: Sequence[WatchedNode]) -> bool:
        """Tell whether these are its nodes."""
        return self._structure == _structure(nodes)

    def _add_tree(self, name: str, root: WatchedNode, scope: str, path: str, below: str) -> None:
        """Add a mission; in BehaviorTree.CPP the name of the main tree is that of its blackboard, too."""
        tree = Element("BehaviorTree", {"ID": name, "_fullpath": scope.removeprefix("/")})
        self.scopes[scope.removeprefix("/") or name] = scope
        self._root.children.append(tree)
        tree.children.append(self._element(root, path, below))

    def _element(self, node: WatchedNode, path: str, below: str) -> Element:
        """Write a node.

        Args:
            node: The node.
            path: Where a mission that it calls has its keys (``florence_bt.runtime.viewers.variables``).
            below: The same for its children.
        """
        number = str(self.numbers[node.own_id])
        children = [self._by_id[each] for each in node.child_ids if each in self._by_id]
        if node.kind == CALL:
            name = node.name.removeprefix("run ")
            scope = f"{path}/{name}"
            for child in children:
                self._add_tree(name, child, scope, below, f"{below}/{child.name}")
            return Element(
                "SubTree",
                {"ID": name, "name": node.name, "_fullpath": scope.removeprefix("/"), "_uid": number},
            )
        made = Element(node.registration, {"name": node.name, "_uid": number})
        for index, child in enumerate(children):
            twins = sum(other.name == child.name for other in children[:index])
            inner = f"{below}/{twins + 1}" if twins else below
            made.children.append(self._element(child, inner, f"{inner}/{child.name}"))
        return made


def _structure(nodes: Sequence[WatchedNode]) -> list[tuple[bytes, tuple[bytes, ...]]]:
    return [(node.own_id, node.child_ids) for node in nodes]


def _models(nodes: Sequence[WatchedNode]) -> Element:
    """Say of each kind of node whether it is an action, a control or a decorator."""
    found = {node.registration: node.category for node in nodes if node.kind != CALL}
    return Element(
        "TreeNodesModel", {}, children=[Element(found[name], {"ID": name}) for name in sorted(found)]
    )
