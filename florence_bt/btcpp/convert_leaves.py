"""Leaves of BehaviorTree.CPP: scripts, pauses, the blackboard, calls of trees, and what becomes a skill."""

from __future__ import annotations

from typing import Any

from florence_bt.btcpp.convert import NOTHING, Converter, Node
from florence_bt.btcpp.key_uses import pointer, port_of_skill, registration
from florence_bt.btcpp.names import identifier
from florence_bt.btcpp.nav2 import ERROR_PORTS
from florence_bt.btcpp.skill_book import SkillEntry
from florence_bt.btcpp.values_in import text_value, written_value
from florence_bt.btcpp.vocabulary import MARK
from florence_bt.btcpp.written import read_flow
from florence_bt.btcpp.xml_source import Element
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError


def always_success(c: Converter, e: Element) -> Node:
    """``AlwaysSuccess``."""
    return dict(NOTHING)


def always_failure(c: Converter, e: Element) -> Node:
    """``AlwaysFailure``; our own marks say why."""
    if not e.get(f"{MARK}_reason"):
        return {"fail": e.get("name") or "AlwaysFailure"}
    reason = c.own_words(e, e.get(f"{MARK}_reason"))
    code = e.get(f"{MARK}_code")
    return {"fail": reason, "code": code} if code else {"fail": reason}


def script(c: Converter, e: Element) -> Node:
    """``Script``."""
    own = c.trusted_set(e)
    if own is not None:
        return {"set": own}
    nodes = c.scripts(e, e.get("code"))
    return nodes[0] if len(nodes) == 1 else {"sequence": nodes}


def script_condition(c: Converter, e: Element) -> Node:
    """``ScriptCondition``."""
    text = c.condition(e, e.get("code"))
    return {"condition": text} if text is not None else c.stand_in(e, "its condition has no equivalent")


def sleep(c: Converter, e: Element) -> Node:
    """``Sleep``."""
    return {"wait": c.milliseconds(e, "msec")}


def set_blackboard(c: Converter, e: Element) -> Node:
    """``SetBlackboard``."""
    target = pointer(e.get("output_key"), "output_key") or e.get("output_key")
    if not target:
        return c.stand_in(e, "it names no output_key")
    if c.kind(target) is Kind.TEXT and pointer(e.get("value"), "value") is None:
        return {"set": {c.key_name(target): text_value(e.get("value"), None)}}
    return {"set": {c.key_name(target): c.value(e, "value", c.kind(target))}}


def unset_blackboard(c: Converter, e: Element) -> Node:
    """``UnsetBlackboard``."""
    c.lost(e, "a key keeps its value; the node is imported as one that does nothing")
    return dict(NOTHING)


def subtree(c: Converter, e: Element) -> Node:
    """``SubTree``: a call of another mission."""
    call = c.tree.calls_by_element[id(e)]
    called = c.facts.trees.get(call.tree)
    node: Node = {"run": c.missions.get(call.tree) or identifier(call.tree, "mission")}
    shared = c.facts.mapping(c.tree.tree.name, call)
    if called is None:
        c.lost(e, f"the tree {call.tree!r} is not in this file; the mission must come from elsewhere")
        given = {identifier(port): f"${c.key_name(key)}" for port, key in shared.items()}
        given |= {identifier(port): written_value(text, None)[0] for port, text in call.literals.items()}
        return {**node, "with": given} if given else node
    inputs: dict[str, Any] = {}
    for port, key in shared.items():
        if port in called.all_inputs(c.facts):
            inputs[called.input_name(port, c.facts)] = f"${c.key_name(key)}"
        elif port not in called.all_outputs(c.facts):
            c.notice(e, f"the port {port!r} is used nowhere in {call.tree!r} and left out")
    for port, text in call.literals.items():
        if port in called.all_inputs(c.facts):
            value, problem = written_value(text, c.facts.kind(call.tree, port))
            if problem:
                c.lost(e, f"{port}: {problem}")
            inputs[called.input_name(port, c.facts)] = value
        else:
            c.notice(e, f"the port {port!r} is used nowhere in {call.tree!r} and left out")
    outputs = {
        called.names.of(port): c.key_name(shared[port])
        for port in called.all_outputs(c.facts)
        if port in shared
    }
    node |= {"with": inputs} if inputs else {}
    return node | ({"out": outputs} if outputs else {})


def skill(c: Converter, e: Element) -> Node:
    """Every other node without nodes below it: a skill of this installation, or one that it lacks."""
    node = registration(e)
    entry = c.book.entry(node, e)
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
        _port(c, e, entry, attribute, inputs, outputs)
    result: Node = {entry.name: inputs or None}
    if every := e.get(f"{MARK}_every"):
        result["every"] = every
    return result | ({"out": outputs} if outputs else {})


def _port(
    c: Converter,
    e: Element,
    entry: SkillEntry,
    attribute: str,
    inputs: dict[str, Any],
    outputs: dict[str, str],
) -> None:
    node, declared = entry.node, c.ports.skill(entry.node)
    model = c.ports.port(node, attribute)
    key = pointer(e.get(attribute), attribute)
    name = attribute if declared is not None else entry.names.of(attribute)
    if model is not None:
        direction, kind = model.direction, model.kind or c.facts.port_kind(node, attribute)
    else:
        direction, kind = c.direction(e, attribute), c.facts.port_kind(node, attribute)
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
        if c.ports.nav2.find(node) is not None and attribute in ERROR_PORTS:
            c.start_with(key, *ERROR_PORTS[attribute])
            if c.tree.local(key, c.facts.main) in c.tree.read_keys:
                c.lost(e, f"{attribute} is written when the node succeeds; there also when it fails")


# ---- our own ------------------------------------------------------------------------------------------


def own_wait(c: Converter, e: Element) -> Node:
    """``FlorenceWait``."""
    return {"wait": c.value(e, "seconds", Kind.DURATION)}


def own_set(c: Converter, e: Element) -> Node:
    """``FlorenceSet``."""
    try:
        values = read_flow(f"{{{e.get('values')}}}")
    except ConfigError as error:
        return c.stand_in(e, f"values: {error.problem}")
    return {"set": values} if isinstance(values, dict) and values else c.stand_in(e, "it sets nothing")


def own_condition(c: Converter, e: Element) -> Node:
    """``FlorenceCondition``."""
    return {"condition": e.get("code")}
