"""Composites: those of py_trees with fresh children or watched conditions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector as PyTreesSelector
from py_trees.composites import Sequence

from florence_bt.behaviours.stepping import Stepping, Steps
from florence_bt.behaviours.watching import Watch


class Selector(PyTreesSelector):
    """The selector of py_trees, whose children forget their statuses when it starts again.

    (A stock selector keeps them, so a dump would show failures of an earlier round.)
    """

    def initialise(self) -> None:
        """Reset the children."""
        reset_all(self.children)


class _Reactive(Stepping):
    """A composite without memory: all children but the last are conditions that are watched."""

    goes_on: Status
    """The status of a child after which the next one follows."""
    watches: tuple[Watch | None, ...]

    def steps(self) -> Steps:
        """Ask the conditions that must be asked, then tick the last child when they let it run."""
        if self.status is not Status.RUNNING:
            self._begin()
        for watch in self._each_watch():
            watch.look()
        status = self.goes_on
        for place, child in enumerate(self.children):
            asked = self.watches[place] if place < len(self.watches) else None
            if asked is None:
                yield child
                status = child.status
            else:
                yield from asked.steps(child)
                status = asked.answer or Status.RUNNING
            self.current_child = child
            if status is not self.goes_on:
                self._leave(place + 1)
                break
        if status is not Status.RUNNING:
            self.halt_running()
        return status

    def terminate(self, new_status: Status) -> None:
        """Stop watching."""
        for watch in self._each_watch():
            watch.end()

    @property
    def watched(self) -> tuple[Any, ...]:
        """The skills below that are asked in the background."""
        return tuple(skill for watch in self._each_watch() for skill in watch.skills)

    def _each_watch(self) -> Iterator[Watch]:
        return (watch for watch in self.watches if watch is not None)

    def _begin(self) -> None:
        self.halt_all()
        self.feedback_message = ""
        for watch in self._each_watch():
            watch.begin()

    def _leave(self, first: int) -> None:
        """Stop what comes behind the child that decides."""
        for place in range(first, len(self.children)):
            child = self.children[place]
            if child.status is not Status.INVALID:
                self.halt(child)
                watch = self.watches[place] if place < len(self.watches) else None
                if watch is not None:
                    watch.end()
                    watch.begin()


class ReactiveSequence(_Reactive, Sequence):
    """The sequence without memory: it asks its conditions again while a later child runs.

    Args:
        name: The name of the node in dumps.
        children: What is done, conditions first.
        watches: The watch of each child but the last; None: nothing need be kept, it is ticked each time.
    """

    goes_on = Status.SUCCESS

    def __init__(self, name: str, children: list[Behaviour], watches: Iterable[Watch | None]) -> None:
        Sequence.__init__(self, name, False, children)
        self.watches = tuple(watches)


class ReactiveSelector(_Reactive, PyTreesSelector):
    """The selector without memory: it asks its conditions again while a later child runs.

    Args:
        name: The name of the node in dumps.
        children: What is tried, conditions first.
        watches: The watch of each child but the last; None: nothing need be kept, it is ticked each time.
    """

    goes_on = Status.FAILURE

    def __init__(self, name: str, children: list[Behaviour], watches: Iterable[Watch | None]) -> None:
        PyTreesSelector.__init__(self, name, False, children)
        self.watches = tuple(watches)


def reset_all(children: Iterable[Behaviour]) -> None:
    """Let children forget where they stood."""
    for child in children:
        if child.status is not Status.INVALID:
            child.stop(Status.INVALID)
