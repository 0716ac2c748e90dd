"""Guards go up to where a skipped node is skipped in both worlds.

In BehaviorTree.CPP *skipped* is a status: decorators hand it on, and a composite whose nodes were all skipped
is skipped too. Here a skipped node counts as success or failure at once. So the guards of a foreign node are
moved up: over decorators that turn success and failure, and over composites whose nodes all have guards.
"""

from __future__ import annotations

from typing import Any

from florence_bt.btcpp.trust import trusted_guards
from florence_bt.btcpp.vocabulary import MARK, POST_CONDITIONS
from florence_bt.btcpp.xml_source import Element
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.expressions.parser import parse_expression

Node = dict[str, Any]

TURNING = frozenset({"Inverter", "ForceSuccess", "ForceFailure", "RunOnce", "Timeout"})
"""Decorators over which a guard is moved."""
ROUNDS = frozenset({"Repeat", "RetryUntilSuccessful", "RetryUntilSuccesful", "KeepRunningUntilFailure"})
"""Decorators that ask a guard in each round; it stands above them too."""
GATHERING = frozenset(
    {
        "Sequence",
        "AsyncSequence",
        "ReactiveSequence",
        "Fallback",
        "AsyncFallback",
        "ReactiveFallback",
        "Parallel",
    }
)
"""Composites that are skipped when all their nodes are."""
_SKIPS = ("_skipIf", "_onlyIf", "_while")
_UNEVEN = "what is skipped in it is skipped there; here it counts as success or failure"
_SCRIPTS = "when what is below it is skipped its scripts are not done there; here they are"


def with_guards_above(element: Element, node: Node) -> tuple[Node, str]:
    """A converted node with the guards of the nodes below it moved up, where that is needed.

    Args:
        element: What it was.
        node: What it has become.

    Returns:
        The node, and what is different all the same (empty when nothing is).
    """
    if MARK in element.attributes or not element.children:
        return node, ""
    if element.tag in TURNING | ROUNDS:
        slot = "do" if "do" in node else next(iter(node))
        below = node[slot]
        if isinstance(below, dict) and _is_guarded(element.children[0], below):
            bare, guards = lift(below)
            different = _UNEVEN if any(map(_can_skip, _inside(element.children[0]))) else ""
            return {**node, slot: bare if element.tag in TURNING else below, **guards}, different
        if element.tag in TURNING and _can_skip(element.children[0]):
            return node, _UNEVEN
    if element.tag in GATHERING:
        nodes = next(node[kind] for kind in ("sequence", "selector", "parallel") if kind in node)
        if all(_is_guarded(child, below) for child, below in zip(element.children, nodes, strict=True)):
            when = " or ".join(f"({kept(below)})" for below in nodes)
            return ({**node, "when": when}, "") if _is_short_enough(when) else (node, _UNEVEN)
        if all(map(_can_skip, element.children)):
            return node, _UNEVEN
    scripts = any(name in element.attributes for name in POST_CONDITIONS)
    return node, _SCRIPTS if scripts and _can_skip(element) else ""


def _is_short_enough(expression: str) -> bool:
    """Whether an expression keeps the limits of a mission."""
    try:
        parse_expression(expression)
    except ConfigError:
        return False
    return True


def _inside(element: Element) -> list[Element]:
    """What can be skipped although the guard of the element itself lets it start."""
    return element.children if element.tag not in GATHERING else []


def _can_skip(element: Element) -> bool:
    """Whether a node, or what decides below it, can be skipped by a guard that is not our own."""
    waiting = [element]
    while waiting:
        one = waiting.pop()
        if one.tag != "FlorenceGuard" and any(name in one.attributes for name in _SKIPS):
            if trusted_guards(one) is None:
                return True
        elif one.tag in GATHERING:
            if MARK not in one.attributes and all(map(_can_skip, one.children)):
                return True
        else:
            waiting.extend(one.children)
    return False


def _is_guarded(element: Element, node: Node) -> bool:
    """Whether a node can be skipped by a guard that is not one of our own exports."""
    own = element.tag == "FlorenceGuard" or trusted_guards(element) is not None
    return not own and bool({"when", "unless"} & set(node))


def lift(guarded: Node) -> tuple[Node, dict[str, str]]:
    """A node without its guards, and the guards."""
    guards: dict[str, str] = {name: guarded[name] for name in ("when", "unless") if name in guarded}
    return {name: value for name, value in guarded.items() if name not in guards}, guards


def kept(node: Node) -> str:
    """What holds when a node is not skipped by its guards."""
    parts = [f"({node['when']})"] if "when" in node else []
    parts += [f"not ({node['unless']})"] if "unless" in node else []
    return " and ".join(parts)
