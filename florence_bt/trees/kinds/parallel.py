"""``parallel``: all at the same time; the policy says when it is done."""

from __future__ import annotations

import difflib
import enum
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar
from florence_bt.trees.language.model import Composite, Literal, Node
from florence_bt.trees.language.node_kind import Modifier, NodeChecks, NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import NO_CODES, MissionOutcomes, NodeOutcomes, codes_of
from florence_bt.trees.language.quantities import read_value
from florence_bt.trees.language.value_schemas import NODES, TEXT, Schema, words

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

POLICIES = {
    "all": "succeeds when all have succeeded, fails at the first failure",
    "any": "succeeds at the first success, fails when all have failed",
}
"""Policies that are a word; the others are a list of names, or a table."""
_POLICY_KEYS = ("succeed", "fail")


class PolicyKind(enum.Enum):
    """The policies that say when a parallel is done."""

    ALL = "all"
    """Succeeds when all have succeeded; fails at the first failure."""
    ANY = "any"
    """Succeeds at the first success; fails when all have failed."""
    SELECTED = "selected"
    """Succeeds when the named ones have succeeded; fails at the first failure of any branch."""
    COUNTED = "counted"
    """Succeeds and fails at given numbers; fails too when the successes are out of reach."""


@dataclass(frozen=True, slots=True)
class ParallelPolicy:
    """``policy``: when a parallel is done.

    Attributes:
        kind: Which of the forms.
        names: The names of the branches that must succeed, when selected.
        succeed: The number of successes that are enough, when counted.
        fail: The number of failures that are too many, when counted; None when only the reach counts.
        position: Where it stands; None when nothing was written.
    """

    kind: PolicyKind = PolicyKind.ALL
    names: tuple[Literal, ...] = ()
    succeed: int | None = None
    fail: int | None = None
    position: Position | None = None

    def successes_needed(self, branches: int) -> int:
        """Count the branches, of a number, that must succeed."""
        match self.kind:
            case PolicyKind.ANY:
                return 1
            case PolicyKind.COUNTED if self.succeed is not None:
                return self.succeed
            case PolicyKind.SELECTED:
                return len(self.names)
        return branches

    def __str__(self) -> str:
        """Write the policy as the author wrote it."""
        match self.kind:
            case PolicyKind.SELECTED:
                return f"[{', '.join(name.text for name in self.names)}]"
            case PolicyKind.COUNTED:
                fail = f", fail: {self.fail}" if self.fail is not None else ""
                return f"{{succeed: {self.succeed}{fail}}}"
        return self.kind.value


def _policy_schema() -> Schema:
    counted: Schema = {
        "type": "object",
        "properties": {key: {"type": "integer", "minimum": 1} for key in _POLICY_KEYS},
        "required": [_POLICY_KEYS[0]],
        "additionalProperties": False,
    }
    return {"anyOf": [words(POLICIES), {"type": "array", "items": TEXT, "minItems": 1}, counted]}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parallel(Composite):
    """Does its nodes at the same time.

    Attributes:
        policy: When it is done.
    """

    kind: ClassVar = NodeKind(
        word="parallel",
        about="runs its nodes at the same time",
        symbol="⇉",
        value=NODES,
        example="- parallel:\n    - wait: 1 s\n    - wait: 2 s",
        modifiers=(
            Modifier(
                "policy",
                "when the parallel is done: all, any, the names of branches, or numbers",
                _policy_schema(),
            ),
        ),
        others=("at_once",),
    )

    policy: ParallelPolicy = ParallelPolicy()

    @property
    def selected(self) -> tuple[Node, ...]:
        """The branches that the policy names, by title; names that fit none are left out."""
        wanted = {name.text for name in self.policy.names}
        return tuple(child for child in self.children if child.title in wanted)

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the branches and the policy."""
        children, source = form.children(), form.get("policy")
        policy = _read_policy(form, source, children) if source is not None else ParallelPolicy()
        return cls(children=children, policy=policy, **form.fields)

    @property
    def edges(self) -> tuple[str, ...]:
        """Name the branches that must succeed, where that is not all or any of them."""
        wanted = [name.text for name in self.policy.names]
        return tuple("must succeed" if child.title in wanted else "" for child in self.children)

    @property
    def details(self) -> tuple[str, ...]:
        """The policy."""
        match self.policy.kind:
            case PolicyKind.ANY:
                return ("any one is enough",)
            case PolicyKind.COUNTED:
                return (f"policy: {self.policy}",)
        return ()

    def check(self, checks: NodeChecks) -> None:
        """Check that the policy is about branches that there are."""
        policy, count = self.policy, len(self.children)
        titles = Counter(child.title for child in self.children)
        position = policy.position or self.position
        for name in policy.names:
            if name.text not in titles:
                message = f"the policy names {name.text!r}, but no branch has this name"
                checks.findings.unknown(name.position, message, name.text, titles)
            elif titles[name.text] > 1:
                message = f"the policy names {name.text!r}, but {titles[name.text]} branches have this name"
                checks.findings.error(name.position, message, ["a `name` of its own for each branch"])
        if policy.kind is PolicyKind.COUNTED:
            for what, number in (("succeed", policy.succeed), ("fail", policy.fail)):
                if number is not None and not 1 <= number <= count:
                    message = f"{what}: {number} branches are asked for, but there are {count}"
                    checks.findings.error(position, message, [f"{what}: 1 to {count}"])

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: as the policy says, counted over the branches that can."""
        parts = [known.of(child, skip_fails=False) for child in self.children]
        policy, count = self.policy, len(parts)
        can_succeed = sum(part.can_succeed for part in parts)
        can_fail = sum(part.can_fail for part in parts)
        if policy.kind is PolicyKind.SELECTED:
            selected = set(self.selected)
            wanted = [part for child, part in zip(self.children, parts, strict=True) if child in selected]
            return NodeOutcomes(all(part.can_succeed for part in wanted), codes_of(parts))
        needed = min(policy.successes_needed(count), count)  # what cannot be is found elsewhere
        too_many = count - needed + 1
        if policy.kind is PolicyKind.COUNTED and policy.fail is not None:
            too_many = min(too_many, policy.fail)
        return NodeOutcomes(can_succeed >= needed, codes_of(parts) if can_fail >= too_many else NO_CODES)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the parallel of py_trees, or ours that counts."""
        from py_trees import composites as plain
        from py_trees.common import ParallelPolicy as PlainPolicy

        from florence_bt.behaviours.parallel import CountingParallel

        children, policy = builder.children(self.children, skipped_fails=False), self.policy
        if policy.kind is PolicyKind.ALL:
            return plain.Parallel(name, PlainPolicy.SuccessOnAll(), children)
        if policy.kind is PolicyKind.SELECTED:
            titles = [child.title for child in self.children]
            for wanted in policy.names:
                if titles.count(wanted.text) != 1:
                    problem = f"the policy needs one branch that is called {wanted.text!r}"
                    raise builder.error(wanted.position, problem, closest_first(wanted.text, titles))
            chosen = [children[titles.index(wanted.text)] for wanted in policy.names]
            return CountingParallel(name, children, len(chosen), 1, chosen)
        needed = policy.successes_needed(len(children))
        if max(needed, policy.fail or 1) > len(children):
            raise builder.error(policy.position, f"the policy counts more than {len(children)} branches")
        return CountingParallel(name, children, needed, policy.fail)


def _read_policy(form: Form, source: YamlNode, children: tuple[Node, ...]) -> ParallelPolicy:
    reader = form.reader
    if isinstance(source, YamlMapping):
        return _read_counts(form, source)
    if isinstance(source, YamlScalar):
        if source.text in POLICIES:
            return ParallelPolicy(PolicyKind(source.text), position=source.position)
        valid = (*POLICIES, "[the name of a branch]", "{succeed: 2, fail: 1}")
        reader.error(source.position, f"policy cannot be {source.text!r}", valid)
        return ParallelPolicy(position=source.position)
    if not source.items:
        reader.error(source.position, "no branch is named", [f"[{child.title}]" for child in children])
    names = tuple(
        Literal(name, True, item.position)
        for item in source.items
        if (name := reader.text(item, "the name of a branch")) is not None
    )
    return ParallelPolicy(PolicyKind.SELECTED, names=names, position=source.position)


def _read_counts(form: Form, source: YamlMapping) -> ParallelPolicy:
    """Read a policy that counts branches."""
    reader = form.reader
    for key, _ in source.entries:
        if key.text not in _POLICY_KEYS:
            message = f"unknown key of a policy {key.text!r}"
            reader.unknown(key.position, message, key.text, _POLICY_KEYS)
    if not any(difflib.get_close_matches(key.text, ["succeed"]) for key, _ in source.entries):
        reader.error(source.position, "the policy lacks succeed", ["{succeed: 2, fail: 1}"])
    succeed, fail = (_read_count(form, source.get(name), name) for name in _POLICY_KEYS)
    return ParallelPolicy(PolicyKind.COUNTED, succeed=succeed or 1, fail=fail, position=source.position)


def _read_count(form: Form, source: YamlNode | None, name: str) -> int | None:
    if source is None:
        return None
    try:
        number = read_value(source.text, Kind.INTEGER) if isinstance(source, YamlScalar) else 0
    except ConfigError:
        number = 0
    if number < 1:
        form.reader.error(source.position, f"{name} must be a number of branches", [f"{name}: 1"])
        return None
    return int(number)
