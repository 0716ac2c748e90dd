"""What an incremental ticker remembers of each node: whether another tick could bring anything new.

A node is

* ``CLEAN`` when another tick would change nothing until something below it, or the node itself, is touched;
* ``TOUCHED`` when it was clean and has been touched since;
* ``OPEN`` when a tick does something each time, or when nothing is known (at first, and after a stop).
"""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappush
from typing import Any

from py_trees.behaviour import Behaviour

OPEN, TOUCHED, CLEAN = range(3)


class Record:
    """What is remembered of one node.

    Attributes:
        node: The node.
        keeper: What ticks and stops the node, passing over it while it is clean.
        state: One of the three states above.
        touched: Whether the node itself was touched since its last tick began.
        parent: The record of the parent; None for the root, and below nodes that tick their children
            themselves.
        index: The place among the children of the parent.
        pending: The indices of the children that have to be looked at again, as a heap; None for nodes that
            are no composites.
        renewed: Whether a full tick would have reset the node right before its next tick, because its parent
            starts anew. Then children that are not asked stand at INVALID afterwards.
        known: Whether ``pending``, and what else a composite remembers of its children, can be relied on.
        opaque: Whether only a tick of the node itself shows which of its children it would tick, and what it
            makes of their answers.
        low: For the others: the first child that it would tick, if something were new there.
        high: The last such child.
    """

    __slots__ = (
        "_on_touch",
        "high",
        "index",
        "keeper",
        "known",
        "low",
        "node",
        "opaque",
        "parent",
        "pending",
        "renewed",
        "state",
        "touched",
    )

    def __init__(self, node: Behaviour, on_touch: Callable[[Record], None]) -> None:
        self.node = node
        self._on_touch = on_touch
        self.opaque = True
        self.low, self.high = 0, -1
        self.keeper: Any = None
        self.state = OPEN
        self.touched = False
        self.parent: Record | None = None
        self.index = 0
        self.pending: list[int] | None = None
        self.known = False
        self.renewed = False

    def renew(self) -> None:
        """Note that the parent starts anew; a clean node would end up as it stands."""
        if self.state != CLEAN:
            self.renewed = True

    def touch(self) -> None:
        """Note that the next tick may bring something new here."""
        if not self.touched:
            self.touched = True
            self._on_touch(self)

    def open_way(self, end: Record | None = None) -> None:
        """Open the way from the root, or from below a record above this one, to this node."""
        record = self
        # A node above that is not clean has either been opened already or does not depend on this way.
        while record.state == CLEAN:
            record.state = TOUCHED
            parent = record.parent
            if parent is end or parent is None:
                return
            if parent.pending is not None:
                heappush(parent.pending, record.index)
            record = parent

    def doubt(self) -> None:
        """Rely on nothing that is remembered of this node and those above it."""
        record: Record | None = self
        while record is not None:
            record.state, record.known = OPEN, False
            record = record.parent
