"""Directions of ports where no model tells them: found from all uses of a port in all trees."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace

from florence_btcpp.document import Document
from florence_btcpp.key_uses import READ, UNKNOWN, WRITE, KeyUse, SubTreeCall
from florence_btcpp.order import Order

MAX_USES = 50
"""Of how many uses of a key it is asked whether they can follow another one."""
Event = KeyUse | SubTreeCall
NodePort = tuple[str, str]
_OUTPUT = re.compile(r"(^|_)(out|output|result)(_|$)")
"""Names of ports that are outputs by what people call them."""


def settled(
    document: Document,
    events: Mapping[str, list[Event]],
    written_out: Iterable[NodePort],
    order: Iterable[str],
) -> dict[str, list[Event]]:
    """Decide whether ports of unknown direction are read or written.

    A port that is given a value, or is a condition's, is read wherever it is used. A key that nothing is
    known to write, and that several ports use, comes from one of them: the first that another can follow.
    Of one element that has it twice the last port, for a node reads before it writes. What nothing tells is
    read.

    Args:
        document: The trees.
        events: What happens in each tree.
        written_out: The ports that are given a value somewhere.
        order: The trees, callers before those that they call.
    """
    decided = dict.fromkeys(written_out, READ)
    uses = [event for found in events.values() for event in found if isinstance(event, KeyUse)]
    decided |= {use.port: READ for use in uses if use.port and use.element.tag == "Condition"}
    given: dict[str, set[str]] = {name: set() for name in events}
    for name in order:
        _decide(events[name], decided, given[name], Order(document.trees[name].root))
        for call in events[name]:
            if isinstance(call, SubTreeCall) and call.tree in given:
                given[call.tree] |= _handed(call, given[name])
    return {
        name: [
            replace(e, access=decided.get(e.port or ("", ""), READ))
            if isinstance(e, KeyUse) and e.access == UNKNOWN
            else e
            for e in found
        ]
        for name, found in events.items()
    }


def _handed(call: SubTreeCall, written: set[str]) -> set[str]:
    """Return the keys of a called tree that have a value from its caller."""
    mapped = {port for port, key in call.keys.items() if key in written}
    return mapped | call.literals.keys() | (written if call.autoremap else set())


def _decide(events: list[Event], decided: dict[NodePort, str], written: set[str], order: Order) -> None:
    """Decide on the ports of one tree.

    Args:
        events: What happens in it.
        decided: The ports that were decided on before; further ones are added.
        written: The keys that have a value at its start; those that it writes are added.
        order: The order of its nodes.
    """
    uses = [event for event in events if isinstance(event, KeyUse)]
    users: dict[str, list[tuple[int, KeyUse]]] = {}
    last: dict[tuple[str, int], KeyUse] = {}
    for number, use in enumerate(uses):
        users.setdefault(use.key, []).append((number, use))
        last[use.key, id(use.element)] = use
        if (decided.get(use.port or ("", "")) if use.access == UNKNOWN else use.access) == WRITE:
            written.add(use.key)
    for number, use in enumerate(uses):
        if use.access != UNKNOWN or use.port is None:
            continue
        if use.port not in decided:
            others = [(n, u) for n, u in users[use.key] if u.port != use.port or u.access != UNKNOWN]
            is_last = use.key not in written and last[use.key, id(use.element)] is use
            is_source = is_last and any(
                u.element is use.element or (n > number and order.can_follow(use.element, u.element))
                for n, u in others[:MAX_USES]
            )
            if is_source or _OUTPUT.search(use.port[1]):
                decided[use.port] = WRITE
            elif others or use.key in written:
                decided[use.port] = READ
        if decided.get(use.port) == WRITE:
            written.add(use.key)
