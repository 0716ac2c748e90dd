"""A mission as written: frozen data with the position of every part. No behaviour and no checks live here.

Nodes and missions are compared by identity: two equal lines of a file are two nodes.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language.expressions.syntax import Expression, keys_of
from florence_bt.trees.language.findings import Finding
from florence_bt.trees.language.node_kind import Demand, NodeKind, TreeBuilder

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form
    from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes


@dataclass(frozen=True, slots=True)
class Literal:
    """A value that is written out.

    Attributes:
        text: As written, ``$$`` already replaced.
        quoted: Whether it was written in quotes, and so is a text.
        position: Where it stands.
    """

    text: str
    quoted: bool
    position: Position


@dataclass(frozen=True, slots=True)
class Reference:
    """``$key``: the value of a key or of an input of the mission.

    Attributes:
        key: The key's name.
        position: Where it stands.
    """

    key: str
    position: Position


@dataclass(frozen=True, slots=True)
class Template:
    """A text with keys in it.

    Attributes:
        parts: Texts and references in order.
        position: Where it stands.
        quoted: Whether it stood in quotes, and so is certainly a text.
    """

    parts: tuple[str | Reference, ...]
    position: Position
    quoted: bool = False


@dataclass(frozen=True, slots=True)
class PoseParts:
    """``{x: ..., y: ..., yaw: ...}``.

    Attributes:
        x: A length.
        y: A length.
        yaw: An angle.
        position: Where it stands.
    """

    x: Value
    y: Value
    yaw: Value
    position: Position


@dataclass(frozen=True, slots=True)
class ListItems:
    """``[kitchen, $room]``.

    Attributes:
        items: The values, in order.
        position: Where it stands.
    """

    items: tuple[Value, ...]
    position: Position


Value = Literal | Reference | Template | PoseParts | ListItems | Expression
"""What can stand where a value is expected; an expression stands in ``${...}``."""
KindOf = Callable[[Value], Kind | None]
"""Gives the kind of a value, None when it is not known."""


@dataclass(frozen=True, slots=True)
class Reasons:
    """``because``: the author's words for a node's failures.

    Attributes:
        always: The text for every failure, or None.
        by_code: Texts for failures with one code.
        position: Where it stands.
        places: Code -> where it stands.
    """

    always: Value | None
    by_code: Mapping[str, Value]
    position: Position
    places: Mapping[str, Position] = field(default_factory=dict)


def references(value: Value) -> Iterator[Reference]:
    """Yield every key that a value needs."""
    match value:
        case Reference():
            yield value
        case Template(parts=parts):
            yield from (part for part in parts if isinstance(part, Reference))
        case PoseParts(x=x, y=y, yaw=yaw):
            for part in (x, y, yaw):
                yield from references(part)
        case ListItems(items=items):
            for item in items:
                yield from references(item)
        case Expression(term=term):
            yield from (Reference(key.key, key.position) for key in keys_of(term))


def show(value: Value) -> str:
    """Write a value as the author wrote it, on one line."""
    match value:
        case Literal(text=text):
            return text
        case Reference(key=key):
            return f"${key}"
        case Template(parts=parts):
            return "".join(part if isinstance(part, str) else f"${part.key}" for part in parts)
        case PoseParts(x=x, y=y, yaw=yaw):
            return f"{{x: {show(x)}, y: {show(y)}, yaw: {show(yaw)}}}"
        case ListItems(items=items):
            return f"[{', '.join(map(show, items))}]"
        case Expression(text=text):
            return f"${{{text}}}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Node:
    """A node, with what every kind of node has, and what each kind says about its nodes.

    Attributes:
        kind: What is the same for all nodes of the kind.
        decides_by_values: Whether the values that it reads decide what it does, as expressions always do.
        position: Where its kind key stands.
        name: The name that the author gave, or None.
        code: ``code``: what a failure of the node's own is called, or None: as :meth:`own_failure` says.
        reasons: ``because``, or None.
        cleanup: ``finally``, or None.
        when: ``when``: what must hold before the node starts, or None; the node is skipped otherwise.
        holds: ``while``: what must hold all along, or None; the node fails otherwise.
    """

    kind: ClassVar[NodeKind]
    decides_by_values: ClassVar[bool] = False

    position: Position
    name: str | None = None
    code: Literal | None = None
    reasons: Reasons | None = None
    cleanup: Node | None = None
    when: Expression | None = None
    holds: Expression | None = None

    @property
    def parts(self) -> tuple[Node, ...]:
        """The nodes directly below, without the clean-up."""
        return ()

    @property
    def title(self) -> str:
        """The name for people."""
        return self.name or self.default_title

    @property
    def default_title(self) -> str:
        """A name made from the kind."""
        return type(self).__name__.lower()

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """The conditions of the node itself: guards, and what its kind asks."""
        return (*self.guards, *self.asked())

    def asked(self) -> tuple[Expression, ...]:
        """Return the conditions that the kind itself asks, without the guards."""
        return ()

    @property
    def demands(self) -> tuple[Demand, ...]:
        """The values that the node itself reads when it begins, with what each must be."""
        return ()

    def writes(self, kind_of: KindOf) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the keys that the node itself writes, each with its kind if that is known.

        Args:
            kind_of: Gives the kind of a value, None when it is not known.
        """
        return iter(())

    def own_keys(self, part: Node) -> frozenset[str]:
        """Return the keys that belong to one of the parts: nothing outside changes what that sees."""
        return frozenset()

    @property
    def edges(self) -> tuple[str, ...]:
        """A word for the line to each part, as drawn."""
        return ("",) * len(self.parts)

    @property
    def details(self) -> tuple[str, ...]:
        """What a drawing says of the node beside its title."""
        return ()

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how the node can end, its guards apart.

        Args:
            known: Gives the outcomes of the nodes below, and of values.
            skip_fails: Whether the node has failed when it is skipped: where another one is tried then.
        """
        raise NotImplementedError

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the node with everything below it, its guards and its clean-up apart.

        Args:
            builder: Builds what is below, and gives values.
            name: The name of the node in the tree.
            skipped_fails: Whether a skipped node counts as failure here.

        Raises:
            ConfigError: Something is wrong that a check would have found.
        """
        raise NotImplementedError

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read a node as it is written; None when a part that it needs cannot be read: a finding."""
        raise NotImplementedError

    def own_failure(self, default: str) -> str:
        """Return the code of a failure that is the node's own: the author's word for it, or a default."""
        return self.code.text if self.code is not None else default

    @property
    def guards(self) -> tuple[Expression, ...]:
        """``when`` and ``while``, those that are there."""
        return tuple(guard for guard in (self.when, self.holds) if guard is not None)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wrapper(Node):
    """A node with one node below.

    Attributes:
        skipped_with_child: Whether it is skipped when what is below it is.
        child: The node below.
    """

    skipped_with_child: ClassVar[bool] = True

    child: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child."""
        return (self.child,)

    def skip_fails_below(self, above: bool) -> bool:
        """Tell whether what is below the node has failed when it is skipped.

        Args:
            above: Whether the node itself has failed when it is skipped.
        """
        return above and self.skipped_with_child


def walk(node: Node) -> Iterator[Node]:
    """Yield a node and every node below it, clean-ups included, in the order of the file."""
    yield node
    for part in node.parts:
        yield from walk(part)
    if node.cleanup is not None:
        yield from walk(node.cleanup)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fail(Node):
    """``fail``: fails with a reason."""

    reason: Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wait(Node):
    """``wait``: a pause."""

    duration: Value

    @property
    def default_title(self) -> str:
        """Such as ``wait 1 s``."""
        return f"wait {show(self.duration)}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WaitUntil(Node):
    """``wait_until``: a pause that a condition ends.

    Attributes:
        goal: What is asked until it succeeds.
    """

    goal: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        """What is asked."""
        return (self.goal,)

    @property
    def default_title(self) -> str:
        """Such as ``wait until $found``."""
        return f"wait until {self.goal.title}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Set(Node):
    """``set``: writes keys."""

    values: tuple[tuple[Literal, Value], ...]

    @property
    def default_title(self) -> str:
        """Such as ``set goal``."""
        return "set " + ", ".join(key.text for key, _ in self.values)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Add(Set):
    """``add``: writes sums of keys and what is added to them."""

    @property
    def default_title(self) -> str:
        """Such as ``add to rounds``."""
        return "add to " + ", ".join(key.text for key, _ in self.values)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Append(Node):
    """``append``: adds to keys that hold a text or a list."""

    values: tuple[tuple[Literal, Value], ...]

    @property
    def default_title(self) -> str:
        """Such as ``append to report``."""
        return "append to " + ", ".join(key.text for key, _ in self.values)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunSkill(Node):
    """``skill_name``: runs a skill.

    Attributes:
        skill: The name that was written; whether there is such a skill is for the checks.
        inputs: Input names and values.
        outputs: Output names and the keys that receive them.
        mapping_given: Whether the inputs were written as a table, or nothing was.
        unread: Names of inputs whose values could not be read, which is a finding there.
        written: What stands there in place of a table.
        every: How often it is asked again where it is watched as a condition, in seconds; None: not given.
    """

    skill: str
    inputs: tuple[tuple[Literal, Value], ...] = ()
    outputs: tuple[tuple[Literal, Literal], ...] = ()
    mapping_given: bool = True
    unread: tuple[str, ...] = ()
    written: str = ""
    every: float | None = None

    @property
    def default_title(self) -> str:
        """Such as ``navigate to``."""
        return self.skill.replace("_", " ")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CallMission(Node):
    """``run``: runs another mission with keys of its own.

    Attributes:
        mission: Its name.
        inputs: Input names and values.
        outputs: Output names and the keys that receive them.
        unread: Names of inputs whose values could not be read, which is a finding there.
    """

    mission: Literal
    inputs: tuple[tuple[Literal, Value], ...] = ()
    outputs: tuple[tuple[Literal, Literal], ...] = ()
    unread: tuple[str, ...] = ()

    @property
    def default_title(self) -> str:
        """Such as ``run detect_user``."""
        return f"run {self.mission.text}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repeat(Wrapper):
    """``repeat``: again after a success.

    Attributes:
        rounds: How often; None: forever.
    """

    skipped_with_child: ClassVar[bool] = False

    rounds: Value | None

    @property
    def default_title(self) -> str:
        """Such as ``repeat 3 times``."""
        return f"repeat {show(self.rounds)} times" if self.rounds is not None else "repeat forever"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Timeout(Wrapper):
    """``timeout``: stopped when it takes too long."""

    duration: Value

    @property
    def default_title(self) -> str:
        """Such as ``within 30 s``."""
        return f"within {show(self.duration)}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Once(Wrapper):
    """``once``: its first result stays."""

    @property
    def default_title(self) -> str:
        """Such as ``once say hello``."""
        return f"once {self.child.title}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Invert(Wrapper):
    """``invert``: success becomes failure and failure success."""

    @property
    def default_title(self) -> str:
        """Such as ``not robot in room``."""
        return f"not {self.child.title}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Succeed(Wrapper):
    """``succeed``: a failure counts as success."""

    skipped_with_child: ClassVar[bool] = False

    @property
    def default_title(self) -> str:
        """Such as ``try say hello``."""
        return f"try {self.child.title}"


FAILURE_KEYS = ("failure_code", "failure_reason")
"""The keys in which a node under ``on_failure`` finds the failure."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OnFailure(Wrapper):
    """``on_failure``: what is done about failures of the node below.

    Attributes:
        handlers: Codes, groups of codes or ``any``, each with what is done.
    """

    handlers: tuple[tuple[Literal, Node], ...]

    def own_keys(self, part: Node) -> frozenset[str]:
        """Return the keys of the failure, for what is done about it."""
        return frozenset() if part in (self.child, self.cleanup) else frozenset(FAILURE_KEYS)

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child, and what is done about its failures."""
        return (self.child, *(node for _, node in self.handlers))

    @property
    def default_title(self) -> str:
        """As the node below."""
        return self.child.title


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Until(Wrapper):
    """``until``: what ends the node below, with success.

    Attributes:
        goal: The node whose success ends it.
    """

    goal: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child, and what ends it."""
        return (self.child, self.goal)

    @property
    def default_title(self) -> str:
        """Such as ``navigate to until look for user``."""
        return f"{self.child.title} until {self.goal.title}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Interruptible(Wrapper):
    """``interrupted_by``: what comes before the node below, which goes on afterwards.

    Attributes:
        goal: The node whose success interrupts it.
        interruption: What is done then.
    """

    goal: Node
    interruption: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child, what interrupts it, and what is done then."""
        return (self.child, self.goal, self.interruption)

    @property
    def default_title(self) -> str:
        """As the node below."""
        return self.child.title


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Composite(Node):
    """A node with several nodes below."""

    children: tuple[Node, ...]

    @property
    def parts(self) -> tuple[Node, ...]:
        """The children."""
        return self.children


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sequence(Composite):
    """``sequence``: one after the other until one fails."""

    memory: bool = True


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ensure(Sequence):
    """``ensure``: a node, and the condition that its success must meet."""

    @property
    def default_title(self) -> str:
        """As the node."""
        return self.children[0].title


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Selector(Composite):
    """``selector``: one after the other until one succeeds."""

    memory: bool = True


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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Parallel(Composite):
    """``parallel``: all at the same time; the policy says when it is done."""

    policy: ParallelPolicy = ParallelPolicy()

    @property
    def selected(self) -> tuple[Node, ...]:
        """The branches that the policy names, by title; names that fit none are left out."""
        wanted = {name.text for name in self.policy.names}
        return tuple(child for child in self.children if child.title in wanted)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class If(Node):
    """``if``: one of two branches.

    Attributes:
        condition: What is asked: an expression, or a node whose success means yes.
        then: What is done when the condition holds.
        otherwise: ``else``: what is done when it does not; None: nothing, which is a success.
        memory: Whether it is decided once, at the start; else again with every tick.
    """

    condition: Expression | Node
    then: Node
    otherwise: Node | None = None
    memory: bool = True

    @property
    def parts(self) -> tuple[Node, ...]:
        """The condition if it is a node, and the branches."""
        condition = (self.condition,) if isinstance(self.condition, Node) else ()
        return (*condition, self.then, *((self.otherwise,) if self.otherwise is not None else ()))

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """The guards, and the condition."""
        return (*self.guards, *((self.condition,) if isinstance(self.condition, Expression) else ()))

    @property
    def default_title(self) -> str:
        """Such as ``if $distance < 1 m``."""
        asked = self.condition.title if isinstance(self.condition, Node) else self.condition.text
        return f"if {asked}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Switch(Node):
    """``switch``: the branch whose case is equal to a value.

    Attributes:
        value: What is looked at, once, at the start.
        cases: The values, each with its branch.
        default: What is done when no case fits; None: the node fails then.
    """

    value: Value
    cases: tuple[tuple[Literal, Node], ...]
    default: Node | None = None

    @property
    def parts(self) -> tuple[Node, ...]:
        """The branches."""
        return (*(node for _, node in self.cases), *((self.default,) if self.default is not None else ()))

    @property
    def default_title(self) -> str:
        """Such as ``switch $mode``."""
        return f"switch {show(self.value)}"


def default_of(name: str, item: int | None = None) -> str:
    """Name the entry that keeps the position of the default of an input or key, or of an item of that list.

    No key is called so.
    """
    return f"{name}: default" if item is None else f"{name}: default {item}"


@dataclass(frozen=True, slots=True, eq=False)
class Mission:
    """A mission file.

    Attributes:
        name: The name, equal to the file's stem.
        description: What it does, for people.
        file: The file.
        inputs: What a caller gives, in SI units.
        outputs: What it leaves in keys of these names when it succeeds.
        keys: ``keys``: the keys that are declared, with their types; a default is the value at the start.
        on_restart: ``abort``, ``restart`` or ``resume``: what follows when the executor died on it.
        tree: The root node; None when the file is too broken to have one.
        positions: Where the inputs, outputs and keys are declared, by name, and their defaults, by
            :func:`default_of` their name.
        findings: What was wrong with the file's form.
        lost: Where the form is wrong: the keys that nodes would write, broken nodes included.
        version: Stands for the text of the file: equal versions are equal texts.
        imported_from: The file of another project that it was imported from; empty for one that is our own.
    """

    name: str
    description: str
    file: Path
    inputs: Mapping[str, Port] = field(default_factory=dict)
    outputs: Mapping[str, Port] = field(default_factory=dict)
    keys: Mapping[str, Port] = field(default_factory=dict)
    on_restart: str = "abort"
    tree: Node | None = None
    positions: Mapping[str, Position] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    lost: frozenset[str] = frozenset()
    version: str = ""
    imported_from: str = ""

    def required_inputs(self) -> tuple[str, ...]:
        """Return the inputs that a caller must give."""
        return tuple(name for name, port in self.inputs.items() if port.required)

    def nodes(self) -> Iterator[Node]:
        """Yield every node from the root down, clean-ups included."""
        if self.tree is not None:
            yield from walk(self.tree)


def values_of(node: Node) -> Iterator[Value]:
    """Yield the values that a node itself reads when it begins, without its conditions and its own words."""
    match node:
        case RunSkill(inputs=inputs) | CallMission(inputs=inputs):
            yield from (value for _, value in inputs)
        case Set(values=values):
            yield from (value for _, value in values)
        case Repeat(rounds=None):
            pass
        case Append(values=values):
            yield from (Reference(key.text, key.position) for key, _ in values)
            yield from (value for _, value in values)
        case Repeat(rounds=value) | Switch(value=value) | Fail(reason=value):
            assert value is not None  # that was the case above
            yield value
        case Timeout(duration=value) | Wait(duration=value):
            yield value
        case _:
            yield from (demand.value for demand in node.demands)
