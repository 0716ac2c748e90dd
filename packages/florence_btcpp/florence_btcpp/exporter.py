"""Missions to one XML file of BehaviorTree.CPP 4.

What BehaviorTree.CPP can do is written with its own nodes, values in SI units. Beside it stand marks with the
author's own words, which only our import reads. What it cannot do is a ``Florence`` node (see
``known_nodes.xml``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.trees import kinds
from florence_bt.trees.kinds import PolicyKind
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import chain_back, cycles
from florence_bt.trees.language.declared_skills import port_document
from florence_bt.trees.language.expressions import syntax
from florence_bt.trees.language.expressions.syntax import Term, parts_of
from florence_bt.trees.language.findings import Finding, raise_first_error
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Expression, Literal, Mission, Node, Reference, Value
from florence_bt.trees.language.quantities import format_value, read_value
from florence_btcpp.mission_text import write_flow
from florence_btcpp.node_models import known_nodes
from florence_btcpp.notes import LossNotes
from florence_btcpp.round_trip import skip_script
from florence_btcpp.script import Inexpressible, needs_mark, script_of, set_script, term_needs_mark
from florence_btcpp.values import case_text, flow_value, own_value, port_attribute, script_number, si_text
from florence_btcpp.vocabulary import (
    CATEGORIES,
    ENDLESS,
    FORMAT,
    KIND_TYPES,
    KIND_UNITS,
    MARK,
    private_key,
)
from florence_btcpp.xml_source import Element


def write_xml(root: Element) -> str:
    """Write an element with everything below as the text of a file."""
    tree = _xml(root)
    ElementTree.indent(tree)
    # A sign > in a value is escaped, so this ends elements only.
    text = ElementTree.tostring(tree, encoding="unicode").replace(" />", "/>")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _xml(element: Element) -> ElementTree.Element:
    attributes = {name: _allowed(value) for name, value in element.attributes.items()}
    made = ElementTree.Element(element.tag, attributes)
    made.text = _allowed(element.text)
    made.extend(map(_xml, element.children))
    return made


def _allowed(text: str) -> str:
    """Replace what XML 1.0 cannot hold at all by the sign for that."""
    return "".join(char if char >= " " or char in "\t\n\r" else "�" for char in text)


_COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")


def computed_inputs(mission: Mission) -> list[str]:
    """Return the inputs with which a script of the exported mission computes."""
    used = {key for node in mission.nodes() for key in _computed_by(node)}
    texts = (Kind.TEXT, Kind.POSE)
    return [name for name, port in mission.inputs.items() if name in used and port.kind not in texts]


def _computed_by(node: Node) -> Iterator[str]:
    for guard in (node.when, node.holds):
        if guard is not None:
            yield from _computed(guard.term, is_condition=True)
    match node:
        case kinds.Condition(condition=condition):
            yield from _computed(condition.term, is_condition=True)
        case kinds.If(condition=Expression() as condition):
            yield from _computed(condition.term, is_condition=True)
        case kinds.Switch(value=Reference(key=key)) if all(
            c.text in ("true", "false") for c, _ in node.cases
        ):
            yield key
        case kinds.Set(values=values):
            for _, value in values:
                if isinstance(value, Expression):
                    yield from _computed(value.term, is_condition=False)


def _computed(term: Term, *, is_condition: bool) -> Iterator[str]:
    match term:
        case syntax.Key(key=key):
            if is_condition:
                yield key
        case syntax.Binary(operator=operator, left=left, right=right) if operator in _COMPARISONS:
            for side in (left, right):
                yield from _computed(side, is_condition=False)
        case _:
            for part in parts_of(term):
                yield from _computed(part, is_condition=True)


MAX_CASES = 6
"""Most cases that a ``Switch`` of BehaviorTree.CPP has."""
_TURNING = (kinds.Invert, kinds.Succeed, kinds.Once)
_SKIPPED = "in BehaviorTree.CPP it is skipped when what is below is skipped; here that is success or failure"


class NodeWriter:
    """Writes the nodes of one mission.

    Args:
        mission: The mission.
        library: Where called missions are found.
        declarations: The skills by name.
        notes: Receives what BehaviorTree.CPP would do differently.
    """

    def __init__(
        self,
        mission: Mission,
        library: MissionLibrary,
        declarations: Mapping[str, SkillDeclaration],
        notes: LossNotes,
    ) -> None:
        self._mission = mission
        self._library = library
        self._declarations = declarations
        self._notes = notes

    def node(self, node: Node) -> Element:
        """Make an element for a node, with guards, clean-up and words for failures around or on it.

        Raises:
            ConfigError: A value is wrong, which a check would have found.
        """
        try:
            element = self._bare(node)
        except ConfigError as error:
            if error.file is not None:
                raise
            place = node.position
            file = self._mission.file
            raise ConfigError(
                error.problem, file=file, line=place.line, column=place.column, valid=error.valid
            ) from error
        if node.cleanup is not None:
            element = _control("FlorenceFinally", [element, self.node(node.cleanup)])
        element = self._guarded(node, element)
        if node.name is not None:
            element.attributes = _named(element.attributes, node.name)
        if node.code is not None:
            element.attributes[f"{MARK}_code"] = node.code.text
        if node.reasons is not None:
            element.attributes[f"{MARK}_because"] = own_value(_reasons(node.reasons))
        return element

    # ---- guards ----------------------------------------------------------------------------------------

    def _guarded(self, node: Node, element: Element) -> Element:
        try:
            guards = self._native_guards(node)
        except Inexpressible as error:
            self._florence_node(node, "FlorenceGuard", error.problem)
            texts = {"when": node.when, "while": node.holds}
            given = {name: guard.text for name, guard in texts.items() if guard is not None}
            return _florence("Decorator", "FlorenceGuard", given, [element])
        if node.holds is not None:
            condition = self._condition(node.holds)
            element = Element("ReactiveSequence", {MARK: "while"}, children=[condition, element])
        element.attributes.update(guards)
        return element

    def _native_guards(self, node: Node) -> dict[str, str]:
        """Write ``when`` as ``_skipIf``; ``while`` is only tried."""
        if node.holds is not None:
            script_of(node.holds.term)
        if node.when is None:
            return {}
        return {"_skipIf": skip_script(node.when.term), f"{MARK}_when": node.when.text}

    def _condition(self, expression: Expression) -> Element:
        attributes = {"code": script_of(expression.term)}
        if term_needs_mark(expression.term):
            attributes[MARK] = expression.text
        return Element("ScriptCondition", attributes)

    # ---- nodes -----------------------------------------------------------------------------------------

    def _bare(self, node: Node) -> Element:
        match node:
            case kinds.Sequence(children=children, memory=memory):
                return Element("Sequence" if memory else "ReactiveSequence", {}, children=self._all(children))
            case kinds.Selector(children=children, memory=memory):
                if all(child.when is not None for child in children):
                    self._differs(node, _SKIPPED)
                return Element("Fallback" if memory else "ReactiveFallback", {}, children=self._all(children))
            case kinds.Parallel():
                return self._parallel(node)
            case kinds.If():
                return self._if(node)
            case kinds.Switch():
                return self._switch(node)
            case kinds.WaitUntil(goal=goal):
                reason = "BehaviorTree.CPP has no node that asks a condition until it holds"
                self._florence_node(node, "FlorenceWaitUntil", reason)
                return _control("FlorenceWaitUntil", [self.node(goal)])
            case model.Wrapper():
                return self._wrapper(node)
        return self._leaf(node)

    def _no_element(self, node: Node) -> ConfigError:
        problem = f"{node.kind.word!r} has no element for BehaviorTree.CPP, and none of our own"
        return _error_at(
            self._mission, node, problem, ("florence_btcpp/exporter.py, which writes the others",)
        )

    def _all(self, nodes: tuple[Node, ...]) -> list[Element]:
        return [self.node(node) for node in nodes]

    def _parallel(self, node: kinds.Parallel) -> Element:
        children, policy = self._all(node.children), node.policy
        if policy.kind is PolicyKind.SELECTED:
            self._florence_node(
                node, "FlorenceParallel", "BehaviorTree.CPP counts branches and does not name them"
            )
            names = ";".join(name.text for name in policy.names)
            return _florence("Control", "FlorenceParallel", {"names": names}, children)
        count = len(children)
        succeed = policy.successes_needed(count)
        fail = count if policy.kind is PolicyKind.ANY else 1
        if policy.kind is PolicyKind.COUNTED:
            fail = policy.fail if policy.fail is not None else count - succeed + 1
        thresholds = {"success_count": "-1" if succeed == count else str(succeed), "failure_count": str(fail)}
        return Element("Parallel", thresholds, children=children)

    def _if(self, node: kinds.If) -> Element:
        if isinstance(node.condition, Node):
            condition = self.node(node.condition)
        else:
            condition = self._condition_node(node, node.condition)
        otherwise = self.node(node.otherwise) if node.otherwise is not None else Element("AlwaysSuccess", {})
        tag = "IfThenElse" if node.memory else "WhileDoElse"
        return Element(tag, {}, children=[condition, self.node(node.then), otherwise])

    def _condition_node(self, node: Node, expression: Expression) -> Element:
        try:
            return self._condition(expression)
        except Inexpressible as error:
            self._florence_node(node, "FlorenceCondition", error.problem)
            return _florence("Condition", "FlorenceCondition", {"code": expression.text})

    def _switch(self, node: kinds.Switch) -> Element:
        texts = [case.text for case, _ in node.cases]
        children = [self.node(child) for _, child in node.cases]
        native = isinstance(node.value, Reference) and 2 <= len(texts) <= MAX_CASES
        if not native or any(case.quoted or "{" in case.text for case, _ in node.cases):
            self._florence_node(
                node, "FlorenceSwitch", f"a Switch takes a key and 2 to {MAX_CASES} plain cases"
            )
            cases = write_flow([flow_value(case) for case, _ in node.cases])[1:-1]
            default = [self.node(node.default)] if node.default is not None else []
            value = port_attribute(node.value, None)
            return _florence(
                "Control", "FlorenceSwitch", {"value": value, "cases": cases}, [*children, *default]
            )
        if node.default is not None:
            children.append(self.node(node.default))
        else:
            children.append(Element("AlwaysFailure", {MARK: "no_case"}))
        declared = self._declared_kind(node.value)
        shown = [case_text(case, declared) for case, _ in node.cases]
        attributes = {"variable": port_attribute(node.value, None), MARK: "once"}
        attributes |= {f"case_{number}": case for number, case in enumerate(shown, start=1)}
        if shown != texts:
            attributes[f"{MARK}_cases"] = write_flow(texts)[1:-1]
        return Element(f"Switch{len(texts)}", attributes, children=children)

    def _declared_kind(self, value: Value | Expression) -> Kind | None:
        if not isinstance(value, Reference):
            return None
        port = self._mission.keys.get(value.key) or self._mission.inputs.get(value.key)
        return port.kind if port is not None else None

    def _wrapper(self, node: model.Wrapper) -> Element:
        children = [self.node(node.child)]
        if isinstance(node, _TURNING) and node.child.when is not None:
            self._differs(node, _SKIPPED)
        match node:
            case kinds.Invert():
                return Element("Inverter", {}, children=children)
            case kinds.Succeed():
                return Element("ForceSuccess", {}, children=children)
            case kinds.Once():
                return Element("RunOnce", {"then_skip": "false"}, children=children)
            case kinds.Retry():
                if node.between is not None:
                    children.append(self.node(node.between))
                return self._retry(node, children)
            case kinds.Repeat(rounds=None):
                return Element("Repeat", {"num_cycles": "-1", MARK: ENDLESS}, children=children)
            case kinds.ForEach():
                return self._for_each(node, children)
            case kinds.OnFailure(handlers=handlers):
                self._florence_node(node, "FlorenceCatch", "BehaviorTree.CPP knows no failure codes")
                codes = {"codes": ";".join(code.text for code, _ in handlers)}
                children += [self.node(each) for _, each in handlers]
                return _florence("Control", "FlorenceCatch", codes, children)
            case kinds.Until(goal=goal):
                reason = "BehaviorTree.CPP has no node that ends another one with success"
                self._florence_node(node, "FlorenceUntil", reason)
                return _control("FlorenceUntil", [*children, self.node(goal)])
            case kinds.Interruptible(goal=goal, interruption=interruption):
                reason = "BehaviorTree.CPP has no node that goes on where it was interrupted"
                self._florence_node(node, "FlorenceInterruptible", reason)
                children += [self.node(goal), self.node(interruption)]
                return _control("FlorenceInterruptible", children)
            case kinds.Repeat(rounds=rounds):
                assert rounds is not None  # that was a case above
                if not isinstance(rounds, Literal | Reference):
                    self._differs(node, "a Repeat cannot compute its number of rounds")
                return Element(
                    "Repeat", {"num_cycles": port_attribute(rounds, Kind.INTEGER)}, children=children
                )
            case kinds.Timeout(duration=duration):
                return self._timed(node, duration, ("Timeout", "msec"), "FlorenceTimeout", children)
        raise self._no_element(node)

    def _for_each(self, node: kinds.ForEach, children: list[Element]) -> Element:
        self._florence_node(node, "FlorenceForEach", "BehaviorTree.CPP loops over queues, not over lists")
        attributes = {"items": port_attribute(node.items, None), "as": f"{{{node.item_key.text}}}"}
        if node.index_key is not None:
            attributes["index"] = f"{{{node.index_key.text}}}"
        if node.goes_on_over:
            attributes["go_on_over"] = ";".join(code.text for code in node.goes_on_over)
        if node.first_success:
            attributes["first_success"] = "true"
        return _florence("Decorator", "FlorenceForEach", attributes, children)

    def _retry(self, node: kinds.Retry, children: list[Element]) -> Element:
        endless = {"num_attempts": "-1", MARK: ENDLESS}
        attributes = dict(endless)
        if node.attempts is not None:
            attributes = {"num_attempts": port_attribute(node.attempts, Kind.INTEGER)}
        plain = node.attempts is None or isinstance(node.attempts, Literal | Reference)
        if plain and not node.on and node.attempt_key is None and node.between is None:
            return Element("RetryUntilSuccessful", attributes, children=children)
        self._florence_node(
            node,
            "FlorenceRetry",
            "RetryUntilSuccessful knows no failure codes, no number of the attempt, nothing between",
        )
        if node.on:
            attributes["on"] = ";".join(code.text for code in node.on)
        if node.attempt_key is not None:
            attributes["attempt"] = f"{{{node.attempt_key.text}}}"
        return _florence("Control", "FlorenceRetry", attributes, children)

    def _timed(
        self, node: Node, duration: Value, native: tuple[str, str], own: str, children: list[Element]
    ) -> Element:
        milliseconds = _milliseconds(duration)
        if milliseconds is not None:
            return Element(native[0], {native[1]: str(milliseconds)}, children=children)
        self._florence_node(node, own, f"{native[0]} takes whole milliseconds, and keys hold seconds")
        category = "Decorator" if children else "Action"
        return _florence(category, own, {"seconds": port_attribute(duration, Kind.DURATION)}, children)

    # ---- leaves ----------------------------------------------------------------------------------------

    def _leaf(self, node: Node) -> Element:
        match node:
            case kinds.Condition(condition=condition):
                return self._condition_node(node, condition)
            case kinds.Wait(duration=duration):
                return self._timed(node, duration, ("Sleep", "msec"), "FlorenceWait", [])
            case kinds.Fail(reason=reason):
                return Element("AlwaysFailure", {f"{MARK}_reason": own_value(reason)})
            case kinds.Set():
                return self._set(node)
            case kinds.Append(values=values):
                self._florence_node(node, "FlorenceAppend", "the scripts of BehaviorTree.CPP have no lists")
                text = write_flow({key.text: flow_value(value) for key, value in values})[1:-1]
                return _florence("Action", "FlorenceAppend", {"values": text})
            case kinds.RunSkill():
                return self._use(node)
            case kinds.CallMission():
                return self._call(node)
        raise self._no_element(node)

    def _set(self, node: kinds.Set) -> Element:
        text = write_flow({key.text: flow_value(value) for key, value in node.values})[1:-1]
        try:
            attributes = {"code": set_script(node.values)}
        except Inexpressible as error:
            self._florence_node(node, "FlorenceSet", error.problem)
            return _florence("Action", "FlorenceSet", {"values": text})
        if any(needs_mark(value) for _, value in node.values):
            attributes[f"{MARK}_set"] = text
        return Element("Script", attributes)

    def _use(self, node: kinds.RunSkill) -> Element:
        declaration = self._declarations[node.skill]
        attributes = {"ID": node.skill, **self._given(node, node.inputs, declaration.inputs)}
        for output, key in node.outputs:
            name = f"out_{output.text}" if output.text in declaration.inputs else output.text
            attributes[name] = f"{{{key.text}}}"
        if node.every is not None:
            attributes[f"{MARK}_every"] = format_value(node.every, Kind.DURATION)
        return Element(
            "Condition" if declaration.instant and not declaration.outputs else "Action", attributes
        )

    def _call(self, node: kinds.CallMission) -> Element:
        called = self._library.get(node.mission.text)
        attributes = {"ID": called.name, **self._given(node, node.inputs, called.inputs)}
        for name in computed_inputs(called):
            if not attributes.get(name, "").startswith("{"):
                message = f"{name}: BehaviorTree.CPP passes text, and {called.name} computes with it"
                self._differs(node, message, ["a key that holds the value"])
        for output, key in node.outputs:
            if output.text in attributes:
                self._differs(
                    node, f"the output {output.text!r} is an input too and goes back to the same key"
                )
            attributes[output.text] = f"{{{key.text}}}"
        return Element("SubTree", attributes)

    def _given(
        self, node: Node, inputs: tuple[tuple[Literal, Value], ...], ports: Mapping[str, Port]
    ) -> dict[str, str]:
        attributes = {}
        for name, value in inputs:
            attributes[name.text] = port_attribute(value, ports[name.text].kind)
            if attributes[name.text].startswith("florence:") and not isinstance(value, Literal):
                self._differs(node, f"{name.text}: BehaviorTree.CPP does not compute values of ports")
        return attributes

    # ---- notes -----------------------------------------------------------------------------------------

    def _florence_node(self, node: Node, name: str, reason: str) -> None:
        message = f"{reason}; written as {name}, which must be registered with BehaviorTree.CPP"
        self._notes.notice(self._mission.file, node.position, message)

    def _differs(self, node: Node, message: str, valid: Sequence[str] = ()) -> None:
        self._notes.lost(self._mission.file, node.position, message, valid)


def _milliseconds(duration: Value) -> int | None:
    """Return a duration that is written out, in milliseconds; None when it is not, or not whole."""
    if not isinstance(duration, Literal):
        return None
    seconds = read_value(duration.text, Kind.DURATION)
    number = round(seconds * 1000)
    return number if number / 1000 == seconds else None


def _reasons(reasons: model.Reasons) -> Value | dict[str, Value]:
    return reasons.always if reasons.always is not None else dict(reasons.by_code)


def _named(attributes: dict[str, str], name: str) -> dict[str, str]:
    """Put the name right behind the ID."""
    first = {"ID": attributes["ID"]} if "ID" in attributes else {}
    return {**first, "name": name, **{key: value for key, value in attributes.items() if key != "ID"}}


def _florence(
    category: str, name: str, attributes: dict[str, str], children: list[Element] | None = None
) -> Element:
    return Element(category, {"ID": name, **attributes}, children=children or [])


def _control(name: str, children: list[Element]) -> Element:
    return _florence("Control", name, {}, children)


@dataclass(frozen=True)
class Exported:
    """The result of an export.

    Attributes:
        xml: The text of the file.
        trees: The missions in it, the exported one first.
        findings: What BehaviorTree.CPP would do differently (warnings), and which of our nodes it needs
            (notices).
    """

    xml: str
    trees: tuple[str, ...]
    findings: tuple[Finding, ...]


def export_mission(
    name: str, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> Exported:
    """Write a mission, and those that it calls.

    Args:
        name: The mission.
        library: Where the missions are found.
        declarations: The skills by name.

    Raises:
        ConfigError: A mission or a skill does not exist, or a mission has an error that a check would find.
    """
    notes = LossNotes()
    missions = _with_called(name, library)
    declarations = {**declarations}
    root = Element("root", {"BTCPP_format": FORMAT, "main_tree_to_execute": name})
    for mission in missions:
        _check_mission(mission, declarations)
        root.children.append(_tree(mission, library, declarations, notes))
    models = _models(missions, declarations, list(root.children))
    _make_compact(root, missions)
    root.children.append(models)
    return Exported(write_xml(root), tuple(mission.name for mission in missions), tuple(notes.findings))


def _with_called(name: str, library: MissionLibrary) -> list[Mission]:
    found = {name: library.get(name)}
    callees: dict[str, list[str]] = {}
    for caller in (waiting := [name]):
        mission = found[caller]
        calls = [node for node in mission.nodes() if isinstance(node, kinds.CallMission)]
        callees[caller] = [call.mission.text for call in calls]
        for call in calls:
            called = call.mission.text
            if library.find(called) is None:
                problem = f"there is no mission {called!r}"
                raise _error_at(mission, call, problem, closest_first(called, library.names()))
            if called not in found:
                found[called] = library.get(called)
                waiting.append(called)
    for caller, cycle in cycles([name], callees.__getitem__).items():
        called = next(each for each in callees[caller] if each in cycle)
        chain = [caller, *chain_back(called, caller, cycle, callees.__getitem__)]
        mission = found[caller]
        call = next(
            node
            for node in mission.nodes()
            if isinstance(node, kinds.CallMission) and node.mission.text == called
        )
        raise _error_at(mission, call, f"the mission {caller!r} calls itself: {' -> '.join(chain)}")
    return list(found.values())


def _check_mission(mission: Mission, declarations: Mapping[str, SkillDeclaration]) -> None:
    raise_first_error(mission.findings)
    for node in mission.nodes():
        if isinstance(node, kinds.RunSkill) and node.skill not in declarations:
            raise _error_at(
                mission, node, f"unknown skill {node.skill!r}", closest_first(node.skill, declarations)
            )


def _tree(
    mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration], notes: LossNotes
) -> Element:
    assert mission.tree is not None  # a mission without a tree has an error among its findings
    root = NodeWriter(mission, library, declarations, notes).node(mission.tree)
    attributes = {"ID": mission.name}
    if mission.description:
        attributes["_description"] = mission.description
    if mission.on_restart != "abort":
        attributes[f"{MARK}_on_restart"] = mission.on_restart
    if mission.keys:
        documents = {name: port_document(port) for name, port in mission.keys.items()}
        attributes[f"{MARK}_keys"] = write_flow(documents)[1:-1]
        started = {name: port for name, port in mission.keys.items() if not port.required}
        listed = {name: documents[name]["default"] for name, port in started.items() if port.kind.item}
        scripts = [_start(name, port) for name, port in started.items() if name not in listed]
        first = [Element("Script", {"code": "; ".join(scripts)})] if scripts else []
        if listed:
            message = "scripts hold no lists; written as FlorenceSet, which must be registered there"
            notes.notice(mission.file, mission.tree.position, f"keys: {', '.join(listed)}: {message}")
            first.append(_florence("Action", "FlorenceSet", {"values": write_flow(listed)[1:-1]}))
        if first:
            root = Element("Sequence", {MARK: "keys"}, children=[*first, root])
    return Element("BehaviorTree", attributes, children=[root])


def _start(name: str, port: Port) -> str:
    value = port.default
    text = f"'{value}'" if isinstance(value, str) else script_number(value)
    return f"{name} := {text}"


def _models(
    missions: list[Mission], declarations: Mapping[str, SkillDeclaration], trees: list[Element]
) -> Element:
    used: dict[str, Element] = {}
    for tree in trees:
        for element in tree.walk():
            if element.tag in ("Action", "Condition", "Control", "Decorator"):
                used.setdefault(element.get("ID"), element)
    block = Element("TreeNodesModel", {})
    for name in sorted(used):
        if name in known_nodes():
            block.children.append(_florence_model(name, used[name].tag))
        else:
            block.children.append(_skill_model(declarations[name], used[name].tag))
    block.children += [_mission_model(mission) for mission in missions]
    return block


def _florence_model(name: str, category: str) -> Element:
    element = Element(category, {"ID": name})
    for port, about in known_nodes()[name].ports.items():
        tag = "output_port" if about.direction == "out" else "input_port"
        element.children.append(Element(tag, {"name": port}, text=about.description))
    return element


def _skill_model(declaration: SkillDeclaration, category: str) -> Element:
    element = Element(category, {"ID": declaration.name})
    element.children.append(Element("description", {}, text=declaration.summary))
    element.children += [_port_model("input_port", name, port) for name, port in declaration.inputs.items()]
    for name, port in declaration.outputs.items():
        shown = f"out_{name}" if name in declaration.inputs else name
        element.children.append(_port_model("output_port", shown, port))
    return element


def _mission_model(mission: Mission) -> Element:
    element = Element("SubTree", {"ID": mission.name})
    element.children += [_port_model("input_port", name, port) for name, port in mission.inputs.items()]
    for name, port in mission.outputs.items():
        if name not in mission.inputs:
            output = _port_model("output_port", name, port)
            # A call need not ask for it; BehaviorTree.CPP refuses the file unless each has somewhere to go.
            output.attributes["default"] = f"{{{private_key(mission.name, name)}}}"
            element.children.append(output)
    return element


def _make_compact(root: Element, missions: list[Mission]) -> None:
    """Write ``<turn/>`` in place of ``<Action ID="turn"/>`` where BehaviorTree.CPP before 4.9 needs it."""
    names = {mission.name for mission in missions}
    for element in root.walk():
        if element.tag == "ReactiveSequence":
            for child in element.children:
                if child.tag in CATEGORIES and child.tag != "SubTree" and child.get("ID") not in names:
                    child.tag = child.attributes.pop("ID")


def _port_model(tag: str, name: str, port: Port) -> Element:
    attributes = {"name": name, "type": KIND_TYPES[port.kind]}
    if not port.required and tag == "input_port":
        attributes["default"] = si_text(port.default)
    for end, limit in (("min", port.minimum), ("max", port.maximum)):
        if limit is not None:
            attributes[f"{MARK}_{end}"] = si_text(float(limit) if port.kind is not Kind.INTEGER else limit)
    unit = KIND_UNITS.get(port.kind, "")
    return Element(tag, attributes, text=f"{port.description} {unit}".strip())


def _error_at(mission: Mission, node: model.Node, problem: str, valid: tuple[str, ...] = ()) -> ConfigError:
    place = node.position
    return ConfigError(problem, file=mission.file, line=place.line, column=place.column, valid=valid)
