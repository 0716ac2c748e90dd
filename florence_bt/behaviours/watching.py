"""Guards of a node without memory: the moments at which they are asked again, and what stands until then.

A *condition* is a node that a composite without memory asks while a later node runs. It is a :class:`Watch`.
The nodes below it that may change its answer, or that must not be done again for nothing, have a
:class:`Spot` each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count
from typing import Any, Protocol

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.context import TreeContext

NOWHERE = math.inf
"""A place that is behind every other one."""


class Asked(Protocol):
    """A skill that is asked in the background as long as a condition is watched."""

    used_in: int
    """The round in which it has given its answer last."""

    def look(self) -> None:
        """Ask again when it is time, and take an answer that has come."""

    def stop_watching(self) -> None:
        """Forget the answer and stop asking."""


class Watch:
    """One condition: its answer, and the first place below it where something has changed since.

    The answer is kept until something that it depends on has changed; then the condition is ticked again, and
    what stands before that place replays what it has found. While this takes time the old answer stands,
    unless an action begins to run: that takes over from the later nodes. What a condition writes itself while
    it is ticked is no change. A condition without anything to keep is ticked with every tick.

    Args:
        context: What the tree shares.
        above: The condition that this one is a part of, or None.

    Attributes:
        answer: The status that stands; None before the first answer and while an action runs.
        skills: The skills below that are asked in the background, kept by the outermost condition.
        keeps: Whether the answer is kept.
        needed: Whether something below it can make it keep its answer.
        round: Counts the questions.
    """

    def __init__(self, context: TreeContext, above: Watch | None = None) -> None:
        self.answer: Status | None = None
        self.skills: list[Asked] = []
        self.keeps = self.needed = False
        self.round = 0
        self.session = 0
        self.real_from: float = 0
        self._context = context
        self._above = above
        self.root: Watch = above.root if above is not None else self
        self.places = count()
        self._active = self._ticking = False
        self._changed: float = NOWHERE
        self._began = 0

    def keep(self) -> None:
        """Keep the answer from now on, also that of what this is a part of."""
        self.keeps = self.needed = True
        if self._above is not None:
            self._above.keep()

    def need(self) -> None:
        """Be ready to keep the answer, also that of what this is a part of."""
        self.needed = True
        if self._above is not None:
            self._above.need()

    def begin(self) -> None:
        """Begin anew, without an answer."""
        self._active = True
        self.answer = None
        self._changed = NOWHERE
        self.real_from = self._above.real_from if self._above is not None else 0
        if self._above is None:
            self.session += 1

    def end(self) -> None:
        """Stop watching; what has changed is left to what this is a part of."""
        self._active = False
        if self._above is None:
            for skill in self.skills:
                skill.stop_watching()
        elif self._changed < NOWHERE:
            self._above.change(self._changed)
        self._changed = NOWHERE

    def change(self, place: float) -> None:
        """Have it asked again: something has changed at a place."""
        if not self._active:
            if self._above is not None:
                self._above.change(place)
        elif not self._ticking:
            self._changed = min(self._changed, place)
            self._context.wake()

    def look(self) -> None:
        """Let the skills below ask and answer in the background."""
        for skill in self.skills:
            skill.look()

    def steps(self, child: Behaviour) -> Iterator[Behaviour]:
        """Yield the node that is the condition when it must be ticked, and take its answer."""
        settled = self.keeps and self.answer is not None and self._changed == NOWHERE
        if settled and child.status is not Status.RUNNING:
            return
        if child.status is not Status.RUNNING:
            self._begin_question()
        self._ticking = True
        try:
            yield child
        finally:
            self._ticking = False
        if child.status is not Status.RUNNING:
            self.answer = child.status
            self._leave_unused()
            if self._changed < NOWHERE:
                self._context.wake()
        elif not self.keeps or acts(child):
            self.answer = None

    def _begin_question(self) -> None:
        if self.answer is not None:
            self.real_from, self._changed = self._changed, NOWHERE
        if self._above is None or self.answer is not None:
            self.root.round += 1
        self._began = self.root.round

    def _leave_unused(self) -> None:
        """Stop asking what the last question did not come to."""
        for skill in self.skills:
            if skill.used_in < self._began:
                skill.stop_watching()


class Spot:
    """A place in a condition, in the order in which its nodes are done.

    Args:
        watch: The condition.
        keeps: Whether something may be kept here.
    """

    def __init__(self, watch: Watch, *, keeps: bool = True) -> None:
        self.watch = watch
        if keeps:
            watch.need()
        self._place = next(watch.root.places)
        self._kept: tuple[int, Any] | None = None

    @property
    def replays(self) -> bool:
        """Tell whether nothing has changed up to here since the last question: what was found stands."""
        return self._place < self.watch.real_from

    def change(self, *_: Any) -> None:
        """Have the condition asked again from here on."""
        self.watch.change(self._place)

    def keep(self, found: Any) -> None:
        """Keep what was found here, until the condition is watched no more."""
        self._kept = (self.watch.root.session, found)
        self.watch.keep()

    def forget(self) -> None:
        """Keep nothing."""
        self._kept = None

    def recall(self) -> Any:
        """Return what was found here when it still stands, else None."""
        if self._kept is None or not self.replays:
            return None
        session, found = self._kept
        return found if session == self.watch.root.session else None


def acts(node: Behaviour) -> bool:
    """Tell whether an action runs at or below a node that runs, and not only a question or a pause."""
    if not node.children:
        return not getattr(node, "only_asks", False)
    return any(child.status is Status.RUNNING and acts(child) for child in node.children)
