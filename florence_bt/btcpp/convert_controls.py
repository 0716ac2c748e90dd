"""Controls of BehaviorTree.CPP as composites of the mission language."""

from __future__ import annotations

from typing import Any

from florence_bt.btcpp.convert import Converter, Node, put
from florence_bt.btcpp.convert_leaves import skill
from florence_bt.btcpp.key_uses import READ, WRITE, pointer, registration
from florence_bt.btcpp.si_values import quantity_text, read_number
from florence_bt.btcpp.trust import trusted_cases
from florence_bt.btcpp.values_in import written_value
from florence_bt.btcpp.vocabulary import FOREVER, MARK
from florence_bt.btcpp.written import Quoted, read_flow
from florence_bt.btcpp.xml_source import Element
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError


def sequence(c: Converter, e: Element) -> Node:
    """``Sequence``, ``AsyncSequence``."""
    if e.get(MARK) == "keys" and len(e.children) == 2:
        return c.node(e.children[1])
    return {"sequence": c.children(e)}


def reactive_sequence(c: Converter, e: Element) -> Node:
    """``ReactiveSequence``; with our mark it is ``while`` round a node."""
    if e.get(MARK) == "while" and len(e.children) == 2 and e.children[0].tag == "ScriptCondition":
        asked = e.children[0]
        text = c.condition(asked, asked.get("code"))
        if text is not None:
            return put(c.node(e.children[1]), "while", text)
    return {"sequence": c.children(e), "memory": "false"}


def sequence_with_memory(c: Converter, e: Element) -> Node:
    """``SequenceWithMemory``: what has succeeded is not done again until all has."""
    done = c.new_key("done", Kind.INTEGER, "0")
    nodes: list[Node] = []
    for number, child in enumerate(c.children(e), start=1):
        step = {"sequence": [child, {"set": {done: str(number)}}], "unless": f"${done} >= {number}"}
        nodes.append(step)
    return {"sequence": [*nodes, {"set": {done: "0"}}]}


def fallback(c: Converter, e: Element) -> Node:
    """``Fallback``, ``AsyncFallback``."""
    return {"selector": c.children(e)}


def reactive_fallback(c: Converter, e: Element) -> Node:
    """``ReactiveFallback``."""
    return {"selector": c.children(e), "memory": "false"}


def parallel(c: Converter, e: Element) -> Node:
    """``Parallel``, of version 3 too."""
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


def parallel_all(c: Converter, e: Element) -> Node:
    """``ParallelAll``: all branches come to their end, then the failures are counted."""
    failures = c.new_key("failures", Kind.INTEGER, "0")
    limit = _threshold(c, e, "max_failures", "1", len(e.children))
    count = {"set": {failures: f"${{${failures} + 1}}"}}
    branches = [{"selector": [child, dict(count)]} for child in c.children(e)]
    verdict = {"condition": f"${failures} < {limit}"}
    return {"sequence": [{"set": {failures: "0"}}, {"parallel": branches}, verdict]}


def if_then_else(c: Converter, e: Element) -> Node:
    """``IfThenElse``: decided once."""
    return _branches(c, e)


def while_do_else(c: Converter, e: Element) -> Node:
    """``WhileDoElse``: decided anew with every tick."""
    node = _branches(c, e)
    return {**node, "memory": "false"} if "if" in node else node


def _branches(c: Converter, e: Element) -> Node:
    if not 2 <= len(e.children) <= 3:
        return c.stand_in(e, f"it needs 2 or 3 nodes below it, not {len(e.children)}")
    node: Node = {"if": _question(c, e.children[0]), "then": c.node(e.children[1])}
    if len(e.children) == 2:
        return {**node, "else": {"fail": "the condition does not hold and there is no other branch"}}
    last = e.children[2]
    if last.tag == "AlwaysSuccess" and not last.attributes:
        return node
    return {**node, "else": c.node(last)}


def _question(c: Converter, asked: Element) -> Any:
    """The condition of an ``if``: an expression where it is one, else a node."""
    if asked.tag in ("ScriptCondition", "FlorenceCondition") and set(asked.attributes) <= {"code", MARK}:
        node = c.node(asked)
        if set(node) == {"condition"}:
            return node["condition"]
        return node
    return c.node(asked)


def switch(c: Converter, e: Element) -> Node:
    """``Switch2`` ... ``Switch6``: a ``switch`` where the variable cannot change while a branch runs."""
    cases = int(e.tag.removeprefix("Switch"))
    key = pointer(e.get("variable"), "variable")
    if key is None or len(e.children) != cases + 1:
        return c.stand_in(e, f"it needs a variable and {cases + 1} nodes below it")
    kind = c.kind(key)
    written = [e.get(f"case_{number}") for number in range(1, cases + 1)]
    values = trusted_cases(e, written) or [_case(text, kind) for text in written]
    nodes = c.children(e)
    default = e.children[-1]
    if e.get(MARK) != "once" and c.changes_below(e, key):
        return _looked_at_anew(c.key_name(key), values, kind, nodes)
    node: Node = {"switch": f"${c.key_name(key)}", "cases": dict(zip(values, nodes, strict=False))}
    if len(node["cases"]) < cases:
        return c.stand_in(e, "two of its cases are equal")
    if default.tag == "AlwaysFailure" and default.get(MARK) == "no_case":
        return node
    return {**node, "default": nodes[-1]}


def _case(text: str, kind: Kind | None) -> str:
    value, _ = written_value(text, kind)
    return value if isinstance(value, str) else text


def _looked_at_anew(key: str, values: list[str], kind: Kind | None, nodes: list[Node]) -> Node:
    """A switch whose variable may change while a branch runs: a chain of ``if`` without memory."""
    chain = nodes[-1]
    for value, node in reversed(list(zip(values, nodes, strict=False))):
        is_text = kind in (None, Kind.TEXT) or isinstance(value, Quoted)
        shown = f'"{value}"' if is_text else value
        chain = {"if": f"${key} == {shown}", "then": node, "else": chain, "memory": "false"}
    return chain


def try_catch(c: Converter, e: Element) -> Node:
    """``TryCatch``: the last child is done when one of the others fails."""
    if len(e.children) < 2:
        return c.stand_in(e, "it needs at least 2 nodes below it")
    if e.get("catch_on_halt").lower() in ("true", "1"):
        c.lost(e, "catch_on_halt: the last node is not done when the others are stopped")
    *tried, caught = c.children(e)
    body = tried[0] if len(tried) == 1 else {"sequence": tried}
    after = {"sequence": [{"succeed": caught}, {"fail": "what was tried failed, and the last node was done"}]}
    return {"selector": [body, after]}


_CERTAIN = ("AlwaysSuccess", "ForceSuccess", "Script", "SetBlackboard", "Sleep")
"""What never fails as a clean-up."""


def finally_node(c: Converter, e: Element) -> Node:
    """``Finally``, since version 4.11: the second child is done after the first in any case."""
    if len(e.children) != 2:
        return c.stand_in(e, "it needs exactly 2 nodes below it")
    if e.children[1].tag not in _CERTAIN:
        c.lost(e, "when the second node fails it fails there; here the status of the first one stands")
    if "halt_timeout_msec" in e.attributes:
        c.lost(e, "halt_timeout_msec: a clean-up takes the time that it needs here")
    body, cleanup = c.children(e)
    if {"when", "unless", "while"} & set(body):
        body = {"sequence": [body]}  # a node that is skipped is not cleaned up after, and there it is
    return put(body, "finally", cleanup)


def recovery_node(c: Converter, e: Element) -> Node:
    """Nav2's ``RecoveryNode``: after a failure of the first child the second, then the first again."""
    if len(e.children) != 2:
        return c.stand_in(e, "it needs exactly 2 nodes below it")
    retries, _ = c.count(e, "number_of_retries", 1)
    number = c.new_key("attempt", Kind.INTEGER, "0")
    # A code of its own: a failure of the recovery must not count as one of the first child.
    code = f"{number}_failed"
    main, recovery = c.children(e)
    failed = {"fail": f"{e.get('name') or e.tag} failed", "code": code}
    again = {"sequence": [put(recovery, "when", f"${number} <= {retries}"), failed]}
    attempts = f"${{{retries} + 1}}" if retries.startswith("$") else str(int(retries) + 1)
    return {"retry": attempts, "on": [code], "attempt": number, "do": {"selector": [main, again]}}


def round_robin(c: Converter, e: Element) -> Node:
    """Nav2's ``RoundRobin``: each start goes on with the next child."""
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
"""How often what is done with every tick there is done here; a new start of a skill is not free."""


def pipeline_sequence(c: Converter, e: Element) -> Node:
    """Nav2's ``PipelineSequence``: while a node runs, those before it are done again."""
    *earlier, last = e.children
    first = [c.node(child) for child in earlier]
    if not any(_is_done_again(c, child) for child in earlier):
        return {"sequence": [*first, c.node(last)]}
    if any(below.tag == e.tag for child in earlier for below in child.walk()):
        # What is done again is written twice: one in another would grow without end.
        c.lost(e, "another PipelineSequence stands before its last node; imported as a sequence")
        return {"sequence": [*first, c.node(last)]}
    rounds: Node = {"delay": _shortest_pace(c, earlier), "do": {"sequence": first}}
    again: Node = {"name": "again", "repeat": str(FOREVER), "do": rounds}
    node = _started_again(c, earlier, last)
    node = node if "name" in node else {"name": registration(last), **node}
    return {"sequence": [*first, {"parallel": [node, again], "policy": [node["name"]]}]}


def _is_done_again(c: Converter, e: Element) -> bool:
    """Whether it makes a difference that a node is done again: not for a goal that nothing changes."""
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
    """The last node of a pipeline; it starts again when a key that it reads is given another value.

    There a running node looks at its ports with every tick.
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
    return {"retry": str(FOREVER), "on": ["guard_failed"], "do": {"sequence": steps}}


def paced_child(c: Converter, e: Element) -> Node:
    """Nav2's ``RateController`` and its like: at the first tick they start their child, and end as it ends.

    Only what is ticked again after its end (in a ``PipelineSequence``, a reactive control) starts it again.
    """
    if e.tag == "DistanceController":
        c.lost(e, f"done again every second, not after a distance; {_ports_in_words(e)}")
    elif c.tree.is_ticked_again(e) and _is_done_again(c, e):
        c.lost(e, f"the child is done once, not again and again; {_ports_in_words(e)}")
    return {"sequence": c.children(e), "name": e.get("name") or e.tag}


def goal_updater(c: Converter, e: Element) -> Node:
    """Nav2's ``GoalUpdater``: hands a goal on, or a newer one that comes by a topic."""
    c.lost(e, "newer goals that come by its topic are not heard; the goal is handed on as it is")
    handed = {
        c.key_name(target): c.value(e, f"input_{what}", None)
        for what in ("goal", "goals")
        if (target := pointer(e.get(f"output_{what}"), what)) is not None and e.get(f"input_{what}")
    }
    before = [{"set": handed}] if handed else []
    return {"sequence": [*before, *c.children(e)], "name": e.get("name") or e.tag}


def unknown_control(c: Converter, e: Element) -> Node:
    """A control or decorator of another project: a skill for its own part, then the nodes below it."""
    c.lost(
        e,
        "what it does with the nodes below it is not known; imported as a skill, and then these nodes in a"
        " sequence: look at it before you run it",
    )
    return {"sequence": [skill(c, e), *c.children(e)], "name": e.get("name") or registration(e)}


def _ports_in_words(e: Element) -> str:
    given = [f"{name}={value!r}" for name, value in e.attributes.items() if name not in ("ID", "name")]
    return f"{' '.join(given)} left out" if given else "imported as a sequence"


# ---- our own ------------------------------------------------------------------------------------------


def own_finally(c: Converter, e: Element) -> Node:
    """``FlorenceFinally``."""
    if len(e.children) != 2:
        return c.stand_in(e, "it needs exactly 2 nodes below it")
    body, cleanup = c.children(e)
    return put(body, "finally", cleanup)


def own_parallel(c: Converter, e: Element) -> Node:
    """``FlorenceParallel``."""
    return {"parallel": c.children(e), "policy": [name.strip() for name in e.get("names").split(";")]}


def own_switch(c: Converter, e: Element) -> Node:
    """``FlorenceSwitch``."""
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
