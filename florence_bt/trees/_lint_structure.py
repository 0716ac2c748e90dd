"""Checks of the shape of a tree: recursion, codes that cannot come, branches that want the same resource."""

from __future__ import annotations

from florence_bt.core.errors import closest_first
from florence_bt.trees import model
from florence_bt.trees._facts import Facts
from florence_bt.trees._notes import Notes
from florence_bt.trees.model import Mission


def check_structure(mission: Mission, facts: Facts, notes: Notes) -> None:
    """Note what is wrong with the shape of a mission's tree.

    Args:
        mission: The mission.
        facts: Its surroundings.
        notes: Receives what is wrong.
    """
    _check_recursion(mission, facts, notes)
    for node in mission.nodes():
        if isinstance(node, model.Retry):
            _check_codes(node, facts, notes)
        if isinstance(node, model.Parallel):
            _check_resources(node, facts, notes)
        if node.reasons is not None:
            can_come = facts.codes(node)
            if not facts.all_known(node):
                continue
            for code in node.reasons.by_code:
                if code not in can_come:
                    message = f"because: {node.title!r} cannot fail with {code!r}"
                    notes.warning(node.reasons.position, message, closest_first(code, can_come))


def _check_recursion(mission: Mission, facts: Facts, notes: Notes) -> None:
    for call in facts.calls(mission):
        chain = _way_back(call.mission.text, mission.name, facts, ())
        if chain is not None:
            way = " -> ".join((mission.name, *chain))
            notes.error(call.mission.position, f"the mission calls itself: {way}")


def _way_back(start: str, goal: str, facts: Facts, seen: tuple[str, ...]) -> tuple[str, ...] | None:
    if start == goal:
        return (goal,)
    called = facts.library.find(start)
    if called is None or start in seen:
        return None
    for call in facts.calls(called):
        rest = _way_back(call.mission.text, goal, facts, (*seen, start))
        if rest is not None:
            return (start, *rest)
    return None


def _check_codes(node: model.Retry, facts: Facts, notes: Notes) -> None:
    if not facts.all_known(node.child):
        return
    can_come = facts.codes(node.child)
    for code in node.on:
        if code.text not in can_come:
            message = f"what is retried cannot fail with {code.text!r}"
            notes.error(code.position, message, closest_first(code.text, can_come))


def _check_resources(node: model.Parallel, facts: Facts, notes: Notes) -> None:
    users: dict[str, str] = {}
    for child in node.children:
        for resource in sorted(facts.resources(child)):
            if resource in users:
                message = f"{users[resource]!r} and {child.title!r} both need the {resource} at the same time"
                notes.error(child.position, message, ["sequence: one after the other"])
            users.setdefault(resource, child.title)
