"""Wanted servers, held against what a ROS graph offers: the one answer to why somebody cannot be reached.

A name that is there with another type, as something else, or spelt otherwise, and a managed node that is not
active, all look alike from outside: no server is found. No ROS in here.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

from florence_bt.core.errors import close_matches

ACTION, SERVICE, PUBLISHER, SUBSCRIBER = "action", "service", "publisher", "subscriber"
_IS = {
    ACTION: "an action",
    SERVICE: "a service",
    PUBLISHER: "a topic that is published",
    SUBSCRIBER: "a topic that somebody listens to",
}
_KEYS = {ACTION: "action", SERVICE: "service", PUBLISHER: "condition or wait_for", SUBSCRIBER: "publish"}
"""Names of the kinds of servers for people, and as keys of a file of skills."""
ACTIVE = "active"
_MOST = 3
"""Names that are offered in place of one that is missing. Chosen."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """A server that a skill needs.

    Attributes:
        role: :data:`ACTION`, :data:`SERVICE`, :data:`PUBLISHER` of a topic or :data:`SUBSCRIBER` of one.
        name: The whole name, as ``/cart/scan_bed``.
        interface: The type, as ``cart_msgs/srv/ScanBed``.
    """

    role: str
    name: str
    interface: str


@dataclass(frozen=True, slots=True)
class Offers:
    """The servers and topics that a ROS graph has.

    Attributes:
        names: Role -> name -> types.
        states: Managed node (its whole name) -> the label of its lifecycle state.
        nodes: Role -> name -> the whole names of the nodes that have it.
    """

    names: Mapping[str, Mapping[str, Collection[str]]] = field(default_factory=dict)
    states: Mapping[str, str] = field(default_factory=dict)
    nodes: Mapping[str, Mapping[str, Collection[str]]] = field(default_factory=dict)

    def types(self, role: str, name: str) -> list[str]:
        """Return the types that a name has in a role."""
        return sorted(self.names.get(role, {}).get(name, ()))


@dataclass(frozen=True, slots=True)
class Lack:
    """The reason for which a server cannot be reached; empty when nothing is known.

    Attributes:
        problem: A clause for people.
        valid: What would have worked.
        wrong_type: Whether somebody has the name, with another type or as something else.
    """

    problem: str = ""
    valid: tuple[str, ...] = ()
    wrong_type: bool = False

    def __str__(self) -> str:
        """Return the whole for people."""
        worked = f" (would have worked: {', '.join(self.valid)})" if self.valid else ""
        return f"{self.problem}{worked}"


def compare(wanted: Wanted, offers: Offers) -> Lack:
    """Return why a server cannot be reached, or does not work though it can, as far as the graph tells it."""
    types = offers.types(wanted.role, wanted.name)
    if wanted.interface in types:
        return Lack(_states(sorted(offers.nodes.get(wanted.role, {}).get(wanted.name, ())), offers.states))
    if types:
        valid = tuple(f"type: {each}" for each in types)
        return Lack(f"{wanted.name} has the type {' and '.join(types)}", valid, wrong_type=True)
    for role in _IS:
        others = offers.types(role, wanted.name)
        if others and {role, wanted.role} != {PUBLISHER, SUBSCRIBER}:
            problem = f"{wanted.name} is {_IS[role]} ({' and '.join(others)})"
            return Lack(problem, (f"{_KEYS[role]}: {wanted.name}",), wrong_type=True)
    near = _near(wanted, offers)
    what = wanted.role if wanted.role in (ACTION, SERVICE) else "topic"
    words = [f"there is no {what} of this name"] if near else []
    here = wanted.name.rpartition("/")[0]
    beside = [name for name in near if name.rpartition("/")[0] == here]
    if not any(wanted.interface in offers.types(wanted.role, name) for name in beside):
        words += filter(None, [_states(_around(wanted.name, offers.states)[:_MOST], offers.states)])
    return Lack(", ".join(words), tuple(near))


def _near(wanted: Wanted, offers: Offers) -> list[str]:
    """Return the names that may be meant, of this namespace and of others: those of the wanted type first."""
    known = offers.names.get(wanted.role, {})
    own = _last(wanted.name)
    alike = [name for name in close_matches(wanted.name, known) if close_matches(own, [_last(name)])]
    found = dict.fromkeys([*(name for name in sorted(known) if _last(name) == own), *alike])
    return sorted(found, key=lambda name: wanted.interface not in known[name])[:_MOST]


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def _around(name: str, states: Mapping[str, str]) -> list[str]:
    """Return the managed nodes that could serve a name and are not active: those of its namespace."""
    return [
        node
        for node, state in sorted(states.items())
        if state != ACTIVE and name.startswith((f"{node}/", f"{node.rpartition('/')[0]}/"))
    ]


def _states(nodes: Iterable[str], states: Mapping[str, str]) -> str:
    """Tell which of some nodes are managed and not active."""
    return ", ".join(f"{node} is {states[node]}" for node in nodes if states.get(node, ACTIVE) != ACTIVE)
