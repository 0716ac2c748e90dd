"""A checked mission to a tree of behaviours."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, TypeVar

from py_trees.behaviour import Behaviour

from florence_bt.behaviours.annotations import Title, annotations_of, numbered
from florence_bt.behaviours.branch import Branch, take_ids
from florence_bt.behaviours.cleaning_up import Finally
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.decorators import StartGuard, While
from florence_bt.behaviours.expressions import CompiledExpression
from florence_bt.behaviours.keys import KeyStore, OwnKeys, TextTemplate, is_source, readable
from florence_bt.behaviours.until import Question
from florence_bt.behaviours.watching import Spot, Watch
from florence_bt.behaviours.why import Because
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import CodeGroup, Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.plain_yaml import Position
from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import Analysis, too_large
from florence_bt.trees.language.code_groups import by_code, codes_named
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.expressions.compiling import compile_expression
from florence_bt.trees.language.findings import raise_first_error
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Expression, Literal, Mission, Node, Value, Wrapper
from florence_bt.trees.language.node_kind import Call
from florence_bt.trees.language.quantities import format_value
from florence_bt.trees.language.values import kind_of, port_value, template_of, tree_value
from florence_bt.trees.language.vocabulary import GUARD_FAILED

Made = TypeVar("Made")


@dataclass(frozen=True)
class CompiledTree:
    """A mission that can be ticked.

    Attributes:
        root: The root of the tree.
        mission: What it was built from.
        keys: The keys of the mission.
    """

    root: Behaviour
    mission: Mission
    keys: KeyStore

    def outputs(self) -> dict[str, Any]:
        """Return the outputs that have been written so far, in SI units."""
        return {name: self.keys.read(name) for name in self.mission.outputs if name in self.keys}

    def output_texts(self) -> dict[str, str]:
        """Return the outputs as the mission language writes them, with units."""
        ports = self.mission.outputs
        return {name: format_value(value, ports[name].kind) for name, value in self.outputs().items()}


@dataclass(frozen=True, slots=True)
class Origin:
    """The part of a mission from which a behaviour was built.

    Attributes:
        mission: The mission whose file it stands in.
        node: The node of that file.
    """

    mission: Mission
    node: Node


def origin_of(behaviour: Behaviour) -> Origin | None:
    """Return what a behaviour was built from, None when it is only a part of what a node became."""
    origin = annotations_of(behaviour).origin
    return origin if isinstance(origin, Origin) else None


def compile_mission(
    mission: Mission,
    library: MissionLibrary,
    inputs: Mapping[str, Any],
    context: TreeContext,
    *,
    as_reached: bool = False,
) -> CompiledTree:
    """Build the tree of a mission.

    Args:
        mission: The mission, checked (``lint.check``).
        library: Where called missions are found.
        inputs: Every input in SI units, as ``parse_inputs`` returns them.
        context: What the tree's nodes share; its keys are set to the inputs.
        as_reached: Whether called missions, and what stands behind `when`, are built when they
            are first reached. Until then nodes with the same names and ids stand in for them, which many runs
            share. What is asked as a condition again and again, and clean-ups, are built at once.

    Raises:
        ConfigError: The mission, or one that it calls, has an error that a check would have found.
    """
    parts = _parts_of(library, context.declarations)
    if library.declarations:
        # A skill that is only declared fails with `no_skill` when it is started.
        context = replace(context, declarations=parts.analysis.declarations)
    if mission not in parts.fitting:
        for error in too_large(mission, parts.analysis):
            raise error
        parts.fitting.add(mission)
    declared = parts.get(mission, "keys", partial(_declared_keys, mission))
    context.keys.declare(declared, partial(parts.analysis.key_kinds, mission))
    context.keys.reset(inputs)
    if as_reached:
        whole = parts.get(mission, "whole", partial(_WholeTree, mission, parts))
        root = _TreeBuilder(mission, parts, context, (mission.name,), later=whole.branches).root(mission.name)
        take_ids(root, whole.root)
    else:
        root = _TreeBuilder(mission, parts, context, (mission.name,)).root(mission.name)
    return CompiledTree(root, mission, context.keys)


CallPath = tuple[Node | str, ...]
"""The beginning of a branch: the nodes of mission files that call, and the last one."""


class _WholeTree:
    """The tree of a mission with everything that it calls, never ticked: it stands in for what is not built.

    Args:
        mission: The mission.
        parts: What was made of the missions before.

    Attributes:
        root: The root.
        branches: What a run builds only when it is reached.
    """

    def __init__(self, mission: Mission, parts: _Parts) -> None:
        context = TreeContext(ManualClock(), lambda: None, {}, parts.analysis.declarations)
        self.branches: dict[CallPath, Behaviour] = {}
        builder = _TreeBuilder(mission, parts, context, (mission.name,), made=self.branches)
        self.root = builder.root(mission.name)


class _Parts:
    """The parts made of the missions of a library once, for all runs: whatever depends on no run.

    Args:
        library: The missions.
        declarations: The skills by name.

    Attributes:
        given: The skills, as they were.
        analysis: What is known of all missions and skills.
        fitting: The missions that are small enough to run, with those that they call.
    """

    def __init__(self, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]) -> None:
        self.given = dict(declarations)
        known = library.with_declared(declarations) if library.declarations else declarations
        self.analysis = Analysis(library, known)
        self.fitting: set[Mission] = set()
        self._made: dict[tuple[_Itself, object], Any] = {}

    def get(self, source: object, what: object, make: Callable[[], Made]) -> Made:
        """Return what is made of a part of a mission.

        Args:
            source: The part; two parts that look the same are two.
            what: Which of the things that are made of it.
            make: Makes it, the first time.
        """
        key = (_Itself(source), what)
        if key not in self._made:
            self._made[key] = make()
        made: Made = self._made[key]
        return made


class _Itself:
    """A part of a mission as the key of what is made of it: two parts that look the same are two."""

    __slots__ = ("_part",)

    def __init__(self, part: object) -> None:
        self._part = part

    def __hash__(self) -> int:
        return id(self._part)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and other._part is self._part


def _parts_of(library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]) -> _Parts:
    """Return what was made of a library before, as long as its missions and the skills are the same."""
    parts = library.compiled
    if not isinstance(parts, _Parts) or parts.given != declarations:
        parts = library.compiled = _Parts(library, declarations)
    return parts


@dataclass(frozen=True, slots=True)
class _Start:
    """The questions before a node starts.

    Attributes:
        name: The name of the guard.
        conditions: By ``when`` and ``while``.
    """

    name: str
    conditions: Mapping[str, CompiledExpression]


@dataclass(frozen=True, slots=True)
class _OfNode:
    """The parts made of a node of a mission file once, whatever its kind.

    Attributes:
        title: Its name in the tree.
        origin: What its behaviour was built from.
        because: The author's words for its failures: for all, and for those with a code.
        start: What is asked before it starts.
    """

    title: str
    origin: Origin
    because: tuple[TextTemplate | None, Mapping[str, TextTemplate]] | None
    start: _Start | None


@dataclass(frozen=True, eq=False)
class _TreeBuilder:
    """Builds the nodes of one call of one mission.

    Every method that builds a node is given whether a skipped node counts as failure there: it does where
    another one is tried then, or asked again. A node that has only this one to do is skipped with it, so this
    is seen through.

    Attributes:
        mission: The mission.
        parts: What was made of the missions before.
        context: The context with the keys of this call.
        callers: The names of the missions from the outermost to this one.
        call_path: Where this one is called.
        watch: The condition that is built; None: nobody watches here.
        later: The branches of the whole tree, to be built when they are reached. None: all is built at once.
        made: Takes such branches as they are built.
    """

    mission: Mission
    parts: _Parts
    context: TreeContext
    callers: tuple[str, ...]
    call_path: CallPath = ()
    watch: Watch | None = None
    later: Mapping[CallPath, Behaviour] | None = None
    made: dict[CallPath, Behaviour] | None = None

    def root(self, default_name: str | None = None) -> Behaviour:
        """Build the tree of the mission.

        Args:
            default_name: What the root is called unless the author says otherwise.

        Raises:
            ConfigError: The mission has an error that a check would have found.
        """
        raise_first_error(self.mission.findings)
        tree = self.mission.tree
        if tree is None:
            raise self.error(None, "the mission has no tree")
        name = None if tree.guards else tree.name or default_name
        root = self.node(tree, skipped_fails=False, name=name)
        if tree.guards and default_name:
            root.name = default_name
        return root

    def node(self, node: Node, *, skipped_fails: bool, name: str | None = None) -> Behaviour:
        """Build a node with everything below it, its guards and its clean-up."""
        of = self.parts.get(node, "node", partial(self._of_node, node))
        name = _one_step(name) if name else of.title
        if self.watch is not None:
            self._depend(node, self.watch)
        if of.start is None:
            behaviour = self._guarded(node, name, skipped_fails)
        else:
            guarded = partial(self._guarded, node, name, skipped_fails)
            behaviour = self._start_guard(node, of.start, guarded, skipped_fails)
        annotations = annotations_of(behaviour)
        annotations.origin = of.origin
        if of.because is not None:
            annotations.because = Because(self.context.keys, *of.because)
        return behaviour

    def _of_node(self, node: Node) -> _OfNode:
        """Return what is made of a node once."""
        # A clean-up belongs to what was started: `while` is then asked before both, and watched inside.
        holds = node.holds if node.cleanup is not None else None
        asked = {"when": node.when, "while": holds}
        guards = {word: guard for word, guard in asked.items() if guard is not None}
        start = None
        if guards:
            name = _one_step(", ".join(f"{word} {guard.text}" for word, guard in guards.items()))
            start = _Start(name, {word: self.condition(guard) for word, guard in guards.items()})
        groups = self.parts.analysis.groups
        because = _texts_of(node.reasons, groups) if node.reasons is not None else None
        return _OfNode(_one_step(node.title), Origin(self.mission, node), because, start)

    def _depend(self, node: Node, watch: Watch) -> None:
        """Have a condition asked again when a key changes that a node of it reads to decide something."""
        keys = {key for expression in node.expressions for key in expression.keys}
        if node.decides_by_values:
            keys |= {each.key for value in node.reads for each in model.references(value)}
        if keys:
            self.context.keys.watch(keys, Spot(watch, keeps=False).change)

    def spot(self) -> Spot | None:
        """Return the place of a leaf in the condition that is watched here; None: nobody watches."""
        return Spot(self.watch) if self.watch is not None else None

    # ---- guards and clean-ups -------------------------------------------------------------------------

    def _guarded(self, node: Node, name: str, skipped_fails: bool) -> Behaviour:
        """Build what the conditions for the start of a node stand before."""
        if node.cleanup is None:
            return self._while(node, node.build(self, name, skipped_fails))
        return self._finally(node, node.cleanup, name, skipped_fails)

    def _finally(self, node: Node, cleanup: Node, name: str, skipped_fails: bool) -> Behaviour:
        def make_cleanup(context: TreeContext) -> Behaviour:
            own = context.with_keys(self.context.keys)
            builder = replace(self, context=own, watch=None, later=None, made=None)
            return builder.node(cleanup, skipped_fails=False)

        body = self._while(node, node.build(self, _one_step(node.default_title), skipped_fails))
        return Finally(name, self.context, body, make_cleanup, self.spot())

    def _while(self, node: Node, behaviour: Behaviour) -> Behaviour:
        if node.holds is None:
            return behaviour
        name = _one_step(f"while {node.holds.text}")
        code = node.own_failure(GUARD_FAILED)
        return While(name, behaviour, self.context, self.condition(node.holds), code)

    def _start_guard(
        self, node: Node, start: _Start, guarded: Callable[[], Behaviour], skipped_fails: bool
    ) -> Behaviour:
        path = (*self.call_path, node, "guarded")
        conditions = start.conditions
        return StartGuard(
            start.name,
            self._branch(path, guarded),
            self.context,
            conditions.get("when"),
            conditions.get("while"),
            code=node.own_failure(GUARD_FAILED),
            skipped_fails=skipped_fails,
        )

    # ---- branches that are built when they are reached ------------------------------------------------

    def _branch(self, path: CallPath, build: Callable[[], Behaviour]) -> Behaviour | Branch:
        """Build what a node does when reached, later; what is watched and a clean-up: at once."""
        # The places of a condition are counted in the order in which its nodes are built.
        if self.later is not None and self.watch is None:
            return Branch(build, self.later[path])
        branch = build()
        if self.made is not None:
            self.made[path] = branch
        return branch

    # ---- nodes below ------------------------------------------------------------------------------------

    def children(self, nodes: Iterable[Node], *, skipped_fails: bool) -> list[Behaviour]:
        """Build several nodes below, with numbers where names are equal."""
        return numbered([self.node(node, skipped_fails=skipped_fails) for node in nodes])

    def child(self, node: Wrapper, skipped_fails: bool) -> Behaviour:
        """Build the node below a node, with the keys that belong to it."""
        fails = node.skip_fails_below(skipped_fails)
        return self.inside(node, node.child).node(node.child, skipped_fails=fails)

    def watching(self, node: Node, *, skipped_fails: bool) -> tuple[list[Behaviour], list[Watch | None]]:
        """Build the parts of a node, with the watch of each that it watches; None: it needs none."""
        guards = set(node.watched)
        watches: list[Watch] = []
        children = []
        for part in node.parts:
            builder = self
            if part in guards:
                watches.append(Watch(self.context, self.watch))
                builder = replace(self, watch=watches[-1])
            fails = node.fails_when_skipped(part, skipped_fails)
            children.append(builder.node(part, skipped_fails=fails))
        return numbered(children), [watch if watch.needed else None for watch in watches]

    def call(self, node: kinds.CallMission) -> Call:
        """Build the tree of a mission that is called, or leave that until it is reached."""
        called = node.mission.text
        if called in self.callers:
            chain = " -> ".join((*self.callers, called))
            raise self.error(node.position, f"the mission {called!r} calls itself: {chain}")
        mission = self.parts.analysis.library.get(called)
        keys = KeyStore()
        declared = self.parts.get(mission, "keys", partial(_declared_keys, mission))
        keys.declare(declared, partial(self.parts.analysis.key_kinds, mission))
        path = (*self.call_path, node)
        called_context = self.context.with_keys(keys)
        callers = (*self.callers, called)
        builder = replace(self, mission=mission, context=called_context, callers=callers, call_path=path)
        return Call(mission, keys, self._branch(path, builder.root))

    def inside(self, node: Node, part: Node) -> _TreeBuilder:
        """Return what builds a part of a node: with its own keys, and watched if the node passes that on."""
        builder = self if node.passes_on else replace(self, watch=None)
        own = node.own_keys(part)
        if not own:
            return builder
        return replace(builder, context=self.context.with_keys(OwnKeys(self.context.keys, own)))

    def keep_watched(self) -> None:
        """Keep what is watched here: it is asked anew only when it has ended."""
        if self.watch is not None:
            self.watch.keep()

    def question(self, node: Node) -> Question:
        """Build what is asked until it succeeds: watched when it only asks."""
        if self.parts.analysis.of(self.mission).of(node).acts:
            if self.watch is not None:
                self.watch.keep()
            return Question(self.context, self.node(node, skipped_fails=True), None)
        watch = Watch(self.context, self.watch)
        return Question(self.context, replace(self, watch=watch).node(node, skipped_fails=True), watch)

    def codes(self, words: Iterable[Literal]) -> frozenset[str]:
        """Return the codes that some codes and groups stand for."""
        return frozenset().union(*(codes_named(word.text, self.parts.analysis.groups) for word in words))

    def text(self, value: Value) -> TextTemplate:
        """Return a text, with the values of keys as people write them."""
        make = partial(template_of, kinds=self._kinds_for(value))
        return self.parts.get(value, "text", lambda: self._placed(value, make))

    def declaration(self, node: kinds.RunSkill) -> SkillDeclaration:
        """Return what a skill declares."""
        declaration = self.context.declarations.get(node.skill)
        if declaration is None:
            known = closest_first(node.skill, self.context.declarations)
            raise self.error(node.position, f"unknown skill {node.skill!r}", known)
        return declaration

    def titled(self, node: Node, behaviour: Behaviour, value: Any, kind: Kind | None) -> Behaviour:
        """Let a dump show the value that stands in a title as ``$key``, once it is known."""
        if node.name is None and is_source(value):
            shown = partial(format_value, kind=kind) if kind is not None else readable
            written = _one_step(model.show(node.reads[0]))
            annotations_of(behaviour).title = Title(written, value, self.context.keys, shown)
        return behaviour

    # ---- values ---------------------------------------------------------------------------------------

    @cached_property
    def key_kinds(self) -> Mapping[str, Kind]:
        """The kinds of the mission's keys, as far as they are known."""
        return self.parts.analysis.key_kinds(self.mission)

    def condition(self, expression: Expression) -> CompiledExpression:
        """Compile an expression that is true or false."""
        return self.parts.get(expression, "condition", lambda: self._make_condition(expression))

    def _make_condition(self, expression: Expression) -> CompiledExpression:
        for problem in check_kinds(expression, self.key_kinds, Kind.BOOLEAN).problems:
            raise self.error(problem.position, problem.message, problem.valid)
        return compile_expression(expression, self.key_kinds)

    def value(self, value: Value, kind: Kind | None) -> Any:
        """Return a value in SI units, or a value source."""

        def make() -> Any:
            return self._placed(value, partial(tree_value, kind=kind, kinds=self._kinds_for(value)))

        return self.parts.get(value, kind, make)

    def inputs(
        self, pairs: Iterable[tuple[Literal, Value]], ports: Mapping[str, Port], problem: str
    ) -> dict[str, Any]:
        """Return the inputs of a skill or a mission, as given."""
        return self.parts.get(pairs, "inputs", lambda: self._make_inputs(pairs, ports, problem))

    def _make_inputs(
        self, pairs: Iterable[tuple[Literal, Value]], ports: Mapping[str, Port], problem: str
    ) -> dict[str, Any]:
        inputs = {}
        for name, value in pairs:
            port = ports.get(name.text)
            if port is None:
                raise self.error(name.position, f"{problem} {name.text!r}", closest_first(name.text, ports))
            said = port.kind is Kind.TEXT and isinstance(value, model.Reference)
            read = partial(port_value, port=port, kinds=self.key_kinds if said else self._kinds_for(value))
            inputs[name.text] = self._placed(value, read)
        return inputs

    def kind_of(self, value: Value) -> Kind | None:
        """Return the kind of a value, None when it is not known."""
        return kind_of(value, self.key_kinds)

    @property
    def declared_keys(self) -> Mapping[str, Port]:
        """The keys that the mission declares."""
        return self.mission.keys

    @property
    def groups(self) -> Mapping[str, CodeGroup]:
        """The groups of failure codes, by name."""
        return self.parts.analysis.groups

    def _kinds_for(self, value: Value) -> Mapping[str, Kind]:
        """Return the keys' kinds, whose search walks the mission, for expressions; others need none."""
        parts: tuple[Value, ...] = (value,)
        if isinstance(value, model.PoseParts):
            parts = (value.x, value.y, value.yaw)
        elif isinstance(value, model.ListItems):
            parts = value.items
        return self.key_kinds if any(isinstance(part, Expression) for part in parts) else {}

    def _placed(self, value: Value, read: Callable[[Value], Any]) -> Any:
        try:
            return read(value)
        except ConfigError as error:
            inside = Position(error.line, error.column or 1) if error.line else value.position
            raise self.error(inside, error.problem, error.valid) from error

    def error(self, position: Position | None, problem: str, valid: Iterable[str] = ()) -> ConfigError:
        """Return an error that a check would have found, at its place in the file."""
        line, column = (position.line, position.column) if position is not None else (None, None)
        return ConfigError(problem, file=self.mission.file, line=line, column=column, valid=valid)


def _texts_of(
    reasons: model.Reasons, groups: Mapping[str, CodeGroup]
) -> tuple[TextTemplate | None, dict[str, TextTemplate]]:
    """Return the author's words for every failure, and for those with a code."""
    texts = by_code(((word, template_of(text)) for word, text in reasons.by_code.items()), groups)
    return (template_of(reasons.always) if reasons.always is not None else None), texts


def _declared_keys(mission: Mission) -> dict[str, Port]:
    """Return what the declared keys of a mission hold; outputs and inputs are keys too, without limits."""
    outputs = {name: Port(port.kind, port.description) for name, port in mission.outputs.items()}
    inputs = {name: Port(port.kind, port.description) for name, port in mission.inputs.items()}
    return {**outputs, **inputs, **mission.keys}


def _one_step(name: str) -> str:
    """Return a name that is one step of a path: the slash between steps stands in no name."""
    return name.replace("/", "\N{DIVISION SLASH}")
