"""Trees of BehaviorTree.CPP to the nodes of a mission.

First the walk and what every node can have (pre- and post-conditions, guards that move up), then what becomes
of each element: controls, decorators, leaves, and in the end the table of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError
from florence_bt.trees.kinds.words import OWNERS
from florence_bt.trees.language.declared_skills import port_document
from florence_bt.trees.language.expressions.parser import negated, parse_expression
from florence_bt.trees.language.vocabulary import ANYWHERE, BESIDE, FOREVER, OUTSIDE
from florence_btcpp.custom_nodes import CustomNode, CustomNodes
from florence_btcpp.data_flow import DataFlow, TreeFlow
from florence_btcpp.key_uses import READ, WRITE, Ports, SubTreeCall, pointer, port_of_skill, registration
from florence_btcpp.mission_text import Quoted, read_flow
from florence_btcpp.names import identifier
from florence_btcpp.node_models import NAV2_ERROR_PORTS, nav2_nodes
from florence_btcpp.notes import LossNotes
from florence_btcpp.round_trip import matching_cases, matching_expression, matching_guard, matching_values
from florence_btcpp.script import (
    AssignmentExpr,
    BooleanExpr,
    ChoiceExpr,
    NameExpr,
    NumberExpr,
    Scope,
    ScriptExpr,
    TextExpr,
    UnaryExpr,
    assigned_value,
    condition_text,
    kind_of_code,
    names_in,
    order_matters,
    parse_condition,
    parse_script,
    value_text,
)
from florence_btcpp.values import (
    literal_text,
    neutral_value,
    quantity_text,
    read_number,
    si_text,
    text_value,
    written_value,
)
from florence_btcpp.vocabulary import ENDLESS, LOOP_KINDS, MARK, POLL, POST_CONDITIONS
from florence_btcpp.xml_source import Element

TURNING = frozenset({"Inverter", "ForceSuccess", "ForceFailure", "RunOnce", "Timeout"})
"""Decorators over which a guard is moved."""
ROUNDS = frozenset({"Repeat", "RetryUntilSuccessful", "RetryUntilSuccesful", "KeepRunningUntilFailure"})
"""Decorators that ask a guard in each round; it stands above them too."""
GATHERING = frozenset(
    {
        "Sequence",
        "AsyncSequence",
        "ReactiveSequence",
        "Fallback",
        "AsyncFallback",
        "ReactiveFallback",
        "Parallel",
    }
)
"""Composites that are skipped when all their nodes are."""
_SKIPS = ("_skipIf", "_onlyIf", "_while")
_UNEVEN = "what is skipped in it is skipped there; here it counts as success or failure"
_SCRIPTS = "when what is below it is skipped its scripts are not done there; here they are"


def with_guards_above(element: Element, node: Node) -> tuple[Node, str]:
    """Return a converted node with the guards of the nodes below it moved up, where that is needed.

    Args:
        element: What it was.
        node: What it has become.

    Returns:
        The node, and what differs anyway (empty when nothing is).
    """
    if MARK in element.attributes or not element.children:
        return node, ""
    if element.tag in TURNING | ROUNDS:
        slot = "do" if "do" in node else next(iter(node))
        below = node[slot]
        if element.tag == "ForceFailure" and _is_guarded(element.children[0], below[0]):
            bare, when = _lift(below[0])
            return {slot: [bare, *below[1:]], "when": when}, ""
        if isinstance(below, dict) and _is_guarded(element.children[0], below):
            bare, when = _lift(below)
            different = _UNEVEN if any(map(_can_skip, _inside(element.children[0]))) else ""
            return {**node, slot: bare if element.tag in TURNING else below, "when": when}, different
        if element.tag in TURNING and _can_skip(element.children[0]):
            return node, _UNEVEN
    if element.tag in GATHERING:
        nodes = next(node[kind] for kind in ("sequence", "selector", "parallel") if kind in node)
        if all(_is_guarded(child, below) for child, below in zip(element.children, nodes, strict=True)):
            any_of_them = " or ".join(f"({below['when']})" for below in nodes)
            long = not _is_short_enough(any_of_them)
            return (node, _UNEVEN) if long else ({**node, "when": any_of_them}, "")
        if all(map(_can_skip, element.children)):
            return node, _UNEVEN
    scripts = any(name in element.attributes for name in POST_CONDITIONS)
    return node, _SCRIPTS if scripts and _can_skip(element) else ""


def _is_short_enough(expression: str) -> bool:
    """Tell whether an expression keeps the limits of a mission."""
    try:
        parse_expression(expression)
    except ConfigError:
        return False
    return True


def _inside(element: Element) -> list[Element]:
    """Return what can be skipped although the guard of the element itself lets it start."""
    return element.children if element.tag not in GATHERING else []


def _can_skip(element: Element) -> bool:
    """Tell whether a node, or what decides below it, can be skipped by a guard that is not our own."""
    waiting = [element]
    while waiting:
        one = waiting.pop()
        if one.tag != "FlorenceGuard" and any(name in one.attributes for name in _SKIPS):
            if matching_guard(one) is None:
                return True
        elif one.tag in GATHERING:
            if MARK not in one.attributes and all(map(_can_skip, one.children)):
                return True
        else:
            waiting.extend(one.children)
    return False


def _is_guarded(element: Element, node: Node) -> bool:
    """Tell whether a node can be skipped by a guard that is not one of our own exports."""
    own = element.tag == "FlorenceGuard" or matching_guard(element) is not None
    return not own and "when" in node


def _lift(guarded: Node) -> tuple[Node, str | None]:
    """Split a node into the node without its ``when``, and that."""
    return {name: value for name, value in guarded.items() if name != "when"}, guarded.get("when")


Node = dict[str, Any]
"""A node as it is written in a mission file."""
NOTHING: Node = {"condition": "true"}
"""Succeeds at once."""
NOT_IMPORTED = "not_imported"
"""The code of what stands for a node without an equivalent."""

Handler = Callable[["Converter", Element], Node]


_HANDLERS: dict[str, Handler] = {}
"""The name of an element -> what converts it."""


def _converts(*tags: str) -> Callable[[Handler], Handler]:
    """Register a function as what converts these elements."""

    def register(handler: Handler) -> Handler:
        _HANDLERS.update(dict.fromkeys(tags, handler))
        return handler

    return register


class Converter:
    """Converts the nodes of one tree.

    Args:
        facts: What is known about all trees.
        tree: What is known about this one.
        ports: The ports of all nodes.
        custom: Collects the nodes that are skills.
        missions: Tree ID -> name of its mission.
        notes: Receives what has no equivalent.
    """

    def __init__(
        self,
        facts: DataFlow,
        tree: TreeFlow,
        ports: Ports,
        custom: CustomNodes,
        missions: Mapping[str, str],
        notes: LossNotes,
    ) -> None:
        self.facts = facts
        self.tree = tree
        self.ports = ports
        self.custom = custom
        self.missions = missions
        self.keys: dict[str, Node] = {}
        self._notes = notes

    # ---- names and values: the scope of scripts ------------------------------------------------------------

    def key(self, foreign: str) -> str | None:
        """Return our name of a key; None for a name in capitals that nothing writes: an enumeration value."""
        return self.key_name(foreign) if self.tree.is_entry(foreign) else None

    def key_name(self, foreign: str) -> str:
        """Return our name of a key."""
        return self.tree.key_name(foreign, self.facts.main)

    def kind(self, foreign: str) -> Kind | None:
        """Return the kind of a key."""
        key = self.tree.local(foreign, self.facts.main)
        kind = self.facts.kind(self.tree.tree.name, key)
        # A key that nothing tells about is declared as a text.
        return kind or (Kind.TEXT if key in self.tree.inputs or key in self.tree.outputs else None)

    def new_key(self, wanted: str, kind: Kind, default: str | None) -> str:
        """Make a key that the mission needs for itself, with its value at the start if it has one."""
        name = self.tree.names.of(f"{wanted} {len(self.keys) + 1}")
        self.keys[name] = (
            {"type": kind.value} if default is None else {"type": kind.value, "default": default}
        )
        return name

    def start_with(self, foreign: str, kind: Kind, default: Any) -> None:
        """Give a key that the tree writes a value at the start."""
        if foreign not in self.tree.all_inputs(self.facts):
            self.keys.setdefault(self.key_name(foreign), {"type": kind.value, "default": default})

    def start_empty(self, foreign: str) -> None:
        """Give a key that need not be written before it is read a neutral value at the start."""
        kind = self.kind(foreign) or Kind.TEXT
        self.start_with(foreign, kind, port_document(Port(kind, "", neutral_value(kind)))["default"])

    def leave_unwritten(self, foreign: str) -> None:
        """Give a key whose writer has no equivalent a value, where something asks for it."""
        asked = {*self.tree.read_keys, *self.tree.passed, *self.tree.all_outputs(self.facts)}
        if foreign in asked:
            self.start_empty(foreign)

    def as_text(self, key: str) -> str:
        """Give the value of a key as a text: two keys in one value are put together to one."""
        nothing = self.tree.names.of("empty text")
        self.keys[nothing] = {"type": Kind.TEXT.value, "default": Quoted("")}
        return Quoted(f"${self.key_name(key)}${nothing}")

    def value(self, element: Element, attribute: str, kind: Kind | None) -> Any:
        """Write the value of an attribute as in a mission."""
        text = element.get(attribute)
        key = pointer(text, attribute)
        if key is not None:
            is_text = kind is not Kind.TEXT or self.kind(key) in (None, Kind.TEXT)
            return f"${self.key_name(key)}" if is_text else self.as_text(key)
        value, problem = written_value(text, kind)
        if problem:
            self.lost(element, f"{attribute}: {problem}")
        return value

    def condition(self, element: Element, script: str, mark: str = MARK) -> str | None:
        """Convert a script that is a condition to an expression; None (noted) without equivalent."""
        own = matching_expression(element, mark, script)
        if own is not None:
            return own
        try:
            self._note_order(element, script)
            return condition_text(parse_condition(script), self)
        except ConfigError as error:
            self.lost(element, f"the condition {script!r}: {error.problem}")
            return None

    def mark_value(self, element: Element, text: str) -> Any:
        """Read a value of one of our own marks."""
        try:
            return read_flow(text)
        except ConfigError as error:
            self.lost(element, f"{text!r}: {error.problem}")
            return text_value(text, None)

    def milliseconds(self, element: Element, attribute: str) -> Any:
        """Read a duration that is given in milliseconds."""
        key = pointer(element.get(attribute), attribute)
        if key is not None and self.kind(key) not in (Kind.TEXT, Kind.BOOLEAN, Kind.POSE):
            seconds = "0.001" if self.kind(key) is Kind.DURATION else "0.001 s"
            return f"${{${self.key_name(key)} * {seconds}}}"
        number = read_number(element.get(attribute))
        if number is None or number < 0:
            self.lost(
                element, f"{attribute}={element.get(attribute)!r} is not a number of milliseconds; 0 is taken"
            )
            number = 0
        return quantity_text(number / 1000, Kind.DURATION)

    def count(self, element: Element, attribute: str, default: int, *, least: int = 1) -> tuple[str, bool]:
        """Read a number of rounds, at least so many, and whether the loop is endless."""
        text = element.get(attribute, str(default))
        key = pointer(text, attribute)
        may_lack = {*self.tree.missing, *self.tree.soft}
        if key is not None and key not in may_lack and self.kind(key) in (None, Kind.INTEGER):
            return f"${self.key_name(key)}", False
        number = read_number(text)
        if not isinstance(number, int) or number < -1:
            self.lost(element, f"{attribute}={text!r} is not a number of rounds; {default} is taken")
            number = default
        return (FOREVER, True) if number == -1 else (str(max(number, least)), False)

    # ---- nodes ---------------------------------------------------------------------------------------------

    def node(self, element: Element) -> Node:
        """Convert an element with everything below it."""
        is_control = element.tag in ("Control", "Decorator") or element.children
        handler = _HANDLERS.get(element.tag, unknown_control if is_control else skill)
        node, different = with_guards_above(element, handler(self, element))
        if different:
            self.lost(element, different)
        written = element.get("name").strip()
        if written not in ("", registration(element), node.get("name")):
            node = put(node, "name", written)
        return arranged(self._with_conditions(element, node))

    def direction(self, element: Element, attribute: str) -> str:
        """Tell whether a port that no model describes is read or written here."""
        if pointer(element.get(attribute), attribute) is None:
            return "in"
        return "out" if (registration(element), attribute) in self.tree.writing_ports else "in"

    def changes_below(self, element: Element, key: str) -> bool:
        """Tell whether a key may change while a branch of an element runs."""
        local = self.tree.local(key, self.facts.main)
        return self.tree.may_change(element, local, self.facts)

    def children(self, element: Element) -> list[Node]:
        """Convert the nodes below an element."""
        return [self.node(child) for child in element.children]

    def only_child(self, element: Element) -> Node:
        """Convert the one node below a decorator."""
        return self.node(element.children[0])

    def lost(self, element: Element, message: str) -> None:
        """Note what has no equivalent, or behaves differently."""
        self._notes.lost(self.tree.tree.file, element.position, f"{registration(element)}: {message}")

    def notice(self, element: Element, message: str) -> None:
        """Note what is worth knowing."""
        self._notes.notice(self.tree.tree.file, element.position, f"{registration(element)}: {message}")

    def stand_in(self, element: Element, message: str) -> Node:
        """Make what stands for a node without an equivalent: it fails and says so."""
        self.lost(element, f"{message}; replaced by a node that fails")
        reason = f"{registration(element)} (line {element.position.line}) has no equivalent"
        return {"fail": reason, "code": NOT_IMPORTED}

    def _note_order(self, element: Element, script: str) -> None:
        if order_matters(script):
            message = f"{script!r} is computed from the left, as since version 4.9; before, from the right"
            self.notice(element, message)

    def scripts(self, element: Element, text: str) -> list[Node]:
        """Convert the assignments of a script to nodes."""
        statements: list[ScriptExpr] = []
        try:
            self._note_order(element, text)
            statements = parse_script(text)
            return set_nodes(statements, self, lambda message: self.notice(element, message))
        except ConfigError as error:
            for code in statements:
                if isinstance(code, AssignmentExpr):
                    self.leave_unwritten(code.name)
            return [self.stand_in(element, f"the script {text!r}: {error.problem}")]

    # ---- conditions before and scripts after ---------------------------------------------------------------

    def _with_conditions(self, element: Element, node: Node) -> Node:
        started = element.get("_onStart")
        if started:
            node = {"sequence": [*self.scripts(element, started), node]}
        node, when = _lift(node)  # a node that is skipped has no scripts done after it
        succeeds, fails = (self._asked(element, name) for name in ("_successIf", "_failureIf"))
        if succeeds is not None:
            node = {"if": succeeds, "then": dict(NOTHING), "else": node}
        if fails is not None:
            node = {"if": fails, "then": {"fail": f"_failureIf: {fails}"}, "else": node}
        node = self._with_scripts(element, node)
        before = [asked for asked in (fails, succeeds) if asked is not None]
        if when is not None:
            skipped = _all([f"not ({when})", *_none_of(before)])
            node = put(node, "when", negated(skipped) if before else when)
        node = self._with_skip(element, node, before)
        return self._with_words(element, node)

    def _asked(self, element: Element, name: str) -> str | None:
        return (
            self.condition(element, element.get(name), f"{MARK}{name}")
            if name in element.attributes
            else None
        )

    def _with_skip(self, element: Element, node: Node, before: list[str]) -> Node:
        if "_skipIf" in element.attributes:
            own = matching_guard(element)
            node = put(node, "when", own) if own is not None else self._skipped(element, node, before)
        if "_onlyIf" in element.attributes:
            node = self._only(node, self.condition(element, element.get("_onlyIf")), before)
        if "_while" in element.attributes:
            held = self.condition(element, element.get("_while"))
            if held is not None:
                node = put(self._only(node, held, before), "while", held)
                self.lost(element, "_while that breaks while the node runs: skipped there, a failure here")
        return node

    def _only(self, node: Node, needed: str | None, before: list[str]) -> Node:
        """Skip a node unless something holds; what decides before that comes first."""
        if needed is None:
            return node
        return (
            put(node, "when", negated(_all([f"not ({needed})", *_none_of(before)])))
            if before
            else put(node, "when", needed)
        )

    def _skipped(self, element: Element, node: Node, before: list[str]) -> Node:
        script = element.get("_skipIf")
        text = self.condition(element, script)
        if text is None:
            return node
        if before:
            return put(node, "when", negated(_all([f"({text})", *_none_of(before)])))
        code = parse_condition(script)
        if isinstance(code, UnaryExpr) and code.operator == "!":
            return put(node, "when", condition_text(code.operand, self))
        return put(node, "when", negated(text))

    def _with_scripts(self, element: Element, node: Node) -> Node:
        post, halted = element.get("_post"), element.get("_onHalted")
        if halted and halted == post:
            node = put(node, "finally", _one(self.scripts(element, halted)))
            post, halted = "", ""
        on_failure = self._all_scripts(element, element.get("_onFailure"), post)
        if on_failure:
            fail = {"fail": f"{element.get('name') or registration(element)} failed"}
            node = {"selector": [node, {"sequence": [*on_failure, fail]}]}
        on_success = self._all_scripts(element, element.get("_onSuccess"), post)
        if on_success:
            node = {"sequence": [node, *on_success]}
        if halted:
            self.lost(element, f"_onHalted={halted!r}: nothing runs only when a node is stopped")
        return node

    def _all_scripts(self, element: Element, *texts: str) -> list[Node]:
        return [node for text in texts if text for node in self.scripts(element, text)]

    def _with_words(self, element: Element, node: Node) -> Node:
        """Add the author's words for failures, as our own export has written them down."""
        code, text = element.get(f"{MARK}_code"), element.get(f"{MARK}_because")
        if code and _NAMES_ITS_FAILURE & set(node):
            node = put(node, "code", code)
        return put(node, "because", self.mark_value(element, text)) if text else node


def put(node: Node, modifier: str, value: Any) -> Node:
    """Add a modifier; a second guard joins the first, what else is there twice stands round the node."""
    if modifier in node:
        if modifier in _JOINED:
            return {**node, modifier: f"({node[modifier]}) and ({value})"}
        node = {"sequence": [node]}
    return {**node, modifier: value}


_NAMES_ITS_FAILURE = frozenset({*OWNERS["code"], *BESIDE["code"]})
"""Words of a node of which a failure can have a `code`."""
_JOINED = ("when", "while")
"""Guards, of which two are joined by ``and``."""


def _none_of(conditions: list[str]) -> list[str]:
    return [f"not ({condition})" for condition in conditions]


def _all(conditions: list[str]) -> str:
    return " and ".join(conditions)


def arranged(node: Node) -> Node:
    """Put the short words about a long node before it, as people do."""
    if not any(isinstance(value, list) or key in ("do", "then", "cases") for key, value in node.items()):
        return node
    first = {key: node[key] for key in _FIRST if key in node and not isinstance(node[key], dict)}
    return {**first, **{key: value for key, value in node.items() if key not in first}}


_FIRST = ("name", "when", "while", "code", "because")


def paced(node: Node) -> Node:
    """Wrap the body of an endless loop, with BehaviorTree.CPP's pause before each round."""
    return {"sequence": [{"wait": POLL}, node]}


def _one(nodes: list[Node]) -> Node:
    return nodes[0] if len(nodes) == 1 else {"sequence": nodes}


def set_nodes(
    statements: list[ScriptExpr], keys: Scope, ignored: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Convert the statements of a script to nodes, as few as possible.

    A ``set`` writes all its keys at once, so a statement that reads what an earlier one wrote begins a new
    one.

    Args:
        statements: The script.
        keys: The names.
        ignored: Called with what is left out because it does nothing.

    Raises:
        ConfigError: A part has no equivalent. The error has no place.
    """
    nodes: list[dict[str, Any]] = []
    current: dict[str, Any] = {}
    for code in statements:
        if not isinstance(code, AssignmentExpr):
            ignored("a statement that assigns nothing is left out")
            continue
        read = {keys.key(name) for name, written in names_in(code) if not written}
        target = keys.key_name(code.name)
        if isinstance(code.value, ChoiceExpr):
            current = {}
            nodes.append(_conditional(code, code.value, keys))
            continue
        if not current or target in current or read & set(current):
            current = {}
            nodes.append({"set": current})
        current[target] = _assigned(code, keys)
    return nodes or [{"condition": "true"}]


def _conditional(code: AssignmentExpr, choice: ChoiceExpr, keys: Scope) -> dict[str, Any]:
    target = keys.key_name(code.name)
    then, otherwise = (
        {"set": {target: _assigned(AssignmentExpr(code.operator, code.name, value), keys)}}
        for value in (choice.then, choice.otherwise)
    )
    return {"if": condition_text(choice.condition, keys), "then": then, "else": otherwise}


def _assigned(code: AssignmentExpr, keys: Scope) -> Any:
    value, kind = assigned_value(code), keys.kind(code.name)
    match value:
        case NumberExpr(value=number) if kind is Kind.TEXT:
            return text_value(si_text(number), None)
        case NumberExpr(value=number):
            return literal_text(number, kind)
        case BooleanExpr(value=truth):
            return text_value(si_text(truth), None) if kind is Kind.TEXT else si_text(truth)
        case TextExpr(value=text):
            return text_value(text, None)
        case NameExpr(name=name):
            key = keys.key(name)
            return f"${key}" if key is not None else text_value(name, None)
    return f"${{{value_text(value, keys, kind or kind_of_code(value, keys))}}}"


@_converts("AlwaysSuccess")
def always_success(c: Converter, e: Element) -> Node:
    """Convert ``AlwaysSuccess``."""
    return dict(NOTHING)


@_converts("AlwaysFailure")
def always_failure(c: Converter, e: Element) -> Node:
    """Convert ``AlwaysFailure``; our own marks say why."""
    if not e.get(f"{MARK}_reason"):
        return {"fail": e.get("name") or "AlwaysFailure"}
    return {"fail": c.mark_value(e, e.get(f"{MARK}_reason"))}


@_converts("Script")
def script(c: Converter, e: Element) -> Node:
    """Convert ``Script``."""
    own = matching_values(e)
    if own is not None:
        return {"set": own}
    nodes = c.scripts(e, e.get("code"))
    return nodes[0] if len(nodes) == 1 else {"sequence": nodes}


@_converts("ScriptCondition")
def script_condition(c: Converter, e: Element) -> Node:
    """Convert ``ScriptCondition``."""
    text = c.condition(e, e.get("code"))
    return {"condition": text} if text is not None else c.stand_in(e, "its condition has no equivalent")


@_converts("Sleep")
def sleep(c: Converter, e: Element) -> Node:
    """Convert ``Sleep``."""
    return {"wait": c.milliseconds(e, "msec")}


@_converts("SetBlackboard")
def set_blackboard(c: Converter, e: Element) -> Node:
    """Convert ``SetBlackboard``."""
    target = pointer(e.get("output_key"), "output_key") or e.get("output_key")
    if not target:
        return c.stand_in(e, "it names no output_key")
    if e in c.tree.unset:
        c.lost(e, f"nothing has written {e.get('value')} here, so it fails, as there when no program sets it")
        c.leave_unwritten(target)
        return {"fail": f"{e.get('value')} has no value", "code": "missing_key"}
    if c.kind(target) is Kind.TEXT and pointer(e.get("value"), "value") is None:
        return {"set": {c.key_name(target): text_value(e.get("value"), None)}}
    return {"set": {c.key_name(target): c.value(e, "value", c.kind(target))}}


@_converts("UnsetBlackboard")
def unset_blackboard(c: Converter, e: Element) -> Node:
    """Convert ``UnsetBlackboard``."""
    c.lost(e, "a key keeps its value; the node is imported as one that does nothing")
    return dict(NOTHING)


@_converts("SubTree")
def subtree(c: Converter, e: Element) -> Node:
    """Convert ``SubTree``: a call of another mission."""
    call = c.tree.calls_by_element[e]
    called = c.facts.trees.get(call.tree)
    node: Node = {"run": c.missions.get(call.tree) or identifier(call.tree, "mission")}
    shared = c.facts.mapping(c.tree.tree.name, call)
    if called is None:
        c.lost(e, f"the tree {call.tree!r} is not in this file; the mission must come from elsewhere")
        given = {identifier(port): f"${c.key_name(key)}" for port, key in shared.items()}
        given |= {identifier(port): written_value(text, None)[0] for port, text in call.literals.items()}
        return {**node, "with": given} if given else node
    inputs = _given(c, e, call, called, shared)
    outputs = {
        called.names.of(port): c.key_name(shared[port])
        for port in called.all_outputs(c.facts)
        if port in shared
    }
    declared = c.facts.declared(call.tree, "out")
    for port in (port for port in called.outputs if port in shared and port not in declared):
        if c.tree.goes_on_after_failure(e) and shared[port] in c.tree.read_keys:
            c.start_empty(shared[port])  # there the tree has shared it, although it failed
    node |= {"with": inputs} if inputs else {}
    return node | ({"out": outputs} if outputs else {})


def _given(
    c: Converter, e: Element, call: SubTreeCall, called: TreeFlow, shared: Mapping[str, str]
) -> dict[str, Any]:
    """Return the inputs of a call."""
    inputs: dict[str, Any] = {}
    wanted = called.all_inputs(c.facts)
    for port, key in shared.items():
        if port in wanted:
            inputs[called.input_name(port, c.facts)] = f"${c.key_name(key)}"
            if port in called.soft:
                c.start_empty(key)
        elif port not in called.all_outputs(c.facts):
            c.notice(e, f"the port {port!r} is used nowhere in {call.tree!r} and left out")
    for port, text in call.literals.items():
        if port in wanted:
            value, problem = written_value(text, c.facts.kind(call.tree, port))
            if problem:
                c.lost(e, f"{port}: {problem}")
            inputs[called.input_name(port, c.facts)] = value
        else:
            c.notice(e, f"the port {port!r} is used nowhere in {call.tree!r} and left out")
    for port in called.missing:
        if port not in shared and port not in call.literals:
            c.lost(e, f"{call.tree!r} reads {port!r}, which this call does not give; it begins empty or as 0")
    return inputs


def skill(c: Converter, e: Element) -> Node:
    """Convert every other node without nodes below it: a skill of this installation, or one that it lacks."""
    node = registration(e)
    entry = c.custom.entry(node, e)
    declared = c.ports.skill(node)
    inputs: dict[str, Any] = {}
    outputs: dict[str, str] = {}
    for attribute in e.attributes:
        if attribute in ("ID", "name") or attribute.startswith("_"):
            continue
        model = c.ports.port(node, attribute)
        if declared is not None and model is None:
            c.lost(e, f"the skill {declared.name} has no input or output {attribute!r}")
            continue
        _skill_port(c, e, entry, attribute, inputs, outputs)
    result: Node = {entry.name: inputs or None}
    if every := e.get(f"{MARK}_every"):
        result["every"] = every
    return result | ({"out": outputs} if outputs else {})


def _skill_port(
    c: Converter,
    e: Element,
    entry: CustomNode,
    attribute: str,
    inputs: dict[str, Any],
    outputs: dict[str, str],
) -> None:
    node, declared = entry.node, c.ports.skill(entry.node)
    model = c.ports.port(node, attribute)
    key = pointer(e.get(attribute), attribute)
    name = attribute if declared is not None else entry.names.of(attribute)
    if declared is not None and model is not None:
        direction, kind = model.direction, model.kind
    else:
        direction = model.direction if model is not None else c.direction(e, attribute)
        kind = c.facts.port_kind(node, attribute)
    entry.directions.setdefault(attribute, direction)
    if direction in ("in", "inout"):
        inputs[name] = c.value(e, attribute, kind)
    if direction in ("out", "inout"):
        if key is None:
            c.lost(e, f"the output {attribute!r} goes to no key: {e.get(attribute)!r}")
            return
        if declared is not None and port_of_skill(declared, attribute)[1] == "out":
            name = attribute if attribute in declared.outputs else attribute.removeprefix("out_")
        outputs[name] = c.key_name(key)
        if node in nav2_nodes() and attribute in NAV2_ERROR_PORTS:
            c.start_with(key, *NAV2_ERROR_PORTS[attribute])
            if c.tree.local(key, c.facts.main) in c.tree.read_keys:
                c.lost(e, f"{attribute} is written when the node succeeds; there also when it fails")


# ---- Florence nodes ------------------------------------------------------------------------------------


@_converts("FlorenceWait")
def florence_wait(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceWait``."""
    return {"wait": c.value(e, "seconds", Kind.DURATION)}


@_converts("FlorenceSet")
def florence_set(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceSet``."""
    try:
        values = read_flow(f"{{{e.get('values')}}}")
    except ConfigError as error:
        return c.stand_in(e, f"values: {error.problem}")
    return {"set": values} if isinstance(values, dict) and values else c.stand_in(e, "it sets nothing")


@_converts("FlorenceAppend")
def florence_append(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceAppend``."""
    node = florence_set(c, e)
    return {"append": node["set"]} if "set" in node else node


@_converts("FlorenceCondition")
def florence_condition(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceCondition``."""
    return {"condition": e.get("code")}


@_converts("Sequence", "AsyncSequence")
def sequence(c: Converter, e: Element) -> Node:
    """Convert ``Sequence``, ``AsyncSequence``."""
    if e.get(MARK) == "keys" and len(e.children) in (2, 3):
        return c.node(e.children[-1])
    return {"sequence": c.children(e)}


@_converts("ReactiveSequence")
def reactive_sequence(c: Converter, e: Element) -> Node:
    """Convert ``ReactiveSequence``; with our mark it is ``while`` round a node."""
    if e.get(MARK) == "while" and len(e.children) == 2 and e.children[0].tag == "ScriptCondition":
        asked = e.children[0]
        text = c.condition(asked, asked.get("code"))
        if text is not None:
            return put(c.node(e.children[1]), "while", text)
    return {"sequence": c.children(e), "memory": "false"}


@_converts("SequenceWithMemory")
def sequence_with_memory(c: Converter, e: Element) -> Node:
    """Convert ``SequenceWithMemory``: what has succeeded is not done again until all has."""
    done = c.new_key("done", Kind.INTEGER, "0")
    nodes: list[Node] = []
    for number, child in enumerate(c.children(e), start=1):
        step = {"sequence": [child, {"set": {done: str(number)}}], "when": f"${done} < {number}"}
        nodes.append(step)
    return {"sequence": [*nodes, {"set": {done: "0"}}]}


@_converts("Fallback", "AsyncFallback", "ReactiveFallback")
def fallback(c: Converter, e: Element) -> Node:
    """Convert ``Fallback``, ``AsyncFallback``, ``ReactiveFallback``."""
    node: Node = {"selector": c.children(e)}
    return {**node, "memory": "false"} if e.tag == "ReactiveFallback" else node


@_converts("Parallel")
def parallel(c: Converter, e: Element) -> Node:
    """Convert ``Parallel``, of version 3 too."""
    count = len(e.children)
    old = e.get("threshold") or e.get("success_threshold")
    succeed = _threshold(c, e, "success_count", old or "-1", count)
    fail = _threshold(c, e, "failure_count", e.get("failure_threshold") or "1", count)
    if e.get("threshold") and "failure_threshold" not in e.attributes:
        fail = count - succeed + 1
    node: Node = {"parallel": c.children(e)}
    if (succeed, fail) == (count, 1):
        return node
    if (succeed, fail) == (1, count):
        return {**node, "policy": "any"}
    return {**node, "policy": {"succeed": str(succeed), "fail": str(fail)}}


def _threshold(c: Converter, e: Element, attribute: str, default: str, count: int) -> int:
    text = e.get(attribute) or default
    number = read_number(text)
    if not isinstance(number, int):
        c.lost(e, f"{attribute}={text!r} cannot come from a key; all branches are taken")
        number = count
    if number < 0:
        number += count + 1
    return min(max(number, 1), count)


@_converts("ParallelAll")
def parallel_all(c: Converter, e: Element) -> Node:
    """Convert ``ParallelAll``: all branches come to their end, then the failures are counted."""
    failures = c.new_key("failures", Kind.INTEGER, "0")
    limit = _threshold(c, e, "max_failures", "1", len(e.children))
    count = {"set": {failures: f"${{${failures} + 1}}"}}
    branches = [{"selector": [child, dict(count)]} for child in c.children(e)]
    verdict = {"condition": f"${failures} < {limit}"}
    return {"sequence": [{"set": {failures: "0"}}, {"parallel": branches}, verdict]}


@_converts("IfThenElse", "WhileDoElse")
def if_then_else(c: Converter, e: Element) -> Node:
    """Convert ``IfThenElse``, decided once; ``WhileDoElse``, decided again with every tick."""
    if not 2 <= len(e.children) <= 3:
        return c.stand_in(e, f"it needs 2 or 3 nodes below it, not {len(e.children)}")
    node: Node = {"if": _question(c, e.children[0]), "then": c.node(e.children[1])}
    if len(e.children) == 2:
        node["else"] = {"fail": "the condition does not hold and there is no other branch"}
    elif e.children[2].tag != "AlwaysSuccess" or e.children[2].attributes:
        node["else"] = c.node(e.children[2])
    return {**node, "memory": "false"} if e.tag == "WhileDoElse" else node


def _question(c: Converter, asked: Element) -> Any:
    """Convert the condition of an ``if``: an expression where it is one, else a node."""
    if asked.tag in ("ScriptCondition", "FlorenceCondition") and set(asked.attributes) <= {"code", MARK}:
        node = c.node(asked)
        if set(node) == {"condition"}:
            return node["condition"]
        return node
    return c.node(asked)


@_converts("Switch2", "Switch3", "Switch4", "Switch5", "Switch6")
def switch(c: Converter, e: Element) -> Node:
    """Convert ``Switch2`` to ``Switch6``: to ``switch`` if the variable cannot change during a branch."""
    cases = int(e.tag.removeprefix("Switch"))
    key = pointer(e.get("variable"), "variable")
    if key is None or len(e.children) != cases + 1:
        return c.stand_in(e, f"it needs a variable and {cases + 1} nodes below it")
    kind = c.kind(key)
    written = [e.get(f"case_{number}") for number in range(1, cases + 1)]
    values = matching_cases(e, written) or [_case_value(text, kind) for text in written]
    shown = f"${c.key_name(key)}"
    if kind not in (None, Kind.TEXT) and any(written_value(text, kind)[1] for text in written):
        values, shown, kind = [text_value(text, None) for text in written], c.as_text(key), Kind.TEXT
    nodes = c.children(e)
    default = e.children[-1]
    if e.get(MARK) != "once" and c.changes_below(e, key):
        if isinstance(shown, Quoted):
            return c.stand_in(e, "its cases are not of the kind of its variable, which changes meanwhile")
        return _reactive_switch(c.key_name(key), values, kind, nodes)
    node: Node = {"switch": shown, "cases": dict(zip(values, nodes, strict=False))}
    if len(node["cases"]) < cases:
        return c.stand_in(e, "two of its cases are equal")
    if default.tag == "AlwaysFailure" and default.get(MARK) == "no_case":
        return node
    return {**node, "default": nodes[-1]}


def _case_value(text: str, kind: Kind | None) -> str:
    value, _ = written_value(text, kind)
    return value if isinstance(value, str) else text


def _reactive_switch(key: str, values: list[str], kind: Kind | None, nodes: list[Node]) -> Node:
    """Write a switch whose variable may change while a branch runs: a chain of ``if`` without memory."""
    chain = nodes[-1]
    for value, node in reversed(list(zip(values, nodes, strict=False))):
        is_text = kind in (None, Kind.TEXT) or isinstance(value, Quoted)
        shown = f'"{value}"' if is_text else value
        chain = {"if": f"${key} == {shown}", "then": node, "else": chain, "memory": "false"}
    return chain


@_converts("TryCatch")
def try_catch(c: Converter, e: Element) -> Node:
    """Convert ``TryCatch``: the last child is done when one of the others fails."""
    if len(e.children) < 2:
        return c.stand_in(e, "it needs at least 2 nodes below it")
    if e.get("catch_on_halt").lower() in ("true", "1"):
        c.lost(e, "catch_on_halt: the last node is not done when the others are stopped")
    *tried, caught = c.children(e)
    body = tried[0] if len(tried) == 1 else {"sequence": tried}
    after = {"sequence": [{"succeed": caught}, {"fail": "what was tried failed, and the last node was done"}]}
    return {"selector": [body, after]}


_CERTAIN = ("AlwaysSuccess", "ForceSuccess", "Script", "SetBlackboard", "Sleep")
"""Nodes that never fail as a clean-up."""


@_converts("Finally")
def finally_node(c: Converter, e: Element) -> Node:
    """Convert ``Finally``, since version 4.11: the second child is done after the first in any case."""
    if len(e.children) != 2:
        return c.stand_in(e, "it needs exactly 2 nodes below it")
    if e.children[1].tag not in _CERTAIN:
        c.lost(e, "when the second node fails it fails there; here the status of the first one stands")
    if "halt_timeout_msec" in e.attributes:
        c.lost(e, "halt_timeout_msec: a clean-up takes the time that it needs here")
    body, cleanup = c.children(e)
    if {"when", "while"} & set(body):
        body = {"sequence": [body]}  # a node that is skipped is not cleaned up after, and there it is
    return put(body, "finally", cleanup)


@_converts("RecoveryNode")
def recovery_node(c: Converter, e: Element) -> Node:
    """Convert Nav2's ``RecoveryNode``: after a failure of the first child the second, then the first."""
    if len(e.children) != 2:
        return c.stand_in(e, "it needs exactly 2 nodes below it")
    retries, is_endless = c.count(e, "number_of_retries", 1, least=0)
    number = c.new_key("attempt", Kind.INTEGER, "0")
    # A code of its own: a failure of the recovery must not count as one of the first child.
    code = f"{number}_failed"
    main, recovery = c.children(e)
    failed = {"fail": f"{e.get('name') or e.tag} failed", "code": code}
    if is_endless:
        body, attempts = paced({"selector": [main, {"sequence": [recovery, failed]}]}), FOREVER
    else:
        again = {"sequence": [put(recovery, "when", f"${number} <= {retries}"), failed]}
        body = {"selector": [main, again]}
        attempts = f"${{{retries} + 1}}" if retries.startswith("$") else str(int(retries) + 1)
    return {"retry": attempts, "on": [code], "attempt": number, "do": body}


@_converts("RoundRobin")
def round_robin(c: Converter, e: Element) -> Node:
    """Convert Nav2's ``RoundRobin``: each start goes on with the next child."""
    count = len(e.children)
    if e.get("wrap_around", "true").lower() not in ("true", "1"):
        c.lost(e, "wrap_around: after the last node the first one is tried here")
    turn = c.new_key("turn", Kind.INTEGER, "0")
    cases = {str(number): node for number, node in enumerate(c.children(e), start=1)}
    steps = [
        {"set": {turn: f"${{${turn} + 1}}"}},
        {"set": {turn: "1"}, "when": f"${turn} > {count}"},
        {"switch": f"${turn}", "cases": cases},
    ]
    return {"retry": str(count), "do": {"sequence": steps}}


_PACES = {"RateController": ("hz", "1"), "SpeedController": ("max_rate", "1")}
"""Nav2's decorators that start their child again -> the port with their highest rate in Hz, its default."""
_AGAIN = "100 ms"
"""Period of what is done with every tick there; a new start of a skill is not free."""


@_converts("PipelineSequence")
def pipeline_sequence(c: Converter, e: Element) -> Node:
    """Convert Nav2's ``PipelineSequence``: while a node runs, those before it are done again."""
    *earlier, last = e.children
    first = [c.node(child) for child in earlier]
    if not any(_is_done_again(c, child) for child in earlier):
        return {"sequence": [*first, c.node(last)]}
    if any(below.tag == e.tag for child in earlier for below in child.walk()):
        # A part that is done again is written twice: nested ones would grow without end.
        c.lost(e, "another PipelineSequence stands before its last node; imported as a sequence")
        return {"sequence": [*first, c.node(last)]}
    rounds: Node = {"sequence": [{"wait": _shortest_pace(c, earlier)}, *first]}
    again: Node = {"name": "again", "repeat": FOREVER, "do": rounds}
    node = _started_again(c, earlier, last)
    node = node if "name" in node else {"name": registration(last), **node}
    return {"sequence": [*first, {"parallel": [node, again], "policy": [node["name"]]}]}


def _is_done_again(c: Converter, e: Element) -> bool:
    """Tell whether it makes a difference that a node is done again: not for a goal that nothing changes."""
    goal = pointer(e.get("goal", "{goal}"), "goal")
    return e.tag != "GoalUpdatedController" or (goal is not None and c.changes_below(e, goal))


def _shortest_pace(c: Converter, earlier: list[Element]) -> str:
    periods = []
    for child in earlier:
        port, default = _PACES.get(child.tag, ("", ""))
        rate = read_number(child.get(port, default)) if port else None
        if rate is not None and rate > 0:
            periods.append(1 / rate)
        elif child.tag == "DistanceController":
            periods.append(1.0)
    return quantity_text(min(periods), Kind.DURATION) if periods else _AGAIN


def _started_again(c: Converter, earlier: list[Element], last: Element) -> Node:
    """Convert the last node of a pipeline; it starts again when a key that it reads is given another value.

    There a running node reads its ports with every tick.
    """
    written = {use.key for use in c.tree.uses_below(earlier) if use.access == WRITE}
    read = dict.fromkeys(use.key for use in c.tree.uses_below([last]) if use.access == READ)
    keys = [key for key in read if key in written and c.kind(key) is not Kind.POSE]
    node = c.node(last)
    if not keys:
        return node
    seen = {key: c.new_key(f"started with {key}", c.kind(key) or Kind.TEXT, None) for key in keys}
    same = " and ".join(f"${c.key_name(key)} == ${name}" for key, name in seen.items())
    c.notice(last, "it is stopped and started again with new values; there it goes on with them")
    steps = [{"set": {name: f"${c.key_name(key)}" for key, name in seen.items()}}, put(node, "while", same)]
    return {"retry": FOREVER, "on": ["guard_failed"], "do": {"sequence": steps}}


@_converts("RateController", "DistanceController", "SpeedController", "GoalUpdatedController")
def paced_child(c: Converter, e: Element) -> Node:
    """Convert Nav2's ``RateController`` and its like: they start their child at once, and end as it ends.

    Only what is ticked again after its end (in a ``PipelineSequence``, a reactive control) starts it again.
    """
    if e.tag == "DistanceController":
        c.lost(e, f"done again every second, not after a distance; {_ports_in_words(e)}")
    elif c.tree.is_ticked_again(e) and _is_done_again(c, e):
        c.lost(e, f"the child is done once, not again and again; {_ports_in_words(e)}")
    return {"sequence": c.children(e), "name": e.get("name") or e.tag}


@_converts("GoalUpdater")
def goal_updater(c: Converter, e: Element) -> Node:
    """Convert Nav2's ``GoalUpdater``: passes a goal on, or a newer one that comes by a topic."""
    c.lost(e, "newer goals that come by its topic are not received; the goal is passed on as it is")
    handed = {
        c.key_name(target): c.value(e, f"input_{what}", None)
        for what in ("goal", "goals")
        if (target := pointer(e.get(f"output_{what}"), what)) is not None and e.get(f"input_{what}")
    }
    before = [{"set": handed}] if handed else []
    return {"sequence": [*before, *c.children(e)], "name": e.get("name") or e.tag}


def unknown_control(c: Converter, e: Element) -> Node:
    """Convert another project's control or decorator: a skill for its own part, then the nodes below."""
    c.lost(
        e,
        "what it does with the nodes below it is not known; imported as a skill, and then these nodes in a"
        " sequence: look at it before you run it",
    )
    return {"sequence": [skill(c, e), *c.children(e)], "name": e.get("name") or registration(e)}


def _ports_in_words(e: Element) -> str:
    given = [f"{name}={value!r}" for name, value in e.attributes.items() if name not in ("ID", "name")]
    return f"{' '.join(given)} left out" if given else "imported as a sequence"


# ---- Florence nodes ------------------------------------------------------------------------------------


@_converts("FlorenceFinally")
def florence_finally(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceFinally``."""
    if len(e.children) != 2:
        return c.stand_in(e, "it needs exactly 2 nodes below it")
    body, cleanup = c.children(e)
    return put(body, "finally", cleanup)


@_converts("FlorenceUntil")
def florence_until(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceUntil``."""
    if len(e.children) != 2:
        return c.stand_in(e, "it needs exactly 2 nodes below it")
    return put(_enclosed(c.node(e.children[0])), "until", _question(c, e.children[1]))


@_converts("FlorenceInterruptible")
def florence_interruptible(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceInterruptible``."""
    if len(e.children) != 3:
        return c.stand_in(e, "it needs exactly 3 nodes below it")
    body, asked, interruption = e.children
    interrupted_by = {"if": _question(c, asked), "do": c.node(interruption)}
    return put(_enclosed(c.node(body), ANYWHERE), "interrupted_by", interrupted_by)


@_converts("FlorenceWaitUntil")
def florence_wait_until(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceWaitUntil``."""
    if len(e.children) != 1:
        return c.stand_in(e, "it needs exactly 1 node below it")
    return {"wait_until": _question(c, e.children[0])}


@_converts("FlorenceCatch")
def florence_catch(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceCatch``."""
    codes = [code.strip() for code in e.get("codes").split(";") if code.strip()]
    if len(e.children) != len(codes) + 1 or len(set(codes)) < len(codes):
        return c.stand_in(e, f"{len(e.children)} nodes do not fit the codes {e.get('codes')!r}")
    body, *handlers = c.children(e)
    return put(_enclosed(body), "on_failure", dict(zip(codes, handlers, strict=True)))


def _enclosed(body: Node, modifiers: Iterable[str] = OUTSIDE) -> Node:
    """Enclose a node whose own guards, names and clean-up stay its own when a modifier is put round it."""
    return {"sequence": [body]} if set(modifiers) & set(body) else body


@_converts("FlorenceParallel")
def florence_parallel(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceParallel``."""
    return {"parallel": c.children(e), "policy": [name.strip() for name in e.get("names").split(";")]}


@_converts("FlorenceSwitch")
def florence_switch(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceSwitch``."""
    try:
        cases = read_flow(f"[{e.get('cases')}]")
    except ConfigError as error:
        return c.stand_in(e, f"cases: {error.problem}")
    nodes = c.children(e)
    texts = [case for case in cases if isinstance(case, str)] if isinstance(cases, list) else []
    if not texts or len(set(texts)) < len(cases) or len(nodes) - len(texts) not in (0, 1):
        return c.stand_in(e, f"{len(nodes)} nodes do not fit the cases {e.get('cases')!r}")
    node: Node = {"switch": c.value(e, "value", None), "cases": dict(zip(texts, nodes, strict=False))}
    return {**node, "default": nodes[-1]} if len(nodes) > len(texts) else node


MAX_LOOP = 100
"""Most values of a loop that are written out."""


@_converts("Inverter")
def inverter(c: Converter, e: Element) -> Node:
    """Convert ``Inverter``."""
    return {"invert": c.only_child(e)}


@_converts("ForceSuccess")
def force_success(c: Converter, e: Element) -> Node:
    """Convert ``ForceSuccess``."""
    return {"succeed": c.only_child(e)}


@_converts("ForceFailure")
def force_failure(c: Converter, e: Element) -> Node:
    """Convert ``ForceFailure``."""
    child = c.only_child(e)
    return {"sequence": [child, {"fail": f"{e.get('name') or e.tag}: what is below it succeeded"}]}


@_converts("RetryUntilSuccessful", "RetryUntilSuccesful", "Repeat")
def rounds(c: Converter, e: Element) -> Node:
    """Convert ``RetryUntilSuccessful``, ``Repeat``."""
    kind, attribute = ("repeat", "num_cycles") if e.tag == "Repeat" else ("retry", "num_attempts")
    number, is_endless = c.count(e, attribute, 1)
    child = c.only_child(e)
    return {kind: number, "do": paced(child) if is_endless and e.get(MARK) != ENDLESS else child}


@_converts("KeepRunningUntilFailure")
def keep_running(c: Converter, e: Element) -> Node:
    """Convert ``KeepRunningUntilFailure``."""
    return {"repeat": FOREVER, "do": paced(c.only_child(e))}


@_converts("Timeout")
def timeout(c: Converter, e: Element) -> Node:
    """Convert ``Timeout``."""
    return {"timeout": c.milliseconds(e, "msec"), "do": c.only_child(e)}


@_converts("Delay")
def delay(c: Converter, e: Element) -> Node:
    """Convert ``Delay``."""
    return {"sequence": [{"wait": c.milliseconds(e, "delay_msec")}, c.only_child(e)]}


@_converts("RunOnce")
def run_once(c: Converter, e: Element) -> Node:
    """Convert ``RunOnce``."""
    if e.get("then_skip", "true").lower() not in ("false", "0"):
        c.lost(e, "later starts are skipped there; here they end like the first")
    return {"once": c.only_child(e)}


@_converts("Precondition")
def precondition(c: Converter, e: Element) -> Node:
    """Convert ``Precondition``: evaluated before the child starts, not while it runs."""
    text = c.condition(e, e.get("if"))
    child = c.only_child(e)
    if text is None:
        return c.stand_in(e, "its condition has no equivalent")
    match e.get("else", "FAILURE").upper():
        case "SKIPPED":
            return put(child, "when", text)
        case "SUCCESS":
            return {"if": text, "then": child, "else": dict(NOTHING)}
        case "RUNNING":
            waiting = {"retry": FOREVER, "do": paced({"condition": text})}
            return {"sequence": [waiting, child]}
        case "FAILURE":
            return {"if": text, "then": child, "else": {"fail": f"{text} does not hold"}}
    return c.stand_in(e, f"else={e.get('else')!r} is not a status")


@_converts("LoopInt", "LoopDouble", "LoopString", "LoopBool")
def loop(c: Converter, e: Element) -> Node:
    """Convert ``LoopInt`` and its like, for a queue that is written out."""
    queue, target = e.get("queue"), pointer(e.get("value"), "value")
    if pointer(queue, "queue") is not None or queue.startswith("json:") or target is None:
        return c.stand_in(e, "a queue that comes from a key has no equivalent")
    items = [item for item in queue.split(";") if item.strip()]
    if len(items) > MAX_LOOP:
        return c.stand_in(e, f"a queue of {len(items)} values is too long to be written out")
    if not items:
        empty = e.get("if_empty", "SUCCESS").upper()
        return dict(NOTHING) if empty != "FAILURE" else {"fail": "the queue is empty"}
    key = c.key_name(target)
    kind = c.kind(target) or LOOP_KINDS[e.tag]
    number = c.new_key("round", Kind.INTEGER, "0")
    values: dict[str, Node] = {}
    for item in items:
        value, problem = (
            (text_value(item, None), "") if kind is Kind.TEXT else written_value(item.strip(), kind)
        )
        if problem:
            c.lost(e, problem)
        values[str(len(values) + 1)] = {"set": {key: value}}
    count = {"set": {number: f"${{${number} + 1}}"}}
    rounds = {"sequence": [count, {"switch": f"${number}", "cases": values}, c.only_child(e)]}
    return {"sequence": [{"set": {number: "0"}}, {"repeat": str(len(items)), "do": rounds}]}


@_converts("ManualSelector", "SkipUnlessUpdated", "WaitValueUpdate", "BlackboardCheck", "WasEntryUpdated")
def without_equivalent(c: Converter, e: Element) -> Node:
    """Refuse nodes about how often a key was written, and others that missions do not have."""
    return c.stand_in(e, "no node of a mission does this")


# ---- Florence nodes ------------------------------------------------------------------------------------


@_converts("FlorenceRetry")
def florence_retry(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceRetry``: what is tried, and perhaps what is done between two attempts."""
    if not 1 <= len(e.children) <= 2:
        return c.stand_in(e, "it needs 1 or 2 nodes below it")
    endless = e.get("num_attempts") == "-1"
    node: Node = {"retry": FOREVER if endless else c.value(e, "num_attempts", Kind.INTEGER)}
    codes = [code.strip() for code in e.get("on").split(";") if code.strip()]
    if codes:
        node["on"] = codes
    attempt = pointer(e.get("attempt"), "attempt")
    if attempt is not None:
        node["attempt"] = c.key_name(attempt)
    child, *between = c.children(e)
    return {**node, "do": child, **({"between": between[0]} if between else {})}


@_converts("FlorenceForEach")
def florence_for_each(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceForEach``."""
    item, index = (pointer(e.get(name), name) for name in ("as", "index"))
    if item is None:
        return c.stand_in(e, "it needs a key for the item under as")
    node: Node = {"for_each": c.value(e, "items", None), "as": c.key_name(item)}
    if index is not None:
        node["index"] = c.key_name(index)
    codes = [code.strip() for code in e.get("go_on_over").split(";") if code.strip()]
    if codes:
        node["go_on_over"] = codes
    if e.get("first_success") == "true":
        node["first_success"] = "true"
    return {**node, "do": c.only_child(e)}


@_converts("FlorenceTimeout")
def florence_timeout(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceTimeout``: a duration that comes from a key."""
    return {"timeout": c.value(e, "seconds", Kind.DURATION), "do": c.only_child(e)}


@_converts("FlorenceGuard")
def florence_guard(c: Converter, e: Element) -> Node:
    """Convert ``FlorenceGuard``."""
    node = c.only_child(e)
    for guard in ("when", "while"):
        if e.get(guard):
            node = put(node, guard, e.get(guard))
    return put(node, "when", negated(e.get("unless"))) if e.get("unless") else node
