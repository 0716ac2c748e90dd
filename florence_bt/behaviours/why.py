"""The explanation of a failed tree: the leaf that caused it, its code and a reason for people."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import takewhile

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector

from florence_bt.behaviours.annotations import annotations_of
from florence_bt.behaviours.keys import KeyStore, TextTemplate, ValueProblem
from florence_bt.core.outcome import Result

FAILURE_CODE, FAILURE_REASON = "failure_code", "failure_reason"
"""The keys with a failure: the one that ``on_failure`` deals with, or dealt with last; in a ``because`` the
one that it explains (``trees.language.model.FAILURE_KEYS``)."""
EARLIER = " (before that, "
"""Words between the reason of the last branch of a selector and those of the others."""
SHORT_REASON = 80
"""Characters of a reason that stands beside others."""


@dataclass(frozen=True, slots=True)
class Why:
    """The cause of a failure.

    Attributes:
        path: The path of the node that failed first, names joined with ``/``.
        code: The short name of the failure for programs.
        reason: A sentence for people.
    """

    path: str
    code: str
    reason: str


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

    def extend_reason(self, why: Why) -> Why:
        """Replace the reason of a failure by the author's, if there is one for its code.

        In the text ``failure_code`` and ``failure_reason`` are those of this failure.
        """
        template = self.by_code.get(why.code, self.always)
        if template is None:
            return why
        try:
            keys = self.keys.with_values({FAILURE_CODE: why.code, FAILURE_REASON: why.reason})
            return replace(why, reason=template.resolve(keys))
        except ValueProblem:
            return why


def path_of(node: Behaviour) -> str:
    """Return the names from the root down to a node, joined with ``/``."""
    names = [node.name]
    while node.parent is not None:
        node = node.parent
        names.append(node.name)
    return "/".join(reversed(names))


def remember_failure(node: Behaviour, why: Why | None) -> None:
    """Keep why a node failed, or forget it (None): a selector resets the branches that it has left behind."""
    annotations_of(node).failed_with = why


def explain(root: Behaviour, known: dict[Behaviour, Why] | None = None) -> Why | None:
    """Find the cause of a failure in a tree, or a part of one, that has just finished.

    A node may have attributes that tell more: ``cause``, the child that a failure comes from, such as the
    branch of an ``if`` (None when the node itself failed); ``kept``, the failure of an earlier time that it
    fails with again, as a ``once``; ``extend_reason``, which adds to the reason of its child, as a retry.

    A decorator points to its child, a sequence and a parallel to the child that failed, a selector to the
    last child that failed; its reason says why the others failed too.

    Args:
        root: The node to explain.
        known: Causes found before in the same tree as it stands; new ones are added.

    Returns:
        The cause, or None when the node has not failed.
    """
    if root.status is not Status.FAILURE:
        return None
    known = {} if known is None else known
    why = known.get(root)
    if why is None:
        why = _cause(root, known)
        because = annotations_of(root).because
        if because is not None:
            why = because.extend_reason(why)
        known[root] = why
    return why


def _cause(node: Behaviour, known: dict[Behaviour, Why]) -> Why:
    own: Result | None = getattr(node, "result", None)
    if own is not None and not own.succeeded:
        kept: Why | None = getattr(node, "kept", None)
        return kept if kept is not None else Why(path_of(node), own.code, own.reason)
    cause: Behaviour | None = getattr(node, "cause", None)
    children = [cause] if cause is not None else node.children
    failed = [child for child in children if child.status is Status.FAILURE]
    if not failed:
        return Why(path_of(node), "failed", node.feedback_message or f"{node.name} failed")
    if isinstance(node, Selector):
        why = _of_all(node, failed[-1], known)
    else:
        why = _why(failed[0], known)
    extend: Callable[[Why], Why] | None = getattr(node, "extend_reason", None)
    return extend(why) if extend is not None else why


def _of_all(selector: Selector, last: Behaviour, known: dict[Behaviour, Why]) -> Why:
    """Find the cause of a selector: that of the last branch, and in short why the others failed."""
    why = _why(last, known)
    others: dict[str, list[str]] = {}
    for child in takewhile(lambda child: child is not last, selector.children):
        # A selector with memory resets the branches that it has left behind.
        other = explain(child, known) or annotations_of(child).failed_with
        if other is not None:
            others.setdefault(other.reason, []).append(child.name)
    summaries = [_summary(names, reason, why.reason) for reason, names in others.items()]
    return replace(why, reason=f"{why.reason}{EARLIER}{'; '.join(summaries)})") if summaries else why


def _summary(names: list[str], reason: str, last: str) -> str:
    """Summarise branches with one reason, which is left out if the last branch gives it anyway."""
    branches = ", ".join(dict.fromkeys(names))
    if reason in (last, last.split(EARLIER)[0]):
        return f"{branches} too"
    return f"{branches}: {shortened(reason)}"


def _why(child: Behaviour, known: dict[Behaviour, Why]) -> Why:
    why = explain(child, known)
    assert why is not None  # the child's status is FAILURE
    return why


def shortened(reason: str) -> str:
    """Shorten a reason that stands beside others."""
    return reason if len(reason) <= SHORT_REASON else f"{reason[: SHORT_REASON - 3]}..."
