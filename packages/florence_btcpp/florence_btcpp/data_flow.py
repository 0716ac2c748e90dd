"""The flow through the blackboard of all trees: inputs and outputs of trees, and their kinds.

A mission has keys of its own, and gets and gives values at its start and end. A tree of BehaviorTree.CPP
shares entries of the blackboard with its caller. So for each tree it is found out what it reads before it
writes it (inputs), and what it writes that its caller sees (outputs). An output that is not written on every
way is an input too, so that the caller's value stands where the tree writes none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeGuard

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_btcpp.directions import settled
from florence_btcpp.document import Document, Tree
from florence_btcpp.key_uses import (
    READ,
    ROOT,
    UNKNOWN,
    WRITE,
    KeyUse,
    Ports,
    SubTreeCall,
    events_of,
    literals_of,
    local_key,
    pointer,
    script_uses,
)
from florence_btcpp.kinds import Classes, Kinds, Member
from florence_btcpp.names import Names
from florence_btcpp.order import CONCURRENT, REPEATING, Order
from florence_btcpp.xml_source import Element

_UNSURE = frozenset(
    {
        *(
            "Inverter",
            "ForceSuccess",
            "ForceFailure",
            "Precondition",
            "FlorenceGuard",
            "ManualSelector",
            "FlorenceForEach",
        ),
        *("LoopInt", "LoopDouble", "LoopString", "LoopBool", "SkipUnlessUpdated", "WaitValueUpdate"),
    }
)
"""Nodes that can succeed although what is below them did not."""
_FIRST_COUNTS = ("RecoveryNode", "Finally", "FlorenceFinally", "FlorenceRetry", "FlorenceInterruptible")
"""Controls that succeed when their first node does."""
_ONE_OF = ("Fallback", "AsyncFallback", "ReactiveFallback", "RoundRobin", "FlorenceSwitch", "FlorenceCatch")
"""Controls that succeed when one of their nodes does."""
_TOLERANT = frozenset(
    {
        *("Fallback", "AsyncFallback", "ReactiveFallback", "Inverter", "ForceSuccess", "TryCatch"),
        *("IfThenElse", "WhileDoElse", "RecoveryNode", "RetryUntilSuccessful", "RetryUntilSuccesful"),
        *("Parallel", "ParallelAll", "RoundRobin", "FlorenceCatch"),
    }
)
"""Nodes after which a tree can go on although something below them failed."""
Writes = Callable[[Element], set[str]]

MAX_SHARED = 20_000
"""Most keys that all calls of trees together share."""
MAX_STEPS = 100_000
"""Most pairs of nodes of a tree that are compared."""


@dataclass
class TreeFlow:
    """The facts about one tree.

    Attributes:
        tree: The tree.
        events: Uses of keys and calls in the order of the file.
        inputs: The keys that it reads before it writes them.
        outputs: The keys that it writes and its callers see.
        written: All keys that it writes.
        soft: Inputs that begin with a neutral value where a call has none: outputs that not every way writes.
        missing: Inputs that some call does not give.
        unwritten: Keys that are read where nothing can have written them.
        unset: ``SetBlackboard`` nodes whose value comes from a key that has none at that time.
        guessed: The keys whose direction was guessed.
        passed: The keys that called trees use without a port of the call (see :meth:`DataFlow.mapping`).
        names: Our names of its keys.
    """

    tree: Tree
    events: list[KeyUse | SubTreeCall]
    inputs: list[str] = field(default_factory=list)
    outputs: list[str] = field(default_factory=list)
    written: dict[str, None] = field(default_factory=dict)
    soft: dict[str, None] = field(default_factory=dict)
    missing: dict[str, None] = field(default_factory=dict)
    unwritten: dict[str, None] = field(default_factory=dict)
    unset: set[Element] = field(default_factory=set)
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
    def order(self) -> Order:
        """The order of its nodes."""
        return Order(self.tree.root)

    def _concurrent_above(self, element: Element) -> Element | None:
        """Return the outermost control above an element that goes on with several of its nodes."""
        _, *above = self.order.with_parents(element)
        return next((each for each in reversed(above) if each.tag in CONCURRENT), None)

    def local(self, key: str, main: str | None) -> str:
        """Return a key as it is called in this tree: in the main tree the outermost blackboard is its own."""
        return local_key(key, is_main=self.tree.name == main)

    def is_entry(self, name: str) -> bool:
        """Tell whether a script's name is a key; in capitals and never written it is an enumeration's."""
        return not name.isupper() or name in self.written or name in self.pointed

    def key_name(self, key: str, main: str | None) -> str:
        """Return our name of a key."""
        return self.names.of(self.local(key, main))

    def all_inputs(self, facts: DataFlow) -> list[str]:
        """Return the keys that callers give: those that are declared, and those that are read first."""
        both = (
            k for k in facts.declared(self.tree.name, "inout") if k in self.inputs or k not in self.written
        )
        return list(dict.fromkeys([*facts.declared(self.tree.name, "in"), *both, *self.inputs, *self.soft]))

    def all_outputs(self, facts: DataFlow) -> list[str]:
        """Return the keys that callers get: those declared and written, and those they ask for."""
        declared = [k for way in ("out", "inout") for k in facts.declared(self.tree.name, way)]
        return list(dict.fromkeys([*(key for key in declared if key in self.written), *self.outputs]))

    def input_name(self, key: str, facts: DataFlow) -> str:
        """Return our name of an input: a key that is written too needs another one."""
        both = key in self.written and key in self.all_inputs(facts)
        return self.names.of(f"before {key}" if both else key)

    def may_change(self, element: Element, key: str, facts: DataFlow) -> bool:
        """Tell whether a key may be written while an element's branch runs: below it, or beside it."""
        if self._writers is None:
            self._writers = self._find_writers(facts)
        found = self._writers.get(key, set())
        return element in found or self._concurrent_above(element) in found

    def _find_writers(self, facts: DataFlow) -> dict[str, set[Element]]:
        """Map each key to the elements that write it, and all above them."""
        found: dict[str, set[Element]] = {}
        for event in self.events:
            for key in facts.writes(self.tree.name, event):
                found.setdefault(key, set()).update(self.order.with_parents(event.element))
        return found

    def uses_below(self, elements: list[Element]) -> Iterator[KeyUse]:
        """Return the uses of keys in some elements and below them."""
        inside = {below for element in elements for below in element.walk()}
        return (e for e in self.events if isinstance(e, KeyUse) and e.element in inside)

    def is_ticked_again(self, element: Element) -> bool:
        """Tell whether an element can be ticked after its end, not by a ``PipelineSequence`` above."""
        above = self._concurrent_above(element)
        return above is not None and not (above.tag == "PipelineSequence" and element in above.children)

    def is_repeated(self, element: Element) -> bool:
        """Tell whether something above an element can start it again."""
        return any(above.tag in CONCURRENT | REPEATING for above in self.order.with_parents(element))

    def goes_on_after_failure(self, element: Element) -> bool:
        """Tell whether something above an element goes on when it fails."""
        return any(above.tag in _TOLERANT for above in self.order.with_parents(element))

    def surely_written(self, element: Element, writes: Writes) -> set[str]:
        """Return the keys that are written whenever an element succeeds.

        Args:
            element: The element.
            writes: Gives the keys that an element by itself writes when it succeeds.
        """
        if any(name in element.attributes for name in ("_skipIf", "_onlyIf", "_while", "_successIf")):
            return set()
        below = [self.surely_written(child, writes) for child in element.children]
        tag, own = element.tag, writes(element)
        if tag in _UNSURE or (tag in ("Parallel", "FlorenceParallel") and len(element.attributes) > 0):
            return own
        if tag in _FIRST_COUNTS:
            return own | below[0] if below else own
        if tag == "FlorenceUntil":
            return own | below[-1] if below else own
        if tag == "TryCatch":
            return own.union(*below[:-1])
        if tag in ("IfThenElse", "WhileDoElse"):
            return own | (set.intersection(*below[1:]) if len(below) > 1 else set())
        if tag in _ONE_OF or tag.startswith("Switch"):
            return own | (set.intersection(*below) if below else set())
        return own.union(*below)

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
    """The facts about all trees of a document.

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
        self._callers: dict[str, list[tuple[str, SubTreeCall]]] = {}
        self._mappings: dict[Element, dict[str, str]] = {}
        self._shared = 0
        self.trees: dict[str, TreeFlow] = {}
        events = {n: list(events_of(t, ports, is_main=n == self.main)) for n, t in document.trees.items()}
        elements = (element for tree in document.trees.values() for element in tree.root.walk())
        written_out = {(node, port) for each in elements for node, port, _ in literals_of(each)}
        for name, found in settled(document, events, written_out, reversed(order)).items():
            self.trees[name] = TreeFlow(document.trees[name], found)
            for event in events[name]:
                if isinstance(event, KeyUse) and event.access == UNKNOWN:
                    self.trees[name].guessed.setdefault(event.key, event)
            for call in self.trees[name].calls:
                self._callers.setdefault(call.tree, []).append((name, call))
        for name in order:
            self._flow(self.trees[name])
        self._find_unset()
        self._find_missing()
        for facts in self.trees.values():
            self._find_unwritten(facts)
        known = {name: facts.events for name, facts in self.trees.items()}
        self._kinds = Kinds(document, ports, known, self.mapping, lambda n, key: self.trees[n].is_entry(key))

    def kind(self, tree: str, key: str) -> Kind | None:
        """Return the kind of a key, None when it is not known."""
        return self._kinds.kind(tree, key)

    def port_kind(self, node: str, port: str) -> Kind | None:
        """Return the kind of a port of a node that this installation lacks, None when it is not known."""
        return self._kinds.port_kind(node, port)

    def declared(self, tree: str, direction: str) -> list[str]:
        """Return the ports that the file declares for a tree with a direction, ``in``, ``out``, ``inout``."""
        model = self._document.models.get(tree)
        ports = model.ports.items() if model is not None and model.category == "SubTree" else ()
        return [port for port, about in ports if about.direction == direction]

    def mapping(self, caller: str, call: SubTreeCall) -> dict[str, str]:
        """Map each key of the called tree to the key of the caller, for all that they share.

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
        """Return the keys that an event of a tree writes."""
        return self._effects(name, event)[1]

    def _flow(self, facts: TreeFlow) -> None:
        name = facts.tree.name
        read: dict[str, None] = {}
        copied: list[KeyUse] = []
        for call in facts.calls:
            facts.passed.update(dict.fromkeys(self.mapping(name, call).values()))
        seen = self._seen_by_callers(name)
        for event in facts.events:
            reads, writes = self._effects(name, event)
            new = dict.fromkeys(key for key in reads if key not in facts.written)
            if _is_copy(event):
                copied += [event] if new else []
            else:
                read.update(new)
            if isinstance(event, SubTreeCall):
                soft = self._soft(name, event)
                facts.soft |= dict.fromkeys(key for key in soft if key in seen and key not in facts.written)
            facts.written.update(dict.fromkeys(writes))
        for use in copied:
            if use.key in seen or use.key not in facts.written:
                read[use.key] = None
            elif use.key not in read and not facts.is_repeated(use.element):
                facts.unset.add(use.element)
        facts.inputs = [key for key in read if facts.is_entry(key)]
        facts.outputs = [key for key in facts.written if key in seen]
        self._find_soft(facts)

    def _find_soft(self, facts: TreeFlow) -> None:
        """Find the outputs that not every way to success writes, but for those that the file declares."""
        name = facts.tree.name
        writes: dict[Element, set[str]] = {}
        for event in facts.events:
            writes.setdefault(event.element, set()).update(self.writes(name, event))
        for element in writes:
            for attribute in ("_onFailure", "_onHalted"):
                on_end = script_uses(element.get(attribute), element)
                writes[element] -= {use.key for use in on_end if use.access == WRITE}
        sure = facts.surely_written(facts.tree.root, lambda element: writes.get(element, set()))
        facts.soft |= dict.fromkeys(key for key in facts.outputs if key not in sure)
        declared = {*self.declared(name, "in"), *self.declared(name, "out"), *facts.inputs}
        facts.soft = {key: None for key in facts.soft if key not in declared}

    def _soft(self, name: str, call: SubTreeCall) -> list[str]:
        called = self.trees.get(call.tree)
        shared = self.mapping(name, call)
        return [shared[key] for key in called.soft if key in shared] if called is not None else []

    def _find_unset(self) -> None:
        """Find the ``SetBlackboard`` nodes whose value comes from a key that nothing ever sets."""
        entries = Classes()
        for name, facts in self.trees.items():
            for call in facts.calls:
                for inner, outer in self.mapping(name, call).items():
                    entries.join(("key", name, outer), ("key", call.tree, inner))
        copies = [(name, e) for name, facts in self.trees.items() for e in facts.events if _is_copy(e)]
        known = {entries.root(member) for name in self.trees for member in self._certainly_set(name)}
        before = -1
        while before != len(known):
            before = len(known)
            for name, use in copies:
                if entries.root(("key", name, use.key)) in known:
                    target = use.element.get("output_key")
                    known.add(entries.root(("key", name, pointer(target, "output_key") or target)))
        for name, use in copies:
            if entries.root(("key", name, use.key)) not in known:
                self.trees[name].unset.add(use.element)
        for name, facts in self.trees.items():
            facts.inputs = [key for key in facts.inputs if entries.root(("key", name, key)) in known]
            facts.outputs = [key for key in facts.outputs if entries.root(("key", name, key)) in known]
            facts.soft = {key: None for key in facts.soft if entries.root(("key", name, key)) in known}

    def _certainly_set(self, name: str) -> Iterator[Member]:
        """Yield a tree's keys that something sets, or that a program must set because a node needs them."""
        for direction in ("in", "out", "inout"):
            yield from (("key", name, key) for key in self.declared(name, direction))
        for event in self.trees[name].events:
            if isinstance(event, SubTreeCall):
                yield from (("key", event.tree, port) for port in event.literals)
                if event.tree not in self.trees:
                    yield from (("key", name, key) for key in event.keys.values())
            elif event.element.tag != "SetBlackboard" or pointer(event.element.get("value"), "") is None:
                yield "key", name, event.key

    def _find_unwritten(self, facts: TreeFlow) -> None:
        """Find the keys that are read where nothing can have written them, as on another branch."""
        inputs = set(facts.all_inputs(self))
        writers: dict[str, list[Element]] = {}
        steps = MAX_STEPS
        for event in facts.events:
            reads, writes = self._effects(facts.tree.name, event)
            for key in reads:
                if key in inputs or key not in facts.written:
                    continue
                before = writers.get(key, [])
                steps -= len(before)
                if steps > 0 and not any(facts.order.can_follow(each, event.element) for each in before):
                    facts.unwritten[key] = None
            for key in writes:
                writers.setdefault(key, []).append(event.element)

    def _find_missing(self) -> None:
        """Find the inputs that some call leaves out and the file gives no value for."""
        for name, facts in self.trees.items():
            for call in facts.calls:
                called = self.trees.get(call.tree)
                if called is not None:
                    given = {*self.mapping(name, call), *call.literals}
                    model = self._document.models.get(call.tree)
                    given |= (
                        {port for port, about in model.ports.items() if about.default} if model else set()
                    )
                    wanted = (key for key in called.all_inputs(self) if key not in called.soft)
                    called.missing |= dict.fromkeys(key for key in wanted if key not in given)

    def _effects(self, name: str, event: KeyUse | SubTreeCall) -> tuple[list[str], list[str]]:
        if isinstance(event, KeyUse):
            return ([event.key], []) if event.access == READ else ([], [event.key])
        called = self.trees.get(event.tree)
        if called is None:
            return list(event.keys.values()), []
        shared = self.mapping(name, event)
        reads = [shared[k] for k in called.all_inputs(self) if k in shared and k not in called.soft]
        return reads, [shared[key] for key in called.outputs if key in shared]

    def _seen_by_callers(self, name: str) -> set[str]:
        model = self._document.models.get(name)
        seen = {port for port, about in model.ports.items() if about.direction != "in"} if model else set()
        for caller, call in self._callers.get(name, ()):
            seen.update(self.mapping(caller, call))
        return seen


def _is_copy(event: KeyUse | SubTreeCall) -> TypeGuard[KeyUse]:
    """Tell whether a ``SetBlackboard`` reads a key, which fails when the key has no value."""
    is_read = isinstance(event, KeyUse) and event.access == READ and event.pointed
    return is_read and event.element.tag == "SetBlackboard"
