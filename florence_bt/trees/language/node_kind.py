"""The record of a kind of node, beside its node, and what builds a node of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from florence_bt.core.declaration import CodeGroup, Kind, Port, SkillDeclaration

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.behaviours.branch import Branch
    from florence_bt.behaviours.context import TreeContext
    from florence_bt.behaviours.expressions import CompiledExpression
    from florence_bt.behaviours.keys import KeyStore, TextTemplate
    from florence_bt.behaviours.until import Question
    from florence_bt.behaviours.watching import Spot, Watch
    from florence_bt.core.errors import ConfigError
    from florence_bt.core.plain_yaml import Position
    from florence_bt.trees.kinds.call_mission import CallMission
    from florence_bt.trees.kinds.run_skill import RunSkill
    from florence_bt.trees.language.findings import FindingList
    from florence_bt.trees.language.model import Expression, Literal, Mission, Node, Value, Wrapper


@dataclass(frozen=True, slots=True)
class Modifier:
    """A word beside the kind key of a node.

    Attributes:
        word: The word.
        about: What it does, for people.
        value: The JSON Schema of what stands behind it.
        never_input: Whether it is no good name for an input: found among them, it is indented too far.
        names_key: Whether it is given a key, which the node writes.
    """

    word: str
    about: str
    value: Mapping[str, Any]
    never_input: bool = False
    names_key: bool = False


@dataclass(frozen=True, slots=True)
class NodeKind:
    """The facts about a kind of node that are the same for all its nodes.

    Attributes:
        word: The kind key.
        about: What the node does, for people.
        symbol: A sign for it in drawings.
        value: The JSON Schema of what stands behind the kind key.
        example: A node of it, as the palette of the editor inserts it.
        modifiers: The modifiers that it takes beside those that every node has, in the order of the manual.
        needed: The modifiers that it cannot be without.
        argument: How the value before a ``do`` is written, for messages.
        failures: The codes of failures that are its own -> what they mean.
        others: What other languages and people call it.
        names_keys: Whether keys that the node writes stand behind the kind key.
    """

    word: str
    about: str
    symbol: str
    value: Mapping[str, Any]
    example: str = ""
    modifiers: tuple[Modifier, ...] = ()
    needed: tuple[str, ...] = ()
    argument: str = ""
    failures: Mapping[str, str] = field(default_factory=dict)
    others: tuple[str, ...] = ()
    names_keys: bool = False


@dataclass(frozen=True, slots=True)
class KnownKinds:
    """The kinds of values, as far as they are known when a node says what it writes.

    Attributes:
        of: Gives the kind of a value, None when it is not known.
        outputs: Gives the outputs of a skill or called mission with their kinds.
    """

    of: Callable[[Value], Kind | None]
    outputs: Callable[[Node], Mapping[str, Kind]]


class NodeChecks(Protocol):
    """The tools with which a node checks its values."""

    @property
    def findings(self) -> FindingList:
        """Receives what is wrong."""
        ...

    @property
    def kinds(self) -> Mapping[str, Kind]:
        """The kinds of the inputs and keys of the mission, as far as they are known."""
        ...

    @property
    def declared_keys(self) -> Mapping[str, Port]:
        """The keys that the mission declares."""
        ...

    def kind_of(self, value: Value) -> Kind | None:
        """Return the kind of a value, None when it is not known."""

    def choices_of(self, value: Value) -> tuple[str, ...]:
        """Return the texts that a value can only have, none when it can be any."""

    def value(self, value: Value, port: Port | None, what: str) -> None:
        """Check a value; ``what`` is what it is called in messages, and no port takes anything."""

    def text(self, value: Value, what: str) -> bool:
        """Check a text with keys in it; says whether something was warned of."""

    def condition(self, expression: Expression, what: str) -> None:
        """Check an expression that must give true or false."""


@dataclass(frozen=True, slots=True)
class Call:
    """A mission that is called.

    Attributes:
        mission: The mission.
        keys: Its keys.
        tree: Its tree, or what builds it when it is reached.
    """

    mission: Mission
    keys: KeyStore
    tree: Behaviour | Branch


class TreeBuilder(Protocol):
    """The tools with which a node is built, for one call of one mission.

    A skipped node counts as failure where another one is tried then, or asked again. A node that has only
    this one to do is skipped with it, so this is seen through.
    """

    @property
    def context(self) -> TreeContext:
        """Give what the nodes of the tree share, with the keys as they are seen here."""
        ...

    @property
    def groups(self) -> Mapping[str, CodeGroup]:
        """The groups of failure codes, by name."""
        ...

    @property
    def declared_keys(self) -> Mapping[str, Port]:
        """The keys that the mission declares."""
        ...

    @property
    def key_kinds(self) -> Mapping[str, Kind]:
        """The kinds of the keys of the mission, as far as they are known."""
        ...

    # ---- nodes below ----------------------------------------------------------------------------------

    def node(self, node: Node, *, skipped_fails: bool) -> Behaviour:
        """Build a node below, with its guards and its clean-up."""

    def child(self, node: Wrapper, skipped_fails: bool) -> Behaviour:
        """Build the node below a node, with the keys that belong to it."""

    def children(self, nodes: Iterable[Node], *, skipped_fails: bool) -> list[Behaviour]:
        """Build several nodes below, with numbers where names are equal."""

    def watching(self, node: Node, *, skipped_fails: bool) -> tuple[list[Behaviour], list[Watch | None]]:
        """Build the parts of a node, with the watch of each that it watches; None: it needs none."""

    def question(self, node: Node) -> Question:
        """Build what is asked until it succeeds: watched when it only asks."""

    def call(self, node: CallMission) -> Call:
        """Build the tree of a mission that is called, or leave that until it is reached."""

    def inside(self, node: Node, part: Node) -> TreeBuilder:
        """Return what builds a part of a node: with the keys that belong to it."""

    # ---- what is watched ------------------------------------------------------------------------------

    def spot(self) -> Spot | None:
        """Return the place of a leaf in the condition that is watched here; None: nobody watches."""

    def keep_watched(self) -> None:
        """Keep what is watched here: it is asked anew only when it has ended."""

    # ---- values ---------------------------------------------------------------------------------------

    def value(self, value: Value, kind: Kind | None) -> Any:
        """Return a value in SI units, or a value source."""

    def text(self, value: Value) -> TextTemplate:
        """Return a text, with the values of keys as people write them."""

    def condition(self, expression: Expression) -> CompiledExpression:
        """Compile an expression that is true or false."""

    def kind_of(self, value: Value) -> Kind | None:
        """Return the kind of a value, None when it is not known."""

    def codes(self, words: Iterable[Literal]) -> frozenset[str]:
        """Return the codes that some codes and groups stand for."""

    def declaration(self, node: RunSkill) -> SkillDeclaration:
        """Return what a skill declares."""

    def inputs(
        self, pairs: Iterable[tuple[Literal, Value]], ports: Mapping[str, Port], problem: str
    ) -> dict[str, Any]:
        """Return the inputs of a skill or a mission; ``problem`` begins the message about one it lacks."""

    def titled(self, node: Node, behaviour: Behaviour, value: Any, kind: Kind | None) -> Behaviour:
        """Let a dump show the value that stands in a title as ``$key``, once it is known."""

    def error(self, position: Position | None, problem: str, valid: Iterable[str] = ()) -> ConfigError:
        """Return an error that a check would have found, at its place in the file."""
