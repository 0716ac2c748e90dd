"""Decorators of BehaviorTree.CPP as nodes of the mission language."""

from __future__ import annotations

from florence_bt.btcpp.convert import NOTHING, Converter, Node, paced, put
from florence_bt.btcpp.key_uses import pointer
from florence_bt.btcpp.values_in import text_value, written_value
from florence_bt.btcpp.vocabulary import FOREVER, LOOP_KINDS
from florence_bt.btcpp.xml_source import Element
from florence_bt.core.declaration import Kind

MAX_LOOP = 100
"""Most values of a loop that are written out."""


def inverter(c: Converter, e: Element) -> Node:
    """``Inverter``."""
    return {"invert": c.only_child(e)}


def force_success(c: Converter, e: Element) -> Node:
    """``ForceSuccess``."""
    return {"succeed": c.only_child(e)}


def force_failure(c: Converter, e: Element) -> Node:
    """``ForceFailure``."""
    return {"force": "failure", "do": c.only_child(e)}


def retry(c: Converter, e: Element) -> Node:
    """``RetryUntilSuccessful``."""
    attempts, for_ever = c.count(e, "num_attempts", 1)
    child = c.only_child(e)
    return {"retry": attempts, "do": paced(child) if for_ever else child}


def repeat(c: Converter, e: Element) -> Node:
    """``Repeat``."""
    rounds, for_ever = c.count(e, "num_cycles", 1)
    child = c.only_child(e)
    return {"repeat": rounds, "do": paced(child) if for_ever else child}


def keep_running(c: Converter, e: Element) -> Node:
    """``KeepRunningUntilFailure``."""
    return {"repeat": str(FOREVER), "do": paced(c.only_child(e))}


def timeout(c: Converter, e: Element) -> Node:
    """``Timeout``."""
    return {"timeout": c.milliseconds(e, "msec"), "do": c.only_child(e)}


def delay(c: Converter, e: Element) -> Node:
    """``Delay``."""
    return {"delay": c.milliseconds(e, "delay_msec"), "do": c.only_child(e)}


def run_once(c: Converter, e: Element) -> Node:
    """``RunOnce``."""
    if e.get("then_skip", "true").lower() not in ("false", "0"):
        c.lost(e, "later starts are skipped there; here they end like the first")
    return {"once": c.only_child(e)}


def precondition(c: Converter, e: Element) -> Node:
    """``Precondition``: asked before the child starts, not while it runs."""
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
            waiting = {"retry": str(FOREVER), "do": paced({"condition": text})}
            return {"sequence": [waiting, child]}
        case "FAILURE":
            return {"if": text, "then": child, "else": {"fail": f"{text} does not hold"}}
    return c.stand_in(e, f"else={e.get('else')!r} is no status")


def loop(c: Converter, e: Element) -> Node:
    """``LoopInt`` and its like, for a queue that is written out."""
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


def without_equivalent(c: Converter, e: Element) -> Node:
    """Nodes about how often a key was written, and others that missions do not have."""
    return c.stand_in(e, "no node of a mission does this")


# ---- our own ------------------------------------------------------------------------------------------


def own_retry(c: Converter, e: Element) -> Node:
    """``FlorenceRetry``."""
    node: Node = {"retry": c.value(e, "num_attempts", Kind.INTEGER)}
    codes = [code.strip() for code in e.get("on").split(";") if code.strip()]
    if codes:
        node["on"] = codes
    attempt = pointer(e.get("attempt"), "attempt")
    if attempt is not None:
        node["attempt"] = c.key_name(attempt)
    return {**node, "do": c.only_child(e)}


def own_timeout(c: Converter, e: Element) -> Node:
    """``FlorenceTimeout``."""
    return {"timeout": c.value(e, "seconds", Kind.DURATION), "do": c.only_child(e)}


def own_delay(c: Converter, e: Element) -> Node:
    """``FlorenceDelay``."""
    return {"delay": c.value(e, "seconds", Kind.DURATION), "do": c.only_child(e)}


def own_cooldown(c: Converter, e: Element) -> Node:
    """``FlorenceCooldown``."""
    return {"cooldown": c.value(e, "seconds", Kind.DURATION), "do": c.only_child(e)}


def own_guard(c: Converter, e: Element) -> Node:
    """``FlorenceGuard``."""
    node = c.only_child(e)
    for guard in ("when", "unless", "while"):
        if e.get(guard):
            node = put(node, guard, e.get(guard))
    return node
