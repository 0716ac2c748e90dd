"""A mission as a diagram: boxes with a title, details and boxes below. ``draw`` draws it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from florence_bt.core.plain_yaml import Position
from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission, Node, show


@dataclass(frozen=True, slots=True)
class Box:
    """A node in a diagram.

    Attributes:
        title: The name of the node.
        kind: The kind key of the language, or ``skill``.
        details: Further lines: inputs, outputs, limits.
        below: The boxes below, first to last.
        edge: A word on the line to the box above, e.g. ``finally``.
        guards: When the node may start and go on, e.g. ``when $x < 3``.
        because: The author's words for its failures.
        position: Where its kind key stands in the file of its mission; None for a mission without a tree.
    """

    title: str
    kind: str
    details: tuple[str, ...] = ()
    below: tuple[Box, ...] = ()
    edge: str = ""
    guards: tuple[str, ...] = ()
    because: tuple[str, ...] = ()
    position: Position | None = field(default=None, compare=False)

    def walk(self) -> Iterator[Box]:
        """Yield this box and every box below."""
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
    return replace(root, title=mission.tree.name or mission.name)


class _Maker:
    def __init__(self, library: MissionLibrary | None, callers: tuple[str, ...]) -> None:
        self._library = library
        self._callers = callers

    def box(self, node: Node, edge: str = "") -> Box:
        below = [self.box(part, word) for part, word in zip(node.parts, node.edges, strict=True)]
        if isinstance(node, kinds.CallMission):
            below += self._called(node)
        if node.cleanup is not None:
            below.append(self.box(node.cleanup, "finally"))
        details, guards = tuple(_details(node)), tuple(_guards(node))
        because = tuple(_because(node))
        return Box(node.title, node.kind.word, details, tuple(below), edge, guards, because, node.position)

    def _called(self, node: kinds.CallMission) -> Iterator[Box]:
        name = node.mission.text
        mission = self._library.find(name) if self._library else None
        if mission is not None and mission.tree is not None and name not in self._callers:
            yield _Maker(self._library, (*self._callers, name)).box(mission.tree)


def _guards(node: Node) -> Iterator[str]:
    for word, guard in (("when", node.when), ("while", node.holds)):
        if guard is not None:
            yield f"{word} {guard.text}"


def _because(node: Node) -> Iterator[str]:
    if node.reasons is None:
        return
    if node.reasons.always is not None:
        yield show(node.reasons.always)
    yield from (f"{code}: {show(text)}" for code, text in node.reasons.by_code.items())


def _details(node: Node) -> Iterator[str]:
    if node.name and not isinstance(node, kinds.RunSkill | model.Composite):
        yield node.default_title
    yield from node.details
    if node.code is not None:
        yield f"code: {node.code.text}"
