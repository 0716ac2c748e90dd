"""A mission as a diagram: boxes with a title, details and boxes below. ``draw`` draws it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from florence_bt.core.plain_yaml import Position
from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission, Node, PolicyKind, show


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
        below = [self.box(part, word) for part, word in zip(node.parts, _edges(node), strict=True)]
        if isinstance(node, model.CallMission):
            below += self._called(node)
        if node.cleanup is not None:
            below.append(self.box(node.cleanup, "finally"))
        details, guards = tuple(_details(node)), tuple(_guards(node))
        because = tuple(_because(node))
        return Box(node.title, _kind(node), details, tuple(below), edge, guards, because, node.position)

    def _called(self, node: model.CallMission) -> Iterator[Box]:
        name = node.mission.text
        mission = self._library.find(name) if self._library else None
        if mission is not None and mission.tree is not None and name not in self._callers:
            yield _Maker(self._library, (*self._callers, name)).box(mission.tree)


def _kind(node: Node) -> str:
    match node:
        case model.RunSkill():
            return "skill"
        case model.CallMission():
            return "run"
        case model.OnFailure():
            return "on_failure"
        case model.WaitUntil():
            return "wait_until"
        case model.Interruptible():
            return "interrupted_by"
        case kinds.ForEach() | kinds.Retry() | kinds.Condition():
            return node.kind.word
    return type(node).__name__.lower()


def _edges(node: Node) -> list[str]:
    """Return a word for the line to each part."""
    match node:
        case model.If():
            asked = ["if"] if isinstance(node.condition, Node) else []
            return [*asked, "then", *(["else"] if node.otherwise is not None else [])]
        case model.Switch(cases=cases, default=default):
            return [*(case.text for case, _ in cases), *(["default"] if default is not None else [])]
        case model.Parallel(policy=policy) if policy.kind is PolicyKind.SELECTED:
            wanted = [name.text for name in policy.names]
            return ["must succeed" if child.title in wanted else "" for child in node.children]
        case model.OnFailure(handlers=handlers):
            return ["", *(f"on {code.text}" for code, _ in handlers)]
        case model.Until():
            return ["", "until"]
        case model.Interruptible():
            return ["", "interrupted if", "then first"]
    return list(node.edges)


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
    if node.name and not isinstance(node, model.RunSkill | model.Sequence | model.Selector | model.Parallel):
        yield node.default_title
    match node:
        case model.RunSkill() | model.CallMission():
            if isinstance(node, model.RunSkill) and node.name:
                yield node.skill
            yield from (f"{name.text}: {show(value)}" for name, value in node.inputs)
            yield from (f"{output.text} -> ${key.text}" for output, key in node.outputs)
        case model.Set(values=values):
            yield from (f"${key.text} = {show(value)}" for key, value in values)
        case model.Append(values=values):
            yield from (f"${key.text} + {show(value)}" for key, value in values)
        case model.Fail(reason=reason):
            yield show(reason)
        case model.Parallel(policy=policy) if policy.kind is PolicyKind.ANY:
            yield "any one is enough"
        case model.Parallel(policy=policy) if policy.kind is PolicyKind.COUNTED:
            yield f"policy: {policy}"
        case model.Sequence(memory=False) | model.Selector(memory=False) | model.If(memory=False):
            yield "without memory"
    yield from node.details
    if node.code is not None:
        yield f"code: {node.code.text}"
