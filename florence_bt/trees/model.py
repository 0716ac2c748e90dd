"""A mission as written: frozen data with the position of every part. No behaviour and no checks live here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from florence_bt.core.declaration import Port
from florence_bt.trees.findings import Finding
from florence_bt.trees.source import Position


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
    """

    parts: tuple[str | Reference, ...]
    position: Position


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


Value = Literal | Reference | Template | PoseParts


@dataclass(frozen=True, slots=True)
class Reasons:
    """``because``: the author's words for a node's failures.

    Attributes:
        always: The text for every failure, or None.
        by_code: Texts for failures with one code.
        position: Where it stands.
    """

    always: Value | None
    by_code: Mapping[str, Value]
    position: Position


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """What every node has.

    Attributes:
        position: Where its kind key stands.
        name: The name that the author gave, or None.
        reasons: ``because``, or None.
        cleanup: ``finally``, or None.
    """

    position: Position
    name: str | None = None
    reasons: Reasons | None = None
    cleanup: Node | None = None

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Sequence(Node):
    """``sequence``: one after the other until one fails."""

    children: tuple[Node, ...]
    memory: bool = True

    @property
    def parts(self) -> tuple[Node, ...]:
        """The children."""
        return self.children


@dataclass(frozen=True, slots=True, kw_only=True)
class Selector(Node):
    """``selector``: one after the other until one succeeds."""

    children: tuple[Node, ...]
    memory: bool = True

    @property
    def parts(self) -> tuple[Node, ...]:
        """The children."""
        return self.children


@dataclass(frozen=True, slots=True, kw_only=True)
class Parallel(Node):
    """``parallel``: all at the same time; done when all, or any one, succeeded."""

    children: tuple[Node, ...]
    any_is_enough: bool = False

    @property
    def parts(self) -> tuple[Node, ...]:
        """The children."""
        return self.children


@dataclass(frozen=True, slots=True, kw_only=True)
class Wrapper(Node):
    """A node with one node below."""

    child: Node

    @property
    def parts(self) -> tuple[Node, ...]:
        """The child."""
        return (self.child,)


@dataclass(frozen=True, slots=True, kw_only=True)
class Retry(Wrapper):
    """``retry``: again after a failure."""

    attempts: Value
    on: tuple[Literal, ...] = ()
    attempt_key: Literal | None = None

    @property
    def default_title(self) -> str:
        """Such as ``retry up to 8 times``."""
        return f"retry up to {show(self.attempts)} times"


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeat(Wrapper):
    """``repeat``: again after a success."""

    rounds: Value

    @property
    def default_title(self) -> str:
        """Such as ``repeat 3 times``."""
        return f"repeat {show(self.rounds)} times"


@dataclass(frozen=True, slots=True, kw_only=True)
class Timeout(Wrapper):
    """``timeout``: stopped when it takes too long."""

    duration: Value

    @property
    def default_title(self) -> str:
        """Such as ``within 30 s``."""
        return f"within {show(self.duration)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Invert(Wrapper):
    """``invert``: success becomes failure and failure success."""

    @property
    def default_title(self) -> str:
        """Such as ``not robot in room``."""
        return f"not {self.child.title}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Succeed(Wrapper):
    """``succeed``: a failure counts as success."""

    @property
    def default_title(self) -> str:
        """Such as ``try say hello``."""
        return f"try {self.child.title}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Fail(Node):
    """``fail``: fails with a reason."""

    reason: Value
    code: Literal | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Wait(Node):
    """``wait``: a pause."""

    duration: Value

    @property
    def default_title(self) -> str:
        """Such as ``wait 1 s``."""
        return f"wait {show(self.duration)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Set(Node):
    """``set``: writes keys."""

    values: tuple[tuple[Literal, Value], ...]

    @property
    def default_title(self) -> str:
        """Such as ``set goal``."""
        return "set " + ", ".join(key.text for key, _ in self.values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Use(Node):
    """``skill_name``: runs a skill.

    Attributes:
        skill: The name that was written; whether there is such a skill is for the checks.
        inputs: Input names and values.
        outputs: Output names and the keys that receive them.
        table_given: Whether the inputs were written as a table, or nothing was.
    """

    skill: str
    inputs: tuple[tuple[Literal, Value], ...] = ()
    outputs: tuple[tuple[Literal, Literal], ...] = ()
    table_given: bool = True

    @property
    def default_title(self) -> str:
        """Such as ``navigate to``."""
        return self.skill.replace("_", " ")


@dataclass(frozen=True, slots=True, kw_only=True)
class Call(Node):
    """``run``: runs another mission with keys of its own."""

    mission: Literal
    inputs: tuple[tuple[Literal, Value], ...] = ()
    outputs: tuple[tuple[Literal, Literal], ...] = ()

    @property
    def default_title(self) -> str:
        """Such as ``run detect_user``."""
        return f"run {self.mission.text}"


@dataclass(frozen=True, slots=True)
class Mission:
    """A mission file.

    Attributes:
        name: The name, equal to the file's stem.
        description: What it does, for people.
        file: The file.
        inputs: What a caller gives, in SI units.
        outputs: What it leaves in keys of these names when it succeeds.
        on_restart: ``abort``, ``restart`` or ``resume``: what follows when the executor died on it.
        tree: The root node; None when the file is too broken to have one.
        positions: Where the inputs and outputs are declared, by name.
        findings: What was wrong with the file's form.
    """

    name: str
    description: str
    file: Path
    inputs: Mapping[str, Port] = field(default_factory=dict)
    outputs: Mapping[str, Port] = field(default_factory=dict)
    on_restart: str = "abort"
    tree: Node | None = None
    positions: Mapping[str, Position] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    def required_inputs(self) -> tuple[str, ...]:
        """The inputs that a caller must give."""
        return tuple(name for name, port in self.inputs.items() if port.required)

    def nodes(self) -> Iterator[Node]:
        """Every node from the root down, clean-ups included."""
        if self.tree is not None:
            yield from walk(self.tree)


def walk(node: Node) -> Iterator[Node]:
    """A node and every node below it, clean-ups included, in the order of the file."""
    yield node
    for part in node.parts:
        yield from walk(part)
    if node.cleanup is not None:
        yield from walk(node.cleanup)


def references(value: Value) -> Iterator[Reference]:
    """Every key that a value needs."""
    match value:
        case Reference():
            yield value
        case Template(parts=parts):
            yield from (part for part in parts if isinstance(part, Reference))
        case PoseParts(x=x, y=y, yaw=yaw):
            for part in (x, y, yaw):
                yield from references(part)


def show(value: Value) -> str:
    """A value as the author wrote it, on one line."""
    match value:
        case Literal(text=text):
            return text
        case Reference(key=key):
            return f"${key}"
        case Template(parts=parts):
            return "".join(part if isinstance(part, str) else f"${part.key}" for part in parts)
        case PoseParts(x=x, y=y, yaw=yaw):
            return f"{{x: {show(x)}, y: {show(y)}, yaw: {show(yaw)}}}"
