"""Checks of the shape of a tree: recursion, size with all calls, branches that want the same resource."""

from __future__ import annotations

from collections.abc import Iterable

from florence_bt.trees import model
from florence_bt.trees._facts import Facts, reachable
from florence_bt.trees._notes import Notes
from florence_bt.trees.model import Mission, Node

MAX_NODES = 50_000
"""How many nodes a mission has at most, those of the missions that it calls counted at every call."""
MAX_TREE_DEPTH = 150
"""How many nodes stand one above the other at most, those of called missions included."""


def check_structure(mission: Mission, facts: Facts, notes: Notes) -> None:
    """Note what is wrong with the shape of a mission's tree.

    Args:
        mission: The mission.
        facts: Its surroundings.
        notes: Receives what is wrong.
    """
    _check_recursion(mission, facts, notes)
    _check_size(mission, facts, notes)
    for node in facts.of(mission).all:
        if isinstance(node, model.Parallel):
            _check_resources(node, mission, facts, notes)


def _check_recursion(mission: Mission, facts: Facts, notes: Notes) -> None:
    back = _ways_back(mission, facts)
    for call in facts.of(mission).all:
        if not isinstance(call, model.Call):
            continue
        name = call.mission.text
        if name == mission.name or name in back:
            chain = [mission.name, name]
            while chain[-1] != mission.name:
                chain.append(back[chain[-1]])
            notes.error(call.mission.position, f"the mission calls itself: {' -> '.join(chain)}")


def _ways_back(mission: Mission, facts: Facts) -> dict[str, str]:
    """Every mission that leads back to a mission, with the mission to which it goes on the shortest way."""

    def called_by(name: str) -> Iterable[str]:
        known = facts.of(mission) if name == mission.name else facts.called(name)
        return known.callees if known is not None else ()

    callers: dict[str, list[str]] = {}
    for name in (mission.name, *reachable(mission.name, called_by)):
        for called in called_by(name):
            callers.setdefault(called, []).append(name)
    return reachable(mission.name, lambda name: callers.get(name, ()))


def _check_size(mission: Mission, facts: Facts, notes: Notes) -> None:
    root = facts.of(mission).root
    if root is None or mission.tree is None:
        return
    if root.count > MAX_NODES:
        shown = str(root.count) if root.count < 10**9 else "more than a billion"
        message = (
            f"the mission has {shown} nodes with those of the missions that it calls; {MAX_NODES} can run"
        )
        notes.error(mission.tree.position, message, ["repeat: instead of writing a call many times"])
    if root.depth > MAX_TREE_DEPTH:
        message = (
            f"{root.depth} nodes stand one above the other, with those of called missions; "
            f"{MAX_TREE_DEPTH} can run"
        )
        notes.error(mission.tree.position, message, ["fewer missions that call each other"])


def _check_resources(node: model.Parallel, mission: Mission, facts: Facts, notes: Notes) -> None:
    known = facts.of(mission)
    users: dict[str, Node] = {}
    for child in node.children:
        for resource in sorted(known.of(child).resources):
            if resource in users:
                one, other = _named(users[resource], resource, facts), _named(child, resource, facts)
                message = f"{one} and {other} both need the {resource} at the same time"
                notes.error(child.position, message, ["sequence: one after the other"])
            users.setdefault(resource, child)


def _named(branch: Node, resource: str, facts: Facts) -> str:
    """A branch, with the skill or call in it that uses a resource when that is not the branch itself."""
    for node in model.walk(branch):
        uses = (
            isinstance(node, model.Use)
            and node.skill in facts.declarations
            and resource in facts.declarations[node.skill].resources
        )
        called = facts.called(node.mission.text) if isinstance(node, model.Call) else None
        if uses or (called is not None and called.root is not None and resource in called.root.resources):
            inside = f" (in {node.title!r})" if node is not branch else ""
            return f"{branch.title!r}{inside}"
    return repr(branch.title)
