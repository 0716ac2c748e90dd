"""Checks keys that branches of a parallel write at the same time: the value is that of whoever comes last."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.model import Literal, Mission, Node, Value


@dataclass(frozen=True, slots=True)
class _Write:
    """A node that writes a key which is not its own.

    Attributes:
        node: The node.
        key: The key, where it is written.
        begins: Whether its branch begins with it.
        ends: Whether its branch ends with it.
    """

    node: Node
    key: Literal
    begins: bool
    ends: bool

    @property
    def same(self) -> object:
        """Return what is equal for writers of which it does not matter who comes last."""
        match self.node:
            case kinds.Append():
                return "added"  # nothing of another one is lost
            case kinds.Set(values=values):
                value = next(value for key, value in values if key.text == self.key.text)
                return ("set", value.text) if isinstance(value, Literal) else self.node
        return self.node


def check_races(mission: Mission, analysis: Analysis, findings: FindingList) -> None:
    """Report keys that two branches of a parallel write and something reads.

    Names of loops, and the failure under ``on_failure``, belong to what stands there.

    Args:
        mission: The mission.
        analysis: Its surroundings.
        findings: Receives what is wrong.
    """
    if mission.tree is None:
        return
    read = {*mission.outputs, *_read(mission.tree, frozenset())}
    known = analysis.of(mission).kinds

    def writes(node: Node) -> Iterator[Literal]:
        return (key for key, _ in analysis.writes(node, known))

    for node in analysis.of(mission).all:
        if isinstance(node, kinds.Parallel):
            branches = [list(_writes(child, frozenset(), (True, True), writes)) for child in node.children]
            one_is_enough = node.policy.successes_needed(len(branches)) == 1 and not node.policy.names
            _check(branches, read, findings, one_is_enough=one_is_enough)


def _check(
    branches: list[list[_Write]], read: set[str], findings: FindingList, *, one_is_enough: bool
) -> None:
    first: dict[str, list[_Write]] = {}
    told: set[str] = set()
    for writes in branches:
        for write in writes:
            key = write.key.text
            others = [each for each in first.get(key, ()) if _race(each, write, one_is_enough=one_is_enough)]
            if key in read and others and key not in told:
                told.add(key)
                line = others[0].key.position.line
                message = (
                    f"another branch writes the key {key!r}, too (line {line}): whoever comes last counts"
                )
                findings.warning(write.key.position, message, ["a key of its own for each branch"])
        for write in writes:
            first.setdefault(write.key.text, []).append(write)


def _race(one: _Write, other: _Write, *, one_is_enough: bool) -> bool:
    """Tell whether it matters which of two branches writes last, and is not clear."""
    if one.same == other.same or one.begins != other.begins:  # the first value, then another one
        return False
    # Where one success is enough, the first branch that gets to its end stops the others.
    return not (one_is_enough and one.ends and other.ends)


def _read(node: Node, own: frozenset[str]) -> Iterator[str]:
    """Yield the keys that something reads, but for those that are its own.

    Args:
        node: Where to look.
        own: The keys that belong to a node above.
    """
    reasons = node.reasons
    texts: Iterable[Value] = ()
    if reasons is not None:
        texts = [*reasons.by_code.values(), *((reasons.always,) if reasons.always is not None else ())]
    hidden = {*own, *model.FAILURE_KEYS} if texts else own
    yield from (each.key for each in node.references() if each.key not in own)
    for text in texts:
        yield from (each.key for each in model.references(text) if each.key not in hidden)
    for part in _parts(node):
        yield from _read(part, own | node.own_keys(part))


def _writes(
    node: Node, own: frozenset[str], place: tuple[bool, bool], writes: Callable[[Node], Iterable[Literal]]
) -> Iterator[_Write]:
    """Yield the writers of keys below a node.

    Args:
        node: Where to look.
        own: The keys that belong to a node above.
        place: Whether a branch begins and whether it ends with the node.
        writes: Gives the keys that a node itself writes.
    """
    begins, ends = place
    for key in writes(node):
        if key.text not in own:
            yield _Write(node, key, begins and not node.parts, ends and not node.parts)
    ends = ends and node.cleanup is None
    for part in _parts(node):
        is_branch = isinstance(node, kinds.If | kinds.Switch | kinds.Selector)
        first = isinstance(node, kinds.Sequence) and part is node.parts[0]
        last = isinstance(node, kinds.Sequence) and part is node.parts[-1]
        below = begins and first, ends and (last or is_branch)
        yield from _writes(part, own | node.own_keys(part), below, writes)


def _parts(node: Node) -> tuple[Node, ...]:
    return (*node.parts, *((node.cleanup,) if node.cleanup is not None else ()))
