"""What flows through the blackboard of all trees: uses of keys, inputs and outputs of trees, kinds of keys.

A mission has keys of its own, and gets and gives values at its start and end. A tree of BehaviorTree.CPP
shares entries of the blackboard with its caller. So for each tree it is found out what it reads before it
writes it (inputs), and what it writes that its caller sees (outputs).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from florence_bt.btcpp.document import Document, Tree
from florence_bt.btcpp.mission_text import read_flow
from florence_bt.btcpp.names import Names
from florence_bt.btcpp.node_models import (
    NodeModel,
    PortModel,
    category_of,
    known_nodes,
    nav2_nodes,
    nav2_port,
)
from florence_bt.btcpp.script import AssignmentExpr, hints_in, literal_kind, names_in, parse_script
from florence_bt.btcpp.values import guess_kind
from florence_bt.btcpp.vocabulary import (
    CATEGORIES,
    LOOP_KINDS,
    POST_CONDITIONS,
    PRE_CONDITIONS,
    PREFIX,
    private_key,
)
from florence_bt.btcpp.xml_source import Element
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError

READ, WRITE, UNKNOWN = "read", "write", "unknown"

_BUILTIN_KINDS = {
    "num_attempts": Kind.INTEGER,
    "num_cycles": Kind.INTEGER,
    "msec": Kind.INTEGER,
    "delay_msec": Kind.INTEGER,
}
_REFERENCE = re.compile(r"\$(?:([a-z][a-z0-9_]*)|\{([a-z][a-z0-9_]*)\})")
_NO_PORTS = ("ID", "name", "_autoremap")


@dataclass(frozen=True, slots=True)
class KeyUse:
    """One use of a key.

    Attributes:
        key: The key as written, without braces.
        access: ``read``, ``write`` or ``unknown``.
        kind: The kind that the place asks for or gives, None when it is not known.
        port: The node and port that it stands in, when the kind must be guessed from all its uses.
        element: The element.
        pointed: Whether a port points to it; else it is a name in a script.
        hint: The kind of what it is compared with, which counts when nothing else gives the kind.
    """

    key: str
    access: str
    kind: Kind | None
    port: tuple[str, str] | None
    element: Element
    pointed: bool = True
    hint: Kind | None = None


def pointer(value: str, attribute: str) -> str | None:
    """The key that a value of a port points to: ``{key}``, ``{=}``; None when it is a literal."""
    text = value.strip()
    if len(text) < 3 or not (text.startswith("{") and text.endswith("}")):
        return None
    inner = text[1:-1].strip()
    return attribute if inner == "=" else inner or None


def registration(element: Element) -> str:
    """The ID of the node that an element makes."""
    return element.get("ID") if element.tag in CATEGORIES else element.tag


@dataclass(frozen=True)
class Ports:
    """What is known about the ports of nodes.

    Attributes:
        declarations: The skills of this installation, by name.
        skill_of: Registration ID -> name of the skill.
        models: What the files declare, by registration ID.
    """

    declarations: Mapping[str, SkillDeclaration]
    skill_of: Mapping[str, str]
    models: Mapping[str, NodeModel]

    def model(self, name: str) -> NodeModel | None:
        """What is declared about a node, by its registration ID."""
        return self.models.get(name) or nav2_nodes().get(name)

    def skill(self, name: str) -> SkillDeclaration | None:
        """The skill of this installation that a node is, by its registration ID."""
        return self.declarations.get(self.skill_of.get(name, name))

    def mapped_by_default(self, tree: str) -> dict[str, str]:
        """The ports of a tree that go to a key, as its model says, where a call does not say."""
        model = self.models.get(tree)
        if model is None or model.category != "SubTree":
            return {}
        return {
            name: port.default
            for name, port in model.ports.items()
            if port.default and pointer(port.default, name) not in (None, private_key(tree, name))
        }

    def port(self, name: str, port: str) -> PortModel | None:
        """What is known about a port; the skills of this installation know best."""
        skill = self.skill(name)
        if skill is not None:
            found, direction = port_of_skill(skill, port)
            return PortModel(direction, found.kind, found.description) if found is not None else None
        model = self.models.get(name)
        if model is not None:
            return model.ports.get(port)
        return nav2_port(name, port)


def port_of_skill(skill: SkillDeclaration, port: str) -> tuple[Port | None, str]:
    """The input or output that an attribute stands for, and its direction.

    An output that is called like an input is written with ``out_`` before its name.
    """
    if port in skill.inputs:
        return skill.inputs[port], "in"
    bare = port.removeprefix("out_")
    if port in skill.outputs:
        return skill.outputs[port], "out"
    return (skill.outputs[bare], "out") if bare in skill.outputs and bare in skill.inputs else (None, "in")


def uses_of(element: Element, ports: Ports) -> Iterator[KeyUse]:
    """The keys that one element uses by itself, in the order of time; calls of subtrees are left out."""
    for name in PRE_CONDITIONS:
        yield from script_uses(element.get(name), element)
    yield from _own(element, ports)
    for name in POST_CONDITIONS:
        yield from script_uses(element.get(name), element)


def _own(element: Element, ports: Ports) -> Iterator[KeyUse]:
    match element.tag:
        case "Script" | "ScriptCondition":
            yield from script_uses(element.get("code"), element)
        case "Precondition":
            yield from script_uses(element.get("if"), element)
        case "SetBlackboard":
            yield from _set_blackboard(element)
        case "SubTree":
            return
        case tag if tag.startswith("Florence"):
            yield from _florence(element)
        case _:
            found = list(_ports(element, ports))
            yield from (use for use in found if use.access != WRITE)
            yield from (use for use in found if use.access == WRITE)


def _set_blackboard(element: Element) -> Iterator[KeyUse]:
    value, target = element.get("value"), element.get("output_key")
    source = pointer(value, "value")
    if source is not None:
        yield KeyUse(source, READ, None, None, element)
    name = pointer(target, "output_key") or target
    if name:
        yield KeyUse(name, WRITE, None, ("SetBlackboard", str(id(element))), element)


def _florence(element: Element) -> Iterator[KeyUse]:
    for name, value in element.attributes.items():
        key = pointer(value, name)
        if name.startswith("_") or name in _NO_PORTS:
            continue
        if key is not None:
            written = _is_output(element.tag, name)
            yield KeyUse(key, WRITE if written else READ, Kind.INTEGER if written else None, None, element)
        elif name in ("when", "unless", "while", "code", "values") or value.startswith(PREFIX):
            yield from own_references(value, element)
        if name == "values":
            yield from (KeyUse(key, WRITE, None, None, element) for key in _set_keys(value))


def _is_output(tag: str, port: str) -> bool:
    model = known_nodes().get(tag)
    return model is not None and port in model.ports and model.ports[port].direction == "out"


def _set_keys(text: str) -> list[str]:
    try:
        values = read_flow(f"{{{text}}}")
    except ConfigError:
        return []  # converting it reports the problem
    return list(values) if isinstance(values, dict) else []


def own_references(text: str, element: Element) -> Iterator[KeyUse]:
    """The keys in a text of the mission language."""
    for plain, braced in _REFERENCE.findall(text.replace("$$", "")):
        yield KeyUse(plain or braced, READ, None, None, element)


def _ports(element: Element, ports: Ports) -> Iterator[KeyUse]:
    name, builtin = registration(element), category_of(element.tag) is not None
    for attribute, value in element.attributes.items():
        if attribute in _NO_PORTS or attribute.startswith("_"):
            continue
        if value.startswith(PREFIX):
            yield from own_references(value, element)
            continue
        key = pointer(value, attribute)
        if key is None:
            continue
        if builtin:
            if attribute == "value" and element.tag in LOOP_KINDS:
                yield KeyUse(key, WRITE, LOOP_KINDS[element.tag], None, element)
            else:
                yield KeyUse(key, READ, _BUILTIN_KINDS.get(attribute), None, element)
            continue
        model = ports.port(name, attribute)
        kind = model.kind if model else None
        guessed = None if kind is not None else (name, attribute)
        if model is None:
            yield KeyUse(key, UNKNOWN, kind, guessed, element)
        if model is not None and model.direction in ("in", "inout"):
            yield KeyUse(key, READ, kind, guessed, element)
        if model is not None and model.direction in ("out", "inout"):
            yield KeyUse(key, WRITE, kind, guessed, element)


def script_uses(text: str, element: Element) -> Iterator[KeyUse]:
    """The keys of a script; a script that cannot be read uses none (converting it reports the problem)."""
    try:
        statements = parse_script(text)
    except ConfigError:
        return
    for code in statements:
        hints = dict(hints_in(code))
        kinds = {code.name: literal_kind(code.value)} if isinstance(code, AssignmentExpr) else {}
        for name, written in names_in(code):
            kind = kinds.get(name) if written else None
            hint = None if written else hints.get(name)
            yield KeyUse(name, WRITE if written else READ, kind, None, element, False, hint)


CONCURRENT = frozenset(
    {
        "FlorenceParallel",
        "Parallel",
        "ParallelAll",
        "PipelineSequence",
        "ReactiveFallback",
        "ReactiveSequence",
        "WhileDoElse",
    }
)
"""Controls that go on with several of their nodes, or come back to earlier ones."""


Member = tuple[str, str, str]
"""``("key", tree, key)`` or ``("port", node, port)``."""

_PLAIN = (Kind.INTEGER, Kind.NUMBER)


class Classes:
    """A union-find structure."""

    def __init__(self) -> None:
        self._parents: dict[Member, Member] = {}
        self._kinds: dict[Member, dict[Kind, None]] = {}
        self._hints: dict[Member, dict[Kind, None]] = {}

    def join(self, one: Member, other: Member) -> None:
        """Say that two hold the same values."""
        first, second = self._root(one), self._root(other)
        if first != second:
            self._parents[second] = first
            self._kinds.setdefault(first, {}).update(self._kinds.pop(second, {}))
            self._hints.setdefault(first, {}).update(self._hints.pop(second, {}))

    def add(self, member: Member, kind: Kind) -> None:
        """Note that a value of this kind was seen."""
        self._kinds.setdefault(self._root(member), {})[kind] = None

    def hint(self, member: Member, kind: Kind) -> None:
        """Note a kind that counts when no value was seen: that of what it is compared with."""
        self._hints.setdefault(self._root(member), {})[kind] = None

    def kind(self, member: Member) -> Kind | None:
        """The kind that fits what was seen, None when nothing was.

        A quantity stands above plain numbers, which have no unit in the XML; what does not fit together is a
        text.
        """
        root = self._root(member)
        seen = self._kinds.get(root) or self._hints.get(root, {})
        special = [kind for kind in seen if kind not in _PLAIN]
        if len(special) == 1 and (special[0] not in (Kind.TEXT, Kind.BOOLEAN, Kind.POSE) or len(seen) == 1):
            return special[0]
        if special:
            return Kind.TEXT
        return Kind.NUMBER if Kind.NUMBER in seen else Kind.INTEGER if seen else None

    def _root(self, member: Member) -> Member:
        root = member
        while self._parents.get(root, root) != root:
            root = self._parents[root]
        while self._parents.get(member, member) != root and member != root:
            self._parents[member], member = root, self._parents[member]
        return root


MAX_SHARED = 20_000
"""Most keys that all calls of trees together share."""
ROOT = "@"
"""Before a key of the outermost blackboard."""


@dataclass(frozen=True, slots=True)
class SubTreeCall:
    """A ``<SubTree>``.

    Attributes:
        element: The element.
        tree: The ID that is called.
        keys: Port -> key of the caller.
        literals: Port -> value written out.
        autoremap: Whether all further keys are those of the caller.
    """

    element: Element
    tree: str
    keys: dict[str, str]
    literals: dict[str, str]
    autoremap: bool


@dataclass
class TreeFlow:
    """What is known about one tree.

    Attributes:
        tree: The tree.
        events: Uses of keys and calls in the order of the file.
        inputs: The keys that it reads before it writes them.
        outputs: The keys that it writes and its callers see.
        written: All keys that it writes.
        guessed: The keys whose direction was guessed.
        passed: The keys that called trees use without a port of the call (see :meth:`DataFlow.mapping`).
        names: Our names of its keys.
    """

    tree: Tree
    events: list[KeyUse | SubTreeCall]
    inputs: list[str] = field(default_factory=list)
    outputs: list[str] = field(default_factory=list)
    written: dict[str, None] = field(default_factory=dict)
    guessed: dict[str, KeyUse] = field(default_factory=dict)
    passed: dict[str, None] = field(default_factory=dict)
    names: Names = field(default_factory=lambda: Names("key"))
    _writers: dict[str, set[Element]] | None = None

    @cached_property
    def pointed(self) -> frozenset[str]:
        """The keys that a port points to, so that they are certainly keys."""
        used = {event.key for event in self.events if isinstance(event, KeyUse) and event.pointed}
        return frozenset(used | {key for call in self.calls for key in call.keys.values()})

    @cached_property
    def calls_by_element(self) -> dict[Element, SubTreeCall]:
        """The calls by their elements."""
        return {call.element: call for call in self.calls}

    @cached_property
    def writing_ports(self) -> frozenset[tuple[str, str]]:
        """The ports of nodes of this tree that write keys: (registration ID, port)."""
        uses = (event for event in self.events if isinstance(event, KeyUse))
        return frozenset(use.port for use in uses if use.port is not None and use.access == WRITE)

    @cached_property
    def _parents(self) -> dict[Element, Element]:
        return {child: parent for parent in self.tree.root.walk() for child in parent.children}

    def _with_parents(self, element: Element) -> Iterator[Element]:
        """An element and all above it, the innermost first."""
        above: Element | None = element
        while above is not None:
            yield above
            above = self._parents.get(above)

    def _concurrent_above(self, element: Element) -> Element | None:
        """The outermost control above an element that goes on with several of its nodes."""
        _, *above = self._with_parents(element)
        return next((each for each in reversed(above) if each.tag in CONCURRENT), None)

    def local(self, key: str, main: str | None) -> str:
        """A key as it is called in this tree: in the main tree the outermost blackboard is its own."""
        return key.removeprefix(ROOT) if self.tree.name == main else key

    def key_name(self, key: str, main: str | None) -> str:
        """Our name of a key."""
        return self.names.of(self.local(key, main))

    def all_inputs(self, facts: DataFlow) -> list[str]:
        """The keys that callers give: those that are declared, and those that are read first."""
        declared = facts.declared(self.tree.name, "in")
        return [*declared, *(key for key in self.inputs if key not in declared)]

    def all_outputs(self, facts: DataFlow) -> list[str]:
        """The keys that callers get: those that are declared and written, and those that they ask for."""
        declared = facts.declared(self.tree.name, "out")
        return [*declared, *(key for key in self.outputs if key not in declared)]

    def input_name(self, key: str, facts: DataFlow) -> str:
        """Our name of an input: a key that is written too needs another one."""
        both = key in self.written and key in self.all_inputs(facts)
        return self.names.of(f"before {key}" if both else key)

    def may_change(self, element: Element, key: str, facts: DataFlow) -> bool:
        """Whether something may write a key while a branch of an element runs: below it, or beside it."""
        if self._writers is None:
            self._writers = self._find_writers(facts)
        found = self._writers.get(key, set())
        return element in found or self._concurrent_above(element) in found

    def _find_writers(self, facts: DataFlow) -> dict[str, set[Element]]:
        """Each key with the elements that write it, and all above them."""
        found: dict[str, set[Element]] = {}
        for event in self.events:
            for key in facts.writes(self.tree.name, event):
                found.setdefault(key, set()).update(self._with_parents(event.element))
        return found

    def uses_below(self, elements: list[Element]) -> Iterator[KeyUse]:
        """The uses of keys in some elements and below them."""
        inside = {below for element in elements for below in element.walk()}
        return (e for e in self.events if isinstance(e, KeyUse) and e.element in inside)

    def is_ticked_again(self, element: Element) -> bool:
        """Whether an element can be ticked after its end, but not by a ``PipelineSequence`` just above."""
        above = self._concurrent_above(element)
        return above is not None and not (above.tag == "PipelineSequence" and element in above.children)

    @cached_property
    def read_keys(self) -> frozenset[str]:
        """The keys that something reads."""
        return frozenset(e.key for e in self.events if isinstance(e, KeyUse) and e.access == READ)

    @property
    def calls(self) -> Iterator[SubTreeCall]:
        """The calls of other trees."""
        return (event for event in self.events if isinstance(event, SubTreeCall))

    @property
    def keys(self) -> dict[str, None]:
        """Every key that appears, in the order of the file."""
        found: dict[str, None] = {}
        for event in self.events:
            for key in [event.key] if isinstance(event, KeyUse) else event.keys.values():
                found[key] = None
        return found


class DataFlow:
    """What is known about all trees of a document.

    Args:
        document: The trees.
        ports: The ports of the nodes.
        order: The names of the trees, called ones before their callers.

    Raises:
        ConfigError: The trees share too many keys.
    """

    def __init__(self, document: Document, ports: Ports, order: list[str]) -> None:
        self._document = document
        self.main = document.main
        self._classes = Classes()
        self._callers: dict[str, list[tuple[str, SubTreeCall]]] = {}
        self._mappings: dict[Element, dict[str, str]] = {}
        self._shared = 0
        self.trees: dict[str, TreeFlow] = {}
        guessed: dict[tuple[str, str], str] = {}
        for name, tree in document.trees.items():
            events = list(_events(tree, ports, is_main=name == document.main))
            self.trees[name] = TreeFlow(tree, _settled(events, guessed))
            for event in events:
                if isinstance(event, KeyUse) and event.access == UNKNOWN:
                    self.trees[name].guessed.setdefault(event.key, event)
            for call in self.trees[name].calls:
                self._callers.setdefault(call.tree, []).append((name, call))
        for name in order:
            self._flow(self.trees[name])
        self._collect_kinds()

    def kind(self, tree: str, key: str) -> Kind | None:
        """The kind of a key, None when it is not known."""
        return self._classes.kind(("key", tree, key))

    def port_kind(self, node: str, port: str) -> Kind | None:
        """The kind of a port that no model describes, None when it is not known."""
        return self._classes.kind(("port", node, port))

    def declared(self, tree: str, direction: str) -> list[str]:
        """The ports of a tree that the file declares."""
        model = self._document.models.get(tree)
        ports = model.ports.items() if model is not None and model.category == "SubTree" else ()
        return [port for port, about in ports if about.direction in (direction, "inout")]

    def note_kind(self, node: str, port: str, kind: Kind) -> None:
        """Note the kind of a literal that is given to such a port."""
        self._classes.add(("port", node, port), kind)

    def mapping(self, caller: str, call: SubTreeCall) -> dict[str, str]:
        """Key of the called tree -> key of the caller, for all that the two share.

        Raises:
            ConfigError: All trees together share more keys than any program needs.
        """
        known = self._mappings.get(call.element)
        if known is None:
            known = self._mappings[call.element] = self._mapped(caller, call)
            self._shared += len(known)
            if self._shared > MAX_SHARED:
                place = call.element.position
                raise ConfigError(
                    f"the trees share more than {MAX_SHARED} keys",
                    file=self.trees[caller].tree.file,
                    line=place.line,
                    column=place.column,
                    valid=["ports in place of _autoremap"],
                )
        return known

    def _mapped(self, caller: str, call: SubTreeCall) -> dict[str, str]:
        called = self.trees.get(call.tree)
        shared = dict(call.keys)
        if called is None:
            return shared
        for key in called.keys | called.passed:
            if key in shared or key in call.literals:
                continue
            if key.startswith(ROOT):
                shared[key] = key.removeprefix(ROOT) if caller == self._document.main else key
            elif call.autoremap and not key.startswith("_"):
                shared[key] = key
        return shared

    def writes(self, name: str, event: KeyUse | SubTreeCall) -> list[str]:
        """The keys that an event of a tree writes."""
        return self._effects(name, event)[1]

    def _flow(self, facts: TreeFlow) -> None:
        name = facts.tree.name
        read: dict[str, None] = {}
        for call in facts.calls:
            facts.passed.update(dict.fromkeys(self.mapping(name, call).values()))
        for event in facts.events:
            reads, writes = self._effects(name, event)
            read.update(dict.fromkeys(key for key in reads if key not in facts.written))
            facts.written.update(dict.fromkeys(writes))
        facts.inputs = list(read)
        seen = self._seen_by_callers(name)
        facts.outputs = [key for key in facts.written if key in seen]

    def _effects(self, name: str, event: KeyUse | SubTreeCall) -> tuple[list[str], list[str]]:
        if isinstance(event, KeyUse):
            return ([event.key], []) if event.access == READ else ([], [event.key])
        called = self.trees.get(event.tree)
        if called is None:
            return list(event.keys.values()), []
        shared = self.mapping(name, event)
        reads = [shared[key] for key in called.inputs if key in shared]
        return reads, [shared[key] for key in called.outputs if key in shared]

    def _seen_by_callers(self, name: str) -> set[str]:
        model = self._document.models.get(name)
        seen = {port for port, about in model.ports.items() if about.direction != "in"} if model else set()
        for caller, call in self._callers.get(name, ()):
            seen.update(self.mapping(caller, call))
        return seen

    def _collect_kinds(self) -> None:
        for name, model in self._document.models.items():
            if model.category == "SubTree" and name in self.trees:
                for port, about in model.ports.items():
                    if about.kind is not None:
                        self._classes.add(("key", name, port), about.kind)
        for name, facts in self.trees.items():
            for event in facts.events:
                if isinstance(event, SubTreeCall):
                    for inner, outer in self.mapping(name, event).items():
                        self._classes.join(("key", name, outer), ("key", event.tree, inner))
                    for port, text in event.literals.items():
                        self._classes.hint(("key", event.tree, port), guess_kind(text))
                    continue
                if event.kind is not None:
                    self._classes.add(("key", name, event.key), event.kind)
                if event.hint is not None:
                    self._classes.hint(("key", name, event.key), event.hint)
                if event.port is not None:
                    self._classes.join(("key", name, event.key), ("port", *event.port))


def _events(tree: Tree, ports: Ports, *, is_main: bool) -> Iterator[KeyUse | SubTreeCall]:
    def local(key: str) -> str:
        return key.removeprefix(ROOT) if is_main else key

    for element in tree.root.walk():
        for use in uses_of(element, ports):
            yield replace(use, key=local(use.key))
        if element.tag == "SubTree":
            keys, literals = {}, {}
            given = {**ports.mapped_by_default(element.get("ID")), **element.attributes}
            for name, value in given.items():
                if name in ("ID", "name") or name.startswith("_"):
                    continue
                key = pointer(value, name)
                if key is not None:
                    keys[name] = local(key)
                else:
                    literals[name] = value
            autoremap = element.get("_autoremap").lower() in ("true", "1")
            yield SubTreeCall(element, element.get("ID"), keys, literals, autoremap)


def _settled(
    events: list[KeyUse | SubTreeCall], guessed: dict[tuple[str, str], str]
) -> list[KeyUse | SubTreeCall]:
    """Decide whether ports of unknown direction are read or written.

    A key that nothing is known to write, and that several ports use, must come from one of them: the first.
    Of one element that has it twice the last port, for a node reads before it writes. A port has one
    direction, wherever it is used.

    Args:
        events: What happens in a tree.
        guessed: The ports that were decided on before; further ones are added.
    """
    users: dict[str, set[tuple[str, str] | int]] = {}
    last: dict[tuple[str, Element], KeyUse] = {}
    written: set[str] = set()
    for number, event in enumerate(events):
        if isinstance(event, KeyUse):
            users.setdefault(event.key, set()).add(event.port or number)
            last[event.key, event.element] = event
            access = guessed.get(event.port or ("", ""), event.access)
            written |= {event.key} if access == WRITE else set()
    settled: list[KeyUse | SubTreeCall] = []
    for event in events:
        if isinstance(event, KeyUse) and event.access == UNKNOWN and event.port is not None:
            is_last = last[event.key, event.element] is event
            writes = is_last and event.key not in written and len(users[event.key]) > 1
            access = guessed.setdefault(event.port, WRITE if writes else READ)
            written |= {event.key} if access == WRITE else set()
            event = replace(event, access=access)
        settled.append(event)
    return settled
