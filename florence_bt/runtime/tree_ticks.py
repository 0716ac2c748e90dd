"""The ticks of one tree: what changed in each, why it failed, and how long the nodes took."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.why import Why, explain, path_of, remember_failure
from florence_bt.core.clock import Clock
from florence_bt.runtime.ticking import Ticker
from florence_bt.trees.drawings.ascii import Left

MAX_TICKS_AT_ONE_MOMENT = 1000
"""A tree that wakes itself more often without time passing is broken and is failed."""


class TreeTicks:
    """Ticks a tree.

    Args:
        root: The tree.
        clock: The clock of the run: pauses do not count for the nodes.

    Attributes:
        tick: Ticks the tree once.
        count: How many ticks there were at the moment of the last one.
    """

    def __init__(self, root: Behaviour, clock: Clock) -> None:
        self._ticker = Ticker(root, record=True)
        self.tick = self._ticker.tick
        self._clock = clock
        self._times: dict[Behaviour, tuple[float, float | None]] = {}
        self._paths: dict[Behaviour, str] = {}
        self._last: dict[Behaviour, tuple[int, Left]] = {}
        self._began: dict[Behaviour, int] = {}
        self.count = 0
        self._moment = -1.0

    def note(self, now: float) -> None:
        """Count a tick at a moment of the real clock."""
        self.count = self.count + 1 if now == self._moment else 1
        self._moment = now

    def spins(self, now: float) -> bool:
        """Whether one more tick at this moment of the real clock would be too much."""
        return self.count >= MAX_TICKS_AT_ONE_MOMENT and now == self._moment

    def changes(self) -> Iterator[dict[str, str]]:
        """What the last tick changed, in order: the data of events."""
        now = self._clock.now()
        known: dict[Behaviour, Why] = {}
        for node, old, new in self._ticker.changes:
            self._note_time(node, new, now)
            why = explain(node, known) if new is Status.FAILURE else None
            if new is not Status.INVALID:
                remember_failure(node, why)
            self._note_last(node, old, new, why)
            path = self._paths.get(node)
            if path is None:
                path = self._paths[node] = path_of(node)
            change = {"node": path, "old": old.name, "new": new.name}
            if why is None:
                change["reason"] = node.feedback_message
            else:
                change.update(code=why.code, reason=why.reason, cause=why.path)
            yield change

    def left(self, node: Behaviour) -> Left | None:
        """Where a node stood that the nodes above it have left; None when they have not reached it.

        A node that begins again has not reached those below it.
        """
        last = self._last.get(node)
        if node.status is not Status.INVALID or last is None:
            return None
        tick, left = last
        above = node.parent
        while above is not None:
            if self._began.get(above, 0) > tick:
                return None
            above = above.parent
        return left

    def seconds(self, node: Behaviour) -> float | None:
        """How long a node took, or has been running; None when it was not reached."""
        if node not in self._times or (node.status is Status.INVALID and self.left(node) is None):
            return None
        began, ended = self._times[node]
        return (self._clock.now() if ended is None else ended) - began

    def _note_last(self, node: Behaviour, old: Status, new: Status, why: Why | None) -> None:
        tick = self._ticker.count
        if new is not Status.INVALID:
            self._last[node] = tick, Left(new, node.feedback_message, why)
            if old is not Status.RUNNING:
                self._began[node] = tick
        elif old is Status.RUNNING and node in self._last:
            self._last[node] = self._last[node][0], Left(old, node.feedback_message, None)

    def _note_time(self, node: Behaviour, status: Status, now: float) -> None:
        if status is Status.RUNNING:
            self._times[node] = (now, None)
            return
        began, ended = self._times.get(node, (now, None))
        if status is not Status.INVALID or ended is None:
            self._times[node] = (began if ended is None else now, now)
