"""One tree of BehaviorTree.CPP to the nodes of a mission: the walk, and what every node can have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from florence_bt.btcpp.convert_scripts import set_nodes
from florence_bt.btcpp.key_uses import Ports, pointer, registration
from florence_bt.btcpp.notes import LossNotes
from florence_bt.btcpp.script import Unary, order_matters, parse_expression, parse_script
from florence_bt.btcpp.script_terms import condition_text
from florence_bt.btcpp.si_values import quantity_text, read_number
from florence_bt.btcpp.skill_book import SkillBook
from florence_bt.btcpp.skipping import kept, lift, with_guards_above
from florence_bt.btcpp.tree_facts import Facts, TreeFacts
from florence_bt.btcpp.trust import trusted, trusted_guards, trusted_values
from florence_bt.btcpp.values_in import text_value, written_value
from florence_bt.btcpp.vocabulary import FOREVER, MARK, POLL
from florence_bt.btcpp.written import read_flow
from florence_bt.btcpp.xml_source import Element
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError

Node = dict[str, Any]
"""A node as it is written in a mission file."""
NOTHING: Node = {"condition": "true"}
"""Succeeds at once."""
NOT_IMPORTED = "not_imported"
"""The code of what stands for a node without an equivalent."""

Handler = Callable[["Converter", Element], Node]


class Converter:
    """Converts the nodes of one tree.

    Args:
        facts: What is known about all trees.
        tree: What is known about this one.
        ports: The ports of all nodes.
        book: Collects the nodes that are skills.
        missions: Tree ID -> name of its mission.
        notes: Receives what has no equivalent.
        handlers: Element -> what converts it; None is for every other element.
    """

    def __init__(
        self,
        facts: Facts,
        tree: TreeFacts,
        ports: Ports,
        book: SkillBook,
        missions: Mapping[str, str],
        notes: LossNotes,
        handlers: Mapping[str | None, Handler],
    ) -> None:
        self.facts = facts
        self.tree = tree
        self.ports = ports
        self.book = book
        self.missions = missions
        self.keys: dict[str, Node] = {}
        self._notes = notes
        self._handlers = handlers

    # ---- names and values: the scope of scripts ------------------------------------------------------------

    def key(self, foreign: str) -> str | None:
        """Our name of a key; None for a name in capitals that nothing writes: an enumeration value."""
        if foreign.isupper() and foreign not in self.tree.written and foreign not in self.tree.pointed:
            return None
        return self.key_name(foreign)

    def key_name(self, foreign: str) -> str:
        """Our name of a key."""
        return self.tree.key_name(foreign, self.facts.main)

    def kind(self, foreign: str) -> Kind | None:
        """The kind of a key."""
        return self.facts.kind(self.tree.tree.name, self.tree.local(foreign, self.facts.main))

    def new_key(self, wanted: str, kind: Kind, default: str | None) -> str:
        """A key that the mission needs for itself, with its value at the start if it has one."""
        name = self.tree.names.of(f"{wanted} {len(self.keys) + 1}")
        self.keys[name] = (
            {"type": kind.value} if default is None else {"type": kind.value, "default": default}
        )
        return name

    def start_with(self, foreign: str, kind: Kind, default: str) -> None:
        """Give a key that the tree writes a value at the start."""
        if foreign not in self.tree.all_inputs(self.facts):
            self.keys[self.key_name(foreign)] = {"type": kind.value, "default": default}

    def value(self, element: Element, attribute: str, kind: Kind | None) -> Any:
        """The value of an attribute as it is written in a mission."""
        text = element.get(attribute)
        key = pointer(text, attribute)
        if key is not None:
            return f"${self.key_name(key)}"
        value, problem = written_value(text, kind)
        if problem:
            self.lost(element, f"{attribute}: {problem}")
        return value

    def condition(self, element: Element, script: str, mark: str = MARK) -> str | None:
        """A script that is asked whether it holds, as an expression; None (noted) without equivalent."""
        own = trusted(element, mark, script)
        if own is not None:
            return own
        try:
            self._note_order(element, script)
            return condition_text(parse_expression(script), self)
        except ConfigError as error:
            self.lost(element, f"the condition {script!r}: {error.problem}")
            return None

    def own_words(self, element: Element, text: str) -> Any:
        """A value of one of our own marks."""
        try:
            return read_flow(text)
        except ConfigError as error:
            self.lost(element, f"{text!r}: {error.problem}")
            return text_value(text, None)

    def milliseconds(self, element: Element, attribute: str) -> Any:
        """A duration that is given in milliseconds."""
        key = pointer(element.get(attribute), attribute)
        if key is not None:
            seconds = "0.001" if self.kind(key) is Kind.DURATION else "0.001 s"
            return f"${{${self.key_name(key)} * {seconds}}}"
        number = read_number(element.get(attribute))
        if number is None or number < 0:
            self.lost(
                element, f"{attribute}={element.get(attribute)!r} is no number of milliseconds; 0 is taken"
            )
            number = 0
        return quantity_text(number / 1000, Kind.DURATION)

    def count(self, element: Element, attribute: str, default: int) -> tuple[str, bool]:
        """A number of rounds, and whether it means for ever."""
        text = element.get(attribute, str(default))
        key = pointer(text, attribute)
        if key is not None:
            return f"${self.key_name(key)}", False
        number = read_number(text)
        if not isinstance(number, int) or number < -1:
            self.lost(element, f"{attribute}={text!r} is no number of rounds; {default} is taken")
            number = default
        return (str(FOREVER), True) if number == -1 else (str(max(number, 1)), False)

    # ---- nodes ---------------------------------------------------------------------------------------------

    def node(self, element: Element) -> Node:
        """Convert an element with everything below it."""
        handler = self._handlers.get(element.tag, self._handlers[None])
        node, different = with_guards_above(element, handler(self, element))
        if different:
            self.lost(element, different)
        written = element.get("name").strip()
        if written not in ("", registration(element), node.get("name")):
            node = put(node, "name", written)
        return arranged(self._with_conditions(element, node))

    def trusted_set(self, element: Element) -> Any:
        """The values of our own mark on a ``Script``, None when it does not say what the script says."""
        return trusted_values(element)

    def direction(self, element: Element, attribute: str) -> str:
        """Whether a port that no model describes is read or written here."""
        if pointer(element.get(attribute), attribute) is None:
            return "in"
        return "out" if (registration(element), attribute) in self.tree.writing_ports else "in"

    def changes_below(self, element: Element, key: str) -> bool:
        """Whether a key may change while a branch of an element runs."""
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
        """What stands for a node without an equivalent: it fails and says so."""
        self.lost(element, f"{message}; in its place stands a node that fails")
        reason = f"{registration(element)} (line {element.position.line}) has no equivalent"
        return {"fail": reason, "code": NOT_IMPORTED}

    def _note_order(self, element: Element, script: str) -> None:
        if order_matters(script):
            message = f"{script!r} is computed from the left, as since version 4.9; from the right before"
            self.notice(element, message)

    def scripts(self, element: Element, text: str) -> list[Node]:
        """The assignments of a script as nodes."""
        try:
            self._note_order(element, text)
            return set_nodes(parse_script(text), self, lambda message: self.notice(element, message))
        except ConfigError as error:
            return [self.stand_in(element, f"the script {text!r}: {error.problem}")]

    # ---- conditions before and scripts after ---------------------------------------------------------------

    def _with_conditions(self, element: Element, node: Node) -> Node:
        started = element.get("_onStart")
        if started:
            node = {"sequence": [*self.scripts(element, started), node]}
        node, guards = lift(node)  # a node that is skipped has no scripts done after it
        succeeds, fails = (self._asked(element, name) for name in ("_successIf", "_failureIf"))
        if succeeds is not None:
            node = {"if": succeeds, "then": dict(NOTHING), "else": node}
        if fails is not None:
            node = {"if": fails, "then": {"fail": f"_failureIf: {fails}"}, "else": node}
        node = self._with_scripts(element, node)
        before = [asked for asked in (fails, succeeds) if asked is not None]
        if before and guards:
            guards = {"unless": _all([f"not ({kept(guards)})", *_none_of(before)])}
        for name, guard in guards.items():
            node = put(node, name, guard)
        node = self._with_skip(element, node, before)
        return self._with_because(element, node)

    def _asked(self, element: Element, name: str) -> str | None:
        return (
            self.condition(element, element.get(name), f"{MARK}{name}")
            if name in element.attributes
            else None
        )

    def _with_skip(self, element: Element, node: Node, before: list[str]) -> Node:
        if "_skipIf" in element.attributes:
            own = trusted_guards(element)
            if own is not None:
                for guard, text in own.items():
                    node = put(node, guard, text)
            else:
                node = self._skipped(element, node, before)
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
            put(node, "unless", _all([f"not ({needed})", *_none_of(before)]))
            if before
            else put(node, "when", needed)
        )

    def _skipped(self, element: Element, node: Node, before: list[str]) -> Node:
        script = element.get("_skipIf")
        text = self.condition(element, script)
        if text is None:
            return node
        if before:
            return put(node, "unless", _all([f"({text})", *_none_of(before)]))
        code = parse_expression(script)
        if isinstance(code, Unary) and code.operator == "!":
            return put(node, "when", condition_text(code.operand, self))
        return put(node, "unless", text)

    def _with_scripts(self, element: Element, node: Node) -> Node:
        post, halted = element.get("_post"), element.get("_onHalted")
        if halted and halted == post:
            node = put(node, "finally", _one(self.scripts(element, halted)))
            post, halted = "", ""
        on_success = [
            name for name in ("_onSuccess", "_post") if element.get(name) and (name != "_post" or post)
        ]
        on_failure = [
            name for name in ("_onFailure", "_post") if element.get(name) and (name != "_post" or post)
        ]
        if on_failure:
            done = [each for name in on_failure for each in self.scripts(element, element.get(name))]
            fail = {"fail": f"{element.get('name') or registration(element)} failed"}
            node = {"selector": [node, {"sequence": [*done, fail]}]}
        if on_success:
            done = [each for name in on_success for each in self.scripts(element, element.get(name))]
            node = {"sequence": [node, *done]}
        if halted:
            self.lost(element, f"_onHalted={halted!r}: nothing runs only when a node is stopped")
        return node

    def _with_because(self, element: Element, node: Node) -> Node:
        text = element.get(f"{MARK}_because")
        if not text:
            return node
        return put(node, "because", self.own_words(element, text))


def put(node: Node, modifier: str, value: Any) -> Node:
    """Add a modifier; a second guard joins the first, what else is there twice stands round the node."""
    if modifier in node:
        if modifier in _JOINED:
            return {**node, modifier: f"({node[modifier]}) {_JOINED[modifier]} ({value})"}
        node = {"sequence": [node]}
    return {**node, modifier: value}


_JOINED = {"when": "and", "while": "and", "unless": "or"}
"""Guards -> what joins two of them."""


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


_FIRST = ("name", "when", "unless", "while", "because")


def paced(node: Node) -> Node:
    """A node that is tried for ever, with BehaviorTree.CPP's pause before each trial."""
    return {"delay": POLL, "do": node}


def _one(nodes: list[Node]) -> Node:
    return nodes[0] if len(nodes) == 1 else {"sequence": nodes}
