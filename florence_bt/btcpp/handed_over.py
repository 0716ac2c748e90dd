"""Which inputs of a mission BehaviorTree.CPP cannot be handed as they are written.

There a value that is written out in a ``SubTree``, or is the default of a port, reaches the tree as a text.
Comparing it works; a script that computes with it, or asks whether it holds, stops with an error.
"""

from __future__ import annotations

from collections.abc import Iterator

from florence_bt.core.declaration import Kind
from florence_bt.trees.language import model
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.expressions.syntax import Term, parts_of
from florence_bt.trees.language.model import Expression, Mission, Node, Reference

_COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")


def computed_inputs(mission: Mission) -> list[str]:
    """The inputs with which a script of the exported mission computes."""
    used = {key for node in mission.nodes() for key in _computed_by(node)}
    texts = (Kind.TEXT, Kind.POSE)
    return [name for name, port in mission.inputs.items() if name in used and port.kind not in texts]


def _computed_by(node: Node) -> Iterator[str]:
    for guard in (node.when, node.unless, node.holds):
        if guard is not None:
            yield from _computed(guard.term, asked=True)
    match node:
        case model.Condition(condition=condition):
            yield from _computed(condition.term, asked=True)
        case model.If(condition=Expression() as condition):
            yield from _computed(condition.term, asked=True)
        case model.Switch(value=Reference(key=key)) if all(
            c.text in ("true", "false") for c, _ in node.cases
        ):
            yield key
        case model.Set(values=values):
            for _, value in values:
                if isinstance(value, Expression):
                    yield from _computed(value.term, asked=False)


def _computed(term: Term, *, asked: bool) -> Iterator[str]:
    match term:
        case syntax.Key(key=key):
            if asked:
                yield key
        case syntax.Binary(operator=operator, left=left, right=right) if operator in _COMPARISONS:
            for side in (left, right):
                yield from _computed(side, asked=False)
        case _:
            for part in parts_of(term):
                yield from _computed(part, asked=True)
