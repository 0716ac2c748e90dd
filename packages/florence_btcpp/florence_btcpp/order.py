"""The order of a tree's nodes: what a node writes, only those that can follow it can read."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from florence_btcpp.xml_source import Element

CONCURRENT = frozenset(
    {
        *(
            "FlorenceParallel",
            "FlorenceUntil",
            "FlorenceInterruptible",
            "FlorenceWaitUntil",
            "Parallel",
            "ParallelAll",
            "PipelineSequence",
            "ReactiveFallback",
        ),
        *("ReactiveSequence", "WhileDoElse"),
    }
)
"""Controls that go on with several of their nodes, or come back to earlier ones."""
REPEATING = frozenset(
    {
        *("Repeat", "RetryUntilSuccessful", "RetryUntilSuccesful", "KeepRunningUntilFailure"),
        *(
            "LoopInt",
            "LoopDouble",
            "LoopString",
            "LoopBool",
            "RecoveryNode",
            "RoundRobin",
            "FlorenceRetry",
            "FlorenceForEach",
        ),
    }
)
"""Nodes that start again what is below them."""
FALLBACKS = frozenset({"Fallback", "AsyncFallback", "TryCatch", "FlorenceCatch"})
"""Controls that go on with the next node after a failure."""
_TURNING = frozenset({"Inverter", "ForceFailure", "Timeout"})
"""Nodes that can fail although what is below them succeeded."""


class Order:
    """The order of the nodes of a tree.

    Args:
        root: Its root.
    """

    def __init__(self, root: Element) -> None:
        self._above: dict[Element, Element] = {child: up for up in root.walk() for child in up.children}

    def with_parents(self, element: Element) -> Iterator[Element]:
        """Yield an element and all above it, the innermost first."""
        above: Element | None = element
        while above is not None:
            yield above
            above = self._above.get(above)

    def can_follow(self, first: Element, second: Element) -> bool:
        """Tell whether a node can follow the success of another one, which precedes it in the file."""
        path, other = list(self.with_parents(first)), list(self.with_parents(second))
        while len(path) > 1 and len(other) > 1 and path[-2] is other[-2]:
            if path.pop().tag in CONCURRENT | REPEATING or not other.pop():
                return True
        common = path[-1]
        if common is first or common is second or common.tag in CONCURRENT | REPEATING:
            return True
        places = (common.children.index(path[-2]), common.children.index(other[-2]))
        if common.tag.startswith("Switch") or (common.tag == "IfThenElse" and places[0] > 0):
            return False
        if common.tag in FALLBACKS or (common.tag == "IfThenElse" and places == (0, 2)):
            return any(self._can_fail_after(below, up) for below, up in pairwise(path[:-1]))
        return True

    @staticmethod
    def _can_fail_after(below: Element, up: Element) -> bool:
        """Tell whether a node can fail although the one below it succeeded."""
        is_last = up.children[-1] is below
        return up.tag in _TURNING or not (is_last or up.tag in FALLBACKS or up.tag.startswith("Switch"))
