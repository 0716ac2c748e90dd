"""Why a tree failed: the leaf that caused it, its code and a reason for people."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol, runtime_checkable

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector

from florence_bt.behaviours.keys import KeyStore, MissingKey, TextTemplate
from florence_bt.core.outcome import Result


@dataclass(frozen=True, slots=True)
class Why:
    """The cause of a failure.

    Attributes:
        path: The path of the node that failed by itself, names joined with ``/``.
        code: The short name of the failure for programs.
        reason: A sentence for people.
    """

    path: str
    code: str
    reason: str


@runtime_checkable
class FailsByItself(Protocol):
    """A node that can fail on its own account: a leaf, or a decorator such as a time-out."""

    result: Result | None
    """The failure, or None when the node failed only because a child did."""


@runtime_checkable
class RetellsFailure(Protocol):
    """A decorator that adds to the reason of its child, such as a retry."""

    def retell(self, why: Why) -> Why:
        """The child's failure with what this node knows about it."""


@dataclass(frozen=True, slots=True)
class Because:
    """Reasons that the author of a mission gave for the failures of a node.

    Attributes:
        keys: Where the keys in the texts are looked up.
        always: The text for every failure, or None.
        by_code: Texts for failures with one code.
    """

    keys: KeyStore
    always: TextTemplate | None = None
    by_code: Mapping[str, TextTemplate] = field(default_factory=dict)

    def retell(self, why: Why) -> Why:
        """The failure with the author's reason, if there is one for its code."""
        template = self.by_code.get(why.code, self.always)
        if template is None:
            return why
        try:
            return replace(why, reason=template.resolve(self.keys))
        except MissingKey:
            return why


def give_reason(node: Behaviour, because: Because) -> None:
    """Let ``because`` word the failures of a node, of whatever class the node is."""
    node.__dict__["because"] = because


def path_of(node: Behaviour) -> str:
    """The names from the root down to a node, joined with ``/``."""
    names = [node.name]
    while node.parent is not None:
        node = node.parent
        names.append(node.name)
    return "/".join(reversed(names))


def explain(root: Behaviour) -> Why | None:
    """Find the cause of a failure in a tree, or a part of one, that has just finished.

    A decorator points to its child, a sequence and a parallel to the child that failed, a selector to the
    last child that failed.

    Args:
        root: The node to explain.

    Returns:
        The cause, or None when the node has not failed.
    """
    if root.status is not Status.FAILURE:
        return None
    why = _cause(root)
    because = root.__dict__.get("because")
    return because.retell(why) if isinstance(because, Because) else why


def _cause(node: Behaviour) -> Why:
    own = node.result if isinstance(node, FailsByItself) else None
    if own is not None and not own.succeeded:
        return Why(path_of(node), own.code, own.reason)
    failed = [child for child in node.children if child.status is Status.FAILURE]
    if not failed:
        return Why(path_of(node), "failed", node.feedback_message or f"{node.name} failed")
    why = explain(failed[-1] if isinstance(node, Selector) else failed[0])
    assert why is not None  # the child's status is FAILURE
    return node.retell(why) if isinstance(node, RetellsFailure) else why
