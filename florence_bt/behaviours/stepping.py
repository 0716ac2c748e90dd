"""Composites that say which child comes next, and leave the ticking of it to whoever ticks them.

py_trees ticks a composite through one generator that runs through all levels of the tree. A composite that
only says which child comes next can be ticked that way and by a faster ticker, without knowing which.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Generator, Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite

Steps = Generator[Behaviour, None, Status]
"""Yields each child that must be ticked now; when it goes on, that has been done. Returns the status."""


class Stepping(Composite):
    """A composite that is written as :meth:`steps`.

    A subclass stops children with :meth:`halt`, and ends by returning a status; ``stop`` does the rest.
    """

    on_halt: Callable[[Behaviour], None] | None = None
    """Set by a ticker that wants to stop the children itself."""

    @abstractmethod
    def steps(self) -> Steps:
        """Take one tick: see :data:`Steps`."""

    def tick(self) -> Iterator[Behaviour]:
        """Tick the children one after the other, as py_trees does."""
        steps = self.steps()
        while True:
            try:
                child = next(steps)
            except StopIteration as end:
                new: Status = end.value
                break
            yield from child.tick()
        if new is not Status.RUNNING:
            self.stop(new)
        self.status = new
        yield self

    def halt(self, child: Behaviour) -> None:
        """Stop a child and everything below it, unless it stands at INVALID."""
        if child.status is Status.INVALID:
            return
        if self.on_halt is None:
            child.stop(Status.INVALID)
        else:
            self.on_halt(child)

    def halt_all(self) -> None:
        """Let all children forget where they stood."""
        for child in self.children:
            self.halt(child)

    def halt_running(self) -> None:
        """Stop the children that still run."""
        for child in self.children:
            if child.status is Status.RUNNING:
                self.halt(child)
