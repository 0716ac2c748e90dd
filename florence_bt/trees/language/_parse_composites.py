"""Parsers of the nodes with several nodes below: sequence, selector, parallel, if, switch."""

from __future__ import annotations

from difflib import get_close_matches

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language._parse_common import Maker, Parsing
from florence_bt.trees.language._suggestions import list_meant
from florence_bt.trees.language.kinds import POLICIES, POLICY_KEYS
from florence_bt.trees.language.model import (
    Expression,
    If,
    Literal,
    Node,
    Parallel,
    Policy,
    PolicyKind,
    Selector,
    Sequence,
    Switch,
)
from florence_bt.trees.language.quantities import read_value
from florence_bt.trees.language.source import Listing, Source, Table, Text


def _children(parsing: Parsing, key: Text, value: Source) -> tuple[Node, ...]:
    if not isinstance(value, Listing) or not value.items:
        problem = f"{key.text} needs a list of nodes"
        parsing.reader.problem(value.position, problem, list_meant(key, value))
        return ()
    return tuple(node for item in value.items if (node := parsing.node(item)) is not None)


def _memory(parsing: Parsing, table: Table) -> bool:
    source = table.get("memory")
    return source is None or parsing.reader.choice(source, "memory", ("true", "false"), "true") == "true"


def _sequence(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    children = _children(parsing, key, value)
    return Sequence(children=children, memory=_memory(parsing, table), **parsing.common(key, table))


def _selector(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    children = _children(parsing, key, value)
    return Selector(children=children, memory=_memory(parsing, table), **parsing.common(key, table))


# ---- parallel -----------------------------------------------------------------------------------------


def _parallel(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    children = _children(parsing, key, value)
    source = table.get("policy")
    policy = _policy(parsing, source, children) if source is not None else Policy()
    return Parallel(children=children, policy=policy, **parsing.common(key, table))


def _policy(parsing: Parsing, source: Source, children: tuple[Node, ...]) -> Policy:
    if isinstance(source, Listing):
        return _selected(parsing, source, children)
    if isinstance(source, Table):
        return _counted(parsing, source)
    if source.text not in POLICIES:
        valid = (*POLICIES, "[the name of a branch]", "{succeed: 2, fail: 1}")
        parsing.reader.problem(source.position, f"policy cannot be {source.text!r}", valid)
        return Policy(position=source.position)
    return Policy(PolicyKind(source.text), position=source.position)


def _selected(parsing: Parsing, source: Listing, children: tuple[Node, ...]) -> Policy:
    names = [
        Literal(name, True, item.position)
        for item in source.items
        if (name := parsing.reader.text(item, "the name of a branch")) is not None
    ]
    if not source.items:
        valid = [f"[{child.title}]" for child in children]
        parsing.reader.problem(source.position, "no branch is named", valid)
    return Policy(PolicyKind.SELECTED, names=tuple(names), position=source.position)


def _counted(parsing: Parsing, source: Table) -> Policy:
    for key, _ in source.entries:
        if key.text not in POLICY_KEYS:
            parsing.reader.unknown(key.position, "key of a policy", key.text, POLICY_KEYS)
    meant = any(get_close_matches(key.text, ["succeed"]) for key, _ in source.entries)
    if not meant:
        parsing.reader.problem(source.position, "the policy lacks succeed", ["{succeed: 2, fail: 1}"])
    succeed, fail = (_count(parsing, source.get(name), name) for name in POLICY_KEYS)
    return Policy(PolicyKind.COUNTED, succeed=succeed or 1, fail=fail, position=source.position)


def _count(parsing: Parsing, source: Source | None, name: str) -> int | None:
    if source is None:
        return None
    try:
        number = read_value(source.text, Kind.INTEGER) if isinstance(source, Text) else 0
    except ConfigError:
        number = 0
    if number < 1:
        parsing.reader.problem(source.position, f"{name} must be a number of branches", [f"{name}: 1"])
        return None
    return int(number)


# ---- branches -----------------------------------------------------------------------------------------


def _if(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    if isinstance(value, Table) and value.get("then") is not None and table.get("then") is None:
        valid = ["then: indented like if", "if: $distance < 1 m"]
        parsing.reader.problem(value.position, "what is to be done stands in the condition of the if", valid)
        return None
    condition = _condition(parsing, value)
    then = parsing.child(key, table, "then")
    otherwise = table.get("else")
    other = parsing.node(otherwise) if otherwise is not None else None
    common, memory = parsing.common(key, table), _memory(parsing, table)
    if condition is None or then is None:
        return None
    return If(condition=condition, then=then, otherwise=other, memory=memory, **common)


def _condition(parsing: Parsing, source: Source) -> Expression | Node | None:
    if isinstance(source, Table):
        return parsing.node(source)
    return parsing.reader.expression(source, "if")


def _switch(parsing: Parsing, key: Text, value: Source, table: Table) -> Node | None:
    looked_at = parsing.reader.value(value, "switch")
    source = table.get("cases")
    entries = source.entries if isinstance(source, Table) else ()
    if not entries:
        where = source if source is not None else key
        parsing.reader.problem(where.position, "switch needs cases", ["cases: {value: node, value: node}"])
    cases = []
    for name, item in entries:
        node = parsing.node(item)
        if node is not None:
            cases.append((Literal(name.text, name.quoted, name.position), node))
    default = table.get("default")
    other = parsing.node(default) if default is not None else None
    common = parsing.common(key, table)
    if looked_at is None:
        return None
    return Switch(value=looked_at, cases=tuple(cases), default=other, **common)


COMPOSITES: dict[str, Maker] = {
    "sequence": _sequence,
    "selector": _selector,
    "parallel": _parallel,
    "if": _if,
    "switch": _switch,
}
"""Kind key -> its parser."""
