"""``on_failure``: what is done about failures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind
from florence_bt.trees.language.code_groups import ANY, by_code
from florence_bt.trees.language.model import FAILURE_KEYS, Literal, Node, Wrapper
from florence_bt.trees.language.node_kind import KnownKinds, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes, codes_of, skipped_with
from florence_bt.trees.language.value_schemas import NAME, NODE

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OnFailure(Wrapper):
    """Does something about failures of the node below.

    Attributes:
        handlers: Codes, groups of codes or ``any``, each with what is done.
    """

    kind: ClassVar = NodeKind(
        word="on_failure",
        about="what is done about failures: codes, groups of codes or any, each with a node",
        symbol="!",
        value={"type": "object", "additionalProperties": NODE, "propertyNames": NAME, "minProperties": 1},
    )

    handlers: tuple[tuple[Literal, Node], ...]

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child, and what is done about its failures."""
        return (self.child, *(node for _, node in self.handlers))

    @property
    def default_title(self) -> str:
        """As the node below."""
        return self.child.title

    @property
    def edges(self) -> tuple[str, ...]:
        """The codes."""
        return ("", *(f"on {code.text}" for code, _ in self.handlers))

    def writes(self, known: KnownKinds) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the keys of the failure."""
        for code, _ in self.handlers[:1]:
            yield from ((Literal(key, True, code.position), Kind.TEXT) for key in FAILURE_KEYS)

    def own_keys(self, part: Node) -> frozenset[str]:
        """Return the keys of the failure, for what is done about it."""
        return frozenset() if part in (self.child, self.cleanup) else frozenset(FAILURE_KEYS)

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as the node below, where a failure ends as what is done about it."""
        child = known.of(self.child, skip_fails=self.skip_fails_below(skip_fails))
        handlers = [(code.text, known.of(each, skip_fails=True)) for code, each in self.handlers]
        caught = by_code(handlers, known.groups)
        ways = [caught.get(code, caught.get(ANY)) for code in child.codes]
        # A handler that is skipped leaves the failure as it was.
        left = {code for code, way in zip(child.codes, ways, strict=True) if way is None or way.can_skip}
        done = [way for way in ways if way is not None]
        can_succeed = child.can_succeed or any(way.can_succeed for way in done)
        return skipped_with(child, NodeOutcomes(can_succeed, codes_of(done) | left), skip_fails)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the node below, and what is done about its failures, with keys of its own."""
        from florence_bt.behaviours import catching
        from florence_bt.behaviours.annotations import numbered

        body = builder.child(self, skipped_fails)
        inside = builder.inside(self, self.handlers[0][1])
        handlers = [inside.node(each, skipped_fails=True) for _, each in self.handlers]
        words = [word.text for word, _ in self.handlers]
        chosen = by_code(zip(words, handlers, strict=True), builder.groups)
        otherwise = chosen.pop(ANY, None)
        numbered([body, *handlers])
        own = inside.context.keys
        return catching.OnFailure(name, builder.context, body, handlers, chosen, otherwise, own)
