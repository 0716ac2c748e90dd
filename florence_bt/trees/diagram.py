"""A mission as a diagram: boxes with a title, details and boxes below. ``draw`` draws it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from florence_bt.trees import model
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.model import Mission, Node, show


@dataclass(frozen=True, slots=True)
class Box:
    """A node in a diagram.

    Attributes:
        title: The name of the node.
        kind: The kind key of the language, or ``skill``.
        details: Further lines: inputs, outputs, limits.
        below: The boxes below, top to bottom.
        edge: A word on the line to the box above, e.g. ``finally``.
    """

    title: str
    kind: str
    details: tuple[str, ...] = ()
    below: tuple[Box, ...] = ()
    edge: str = ""

    def walk(self) -> Iterator[Box]:
        """This box and every box below."""
        yield self
        for box in self.below:
            yield from box.walk()


def diagram_of(mission: Mission, library: MissionLibrary | None = None, *, expand: bool = False) -> Box:
    """Make the diagram of a mission.

    Args:
        mission: The mission.
        library: Where called missions are found when they are expanded.
        expand: Whether to draw the trees of called missions below their calls.

    Returns:
        The box of the root; a mission without a tree is a single box.
    """
    if mission.tree is None:
        return Box(mission.name, "sequence", ("no tree",))
    root = _Maker(library if expand else None, (mission.name,)).box(mission.tree)
    title = mission.tree.name or mission.name
    return Box(title, root.kind, root.details, root.below)


class _Maker:
    def __init__(self, library: MissionLibrary | None, callers: tuple[str, ...]) -> None:
        self._library = library
        self._callers = callers

    def box(self, node: Node, edge: str = "") -> Box:
        below = [self.box(part) for part in node.parts]
        if isinstance(node, model.Call):
            below += self._called(node)
        if node.cleanup is not None:
            below.append(self.box(node.cleanup, "finally"))
        return Box(node.title, _kind(node), tuple(_details(node)), tuple(below), edge)

    def _called(self, node: model.Call) -> Iterator[Box]:
        name = node.mission.text
        mission = self._library.find(name) if self._library else None
        if mission is not None and mission.tree is not None and name not in self._callers:
            yield _Maker(self._library, (*self._callers, name)).box(mission.tree)


def _kind(node: Node) -> str:
    match node:
        case model.Use():
            return "skill"
        case model.Call():
            return "run"
        case _:
            return type(node).__name__.lower()


def _details(node: Node) -> Iterator[str]:
    match node:
        case model.Use() | model.Call():
            if isinstance(node, model.Use) and node.name:
                yield node.skill
            yield from (f"{name.text}: {show(value)}" for name, value in node.inputs)
            yield from (f"{output.text} -> ${key.text}" for output, key in node.outputs)
        case model.Set(values=values):
            yield from (f"${key.text} = {show(value)}" for key, value in values)
        case model.Retry(on=on, attempt_key=key):
            if node.name:
                yield node.default_title
            if on:
                yield "on " + ", ".join(code.text for code in on)
            if key is not None:
                yield f"attempt -> ${key.text}"
        case model.Fail(reason=reason):
            yield show(reason)
        case model.Parallel(any_is_enough=True):
            yield "any one is enough"
        case model.Sequence(memory=False) | model.Selector(memory=False):
            yield "without memory"
        case model.Repeat() | model.Timeout() | model.Wait() if node.name:
            yield node.default_title
