"""A mission as written: frozen data with the position of every part; its kinds of nodes are in ``kinds``.

Nodes and missions are compared by identity: two equal lines of a file are two nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.plain_yaml import Position, YamlMapping
from florence_bt.trees.language.expressions.syntax import Expression, keys_of
from florence_bt.trees.language.findings import Finding
from florence_bt.trees.language.node_kind import KnownKinds, NodeChecks, NodeKind, TreeBuilder

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
"""Anything that can stand where a value is expected; an expression stands in ``${...}``."""


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
        takes_time: Whether it can be running by itself.
        passes_on: Whether the nodes below it are watched where it is.
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
    takes_time: ClassVar[bool] = False
    passes_on: ClassVar[bool] = True

    position: Position
    name: str | None = None
    code: Literal | None = None
    reasons: Reasons | None = None
    cleanup: Node | None = None
    when: Expression | None = None
    holds: Expression | None = None

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read a node as it is written; None when a part that it needs cannot be read: a finding."""
        raise NotImplementedError

    @classmethod
    def has_own_failure(cls, mapping: YamlMapping) -> bool:
        """Tell whether a node has a failure of its own as written, where its kind takes a ``code``."""
        return True

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
        return self.kind.word

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """The conditions of the node itself: guards, and what its kind asks."""
        return (*self.guards, *self.asked())

    def asked(self) -> tuple[Expression, ...]:
        """Return the conditions that the kind itself asks, without the guards."""
        return ()

    @property
    def reads(self) -> tuple[Value, ...]:
        """The values that the node itself reads when it begins, without its conditions and its own words."""
        return ()

    def references(self) -> Iterator[Reference]:
        """Yield the keys that the node itself needs when it begins, those of its conditions first."""
        for value in (*self.expressions, *self.reads):
            yield from references(value)

    def writes(self, known: KnownKinds) -> Iterator[tuple[Literal, Kind | None]]:
        """Yield the keys that the node itself writes, each with its kind if that is known.

        Args:
            known: Gives the kinds of values.
        """
        return iter(())

    def literals_of_keys(self) -> Iterator[tuple[Literal, str]]:
        """Yield literals that the node writes to a key, or holds against one, with the key."""
        return iter(())

    @property
    def watched(self) -> tuple[Node, ...]:
        """The parts that the node asks again while another one runs."""
        return ()

    def fails_when_skipped(self, part: Node, skipped_fails: bool) -> bool:
        """Tell whether a part counts as failed when it is skipped.

        Args:
            part: The part.
            skipped_fails: Whether it does where the node is.
        """
        return skipped_fails

    def check(self, checks: NodeChecks) -> None:
        """Check the values and names of the node by itself.

        Args:
            checks: Checks values, and takes the findings.
        """

    def own_keys(self, part: Node) -> frozenset[str]:
        """Return the keys that belong to one of the parts: nothing outside changes what that sees."""
        return frozenset()

    @property
    def edges(self) -> tuple[str, ...]:
        """A word for the line to each part, as drawn."""
        return ("",) * len(self.parts)

    @property
    def details(self) -> tuple[str, ...]:
        """Say in a drawing what the title does not."""
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

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read the node below, which is the value of the kind's word unless the kind says otherwise."""
        fields, child = form.fields, form.reader.node(form.value)
        return cls(child=child, **fields) if child is not None else None

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


FAILURE_KEYS = ("failure_code", "failure_reason")
"""The keys in which a node under ``on_failure`` finds the failure."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Composite(Node):
    """A node with several nodes below."""

    children: tuple[Node, ...]

    @property
    def parts(self) -> tuple[Node, ...]:
        """The children."""
        return self.children


def default_of(name: str, item: int | None = None) -> str:
    """Name the entry that keeps the position of the default of an input or key, or of an item of that list.

    No key is called so.
    """
    return f"{name}: default" if item is None else f"{name}: default {item}"


@dataclass(frozen=True, slots=True)
class PropertyEvent:
    """Something that a property of a mission is about: a skill begins, runs or ends, or the mission ends.

    Attributes:
        who: The skill, the called mission, or ``it``, which is the mission itself.
        how: ``begins``, ``runs``, ``fails``, ``succeeds``, ``ends``, ``is stopped``.
        code: The code, or the group of codes, that counts; empty: all.
        position: Where it stands.
    """

    who: str
    how: str
    code: str = ""
    position: Position = field(default=Position(), compare=False)


@dataclass(frozen=True, slots=True)
class Property:
    """Something that an author wants to hold of a mission, whatever happens.

    Attributes:
        word: ``never``, ``after``, ``at_most`` or ``always_before``.
        text: As written, for people.
        because: The author's sentence, or empty.
        file: The file in which it stands.
        position: Where in the file.
        first: What it is about; None where it is about a condition alone.
        then: What must follow or come before, or must not run at the same time.
        condition: An expression over keys that must not hold: while ``first`` runs, or when it happens.
        within: How long ``then`` may take to follow, in seconds; infinite: as long as it takes.
        most: How often ``first`` may happen.
    """

    word: str
    text: str
    because: str
    file: Path
    position: Position
    first: PropertyEvent | None = None
    then: PropertyEvent | None = None
    condition: Expression | None = None
    within: float = float("inf")
    most: int = 0

    @property
    def events(self) -> tuple[PropertyEvent, ...]:
        """Its events, in the order of its text."""
        return tuple(each for each in (self.first, self.then) if each is not None)


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
        properties: What its author wants to hold of it, as far as it stands in the file itself.
        on_restart: ``abort``, ``restart`` or ``resume``: what follows when the executor died on it.
        tree: The root node; None when the file is too broken to have one.
        positions: Where the inputs, outputs and keys are declared, by name, and their defaults, by
            :func:`default_of` their name.
        findings: What was wrong with the file's form.
        lost: Where the form is wrong: the keys that nodes would write, broken nodes included.
        version: Stands for the text of the file: equal versions are equal texts.
        text: The text of the file; empty of one that is too broken to be a mission.
        imported_from: The file of another project that it was imported from; empty for one that is our own.
    """

    name: str
    description: str
    file: Path
    inputs: Mapping[str, Port] = field(default_factory=dict)
    outputs: Mapping[str, Port] = field(default_factory=dict)
    keys: Mapping[str, Port] = field(default_factory=dict)
    properties: tuple[Property, ...] = ()
    on_restart: str = "abort"
    tree: Node | None = None
    positions: Mapping[str, Position] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    lost: frozenset[str] = frozenset()
    version: str = ""
    text: str = field(default="", repr=False)
    imported_from: str = ""

    def required_inputs(self) -> tuple[str, ...]:
        """Return the inputs that a caller must give."""
        return tuple(name for name, port in self.inputs.items() if port.required)

    def nodes(self) -> Iterator[Node]:
        """Yield every node from the root down, clean-ups included."""
        if self.tree is not None:
            yield from walk(self.tree)
