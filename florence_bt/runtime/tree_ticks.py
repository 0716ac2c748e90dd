"""The ticks of one tree: what changed in each, why it failed, and how long the nodes took."""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.why import Why, explain, path_of, remember_failure
from florence_bt.core.clock import Clock
from florence_bt.runtime.ticking import Ticker

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
        self._ticker = Ticker(root, record=True, incremental=True)
        self.tick = self._ticker.tick
        self._clock = clock
        self._times: dict[Behaviour, tuple[float, float | None]] = {}
        self._paths: dict[Behaviour, str] = {}
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
            path = self._paths.get(node)
            if path is None:
                path = self._paths[node] = path_of(node)
            change = {"node": path, "old": old.name, "new": new.name}
            if why is None:
                change["reason"] = node.feedback_message
            else:
                change.update(code=why.code, reason=why.reason, cause=why.path)
            yield change

    def seconds(self, node: Behaviour) -> float | None:
        """How long a node took, or has been running; None when it was not reached."""
        if node.status is Status.INVALID or node not in self._times:
            return None
        began, ended = self._times[node]
        return (self._clock.now() if ended is None else ended) - began

    def _note_time(self, node: Behaviour, status: Status, now: float) -> None:
        if status is Status.RUNNING:
            self._times[node] = (now, None)
        elif status is not Status.INVALID:
            began, ended = self._times.get(node, (now, None))
            self._times[node] = (began if ended is None else now, now)
