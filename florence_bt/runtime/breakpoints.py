"""Breakpoints: nodes before which a run is paused, and single steps from one leaf to the next."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator

from py_trees.behaviour import Behaviour

from florence_bt.behaviours.annotations import name_with_value
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.why import path_of
from florence_bt.trees.kinds import CallMission
from florence_bt.trees.language.compile import origin_of


class Breakpoints:
    """The breakpoints of an executor; they hold for every run until they are taken away.

    Attributes:
        names: What was asked for, in order: the name of a node, of a skill, or of a mission that is called;
            before it, after slashes, names of nodes above.
        paths: Whole paths of nodes, for a replay of a run that stood there.
        stepping: Whether the run is to be paused before the next leaf, whichever it is.
    """

    def __init__(self) -> None:
        self.names: list[str] = []
        self.paths: Collection[str] = ()
        self.stepping = False

    def add(self, names: Iterable[str]) -> None:
        """Add breakpoints; those that are there already stay."""
        self.names += dict.fromkeys(name for name in names if name not in self.names)

    def remove(self, names: Collection[str]) -> list[str]:
        """Take breakpoints away; return the names of which there were none."""
        unknown = [name for name in names if name not in self.names]
        self.names = [name for name in self.names if name not in names]
        return unknown

    def gate(self) -> Callable[[Behaviour], bool] | None:
        """Return what tells whether a run is paused before a node starts; None when it never is."""
        return self._stops_before if self.names or self.paths or self.stepping else None

    def _stops_before(self, node: Behaviour) -> bool:
        if self.stepping and not node.children:
            return True
        if self.paths and path_of(node) in self.paths:
            return True
        return any(means(name, _way_of(node)) for name in self.names)


def means(name: str, way: Iterable[Collection[str]]) -> bool:
    """Tell whether the name of a breakpoint means a node.

    Args:
        name: The name, with names of nodes above before slashes. In each ``_`` and blanks are the same.
        way: What the node is called, then what each node above it is called, up to the root.
    """
    *above, last = map(_plain, name.split("/"))
    steps = (set(map(_plain, names)) for names in way)
    if last not in next(steps):
        return False
    for names in steps:
        if above and above[-1] in names:
            above.pop()
    return not above


def _way_of(node: Behaviour) -> Iterator[set[str]]:
    at: Behaviour | None = node
    while at is not None:
        yield _names_of(at)
        at = at.parent


def _names_of(node: Behaviour) -> set[str]:
    """Return what a node is called: its name, also as people see it, its skill, the mission that it calls."""
    names = {node.name, name_with_value(node)}
    if isinstance(node, RunSkill):
        names.add(node.skill)
    origin = origin_of(node)
    if origin is not None and isinstance(origin.node, CallMission):
        names.add(origin.node.mission.text)
    return names


def _plain(name: str) -> str:
    """Return a name as it is compared."""
    return " ".join(name.replace("_", " ").lower().split())
