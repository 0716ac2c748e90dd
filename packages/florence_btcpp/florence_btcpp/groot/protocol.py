"""The bytes of Groot2's monitor protocol, and the answers to its requests. No socket and no ROS in here.

Requests and replies are messages of several parts: a header, then what the kind of the request wants.
Source: ``groot2_protocol.h``, ``groot2_publisher.cpp`` of BehaviorTree.CPP 4, with which the tests compare.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence

import msgpack

from florence_btcpp.groot.tree import IDLE, WatchedNode, WatchedTree

PROTOCOL = 2
_REQUEST = struct.Struct("<BcI")
"""Protocol, kind of the request, a number that the reply repeats."""
_STATUS = struct.Struct("<HB")
"""Number of a node, its status."""
_TIME_BYTES = 6
MOST_TRANSITIONS = 1000
"""As many as BehaviorTree.CPP keeps between two questions."""
AFTER = 10
"""Is added to the last status of a node that is idle again."""


class Monitor:
    """Answers the requests of Groot2 about the tree that was shown last.

    Args:
        now_us: Microseconds since 1970.
        steady_us: Steady microseconds: while Groot2 records, the machine's clock may be set.
    """

    def __init__(self, now_us: Callable[[], int], steady_us: Callable[[], int]) -> None:
        self._now_us = now_us
        self._steady_us = steady_us
        self._tree: WatchedTree | None = None
        self._statuses: dict[int, int] = {}
        self._keys: dict[str, str] = {}
        self._begun_us: int | None = None
        self._transitions: deque[tuple[int, int, int]] = deque(maxlen=MOST_TRANSITIONS)

    def show(self, nodes: Sequence[WatchedNode], keys: Mapping[str, str]) -> None:
        """Show a tree from now on.

        Args:
            nodes: All its nodes, parents before their children.
            keys: Values of some of its keys, by their full names; the others have the values they had.
        """
        if self._tree is None or not self._tree.is_of(nodes):
            same_run = self._tree is not None and nodes[0].own_id in self._tree.numbers
            self._tree = WatchedTree(nodes, self._tree.numbers if self._tree and same_run else {})
            if not same_run:
                self._statuses, self._keys = {}, {}
        self._keys |= keys
        for node in nodes:
            self._show_status(self._tree.numbers[node.own_id], node.status)

    def _show_status(self, number: int, status: int) -> None:
        known = self._statuses.get(number, IDLE)
        if status == known or (status == IDLE and known >= AFTER):
            return
        if self._begun_us is not None:
            self._transitions.append((self._steady_us() - self._begun_us, number, status))
        self._statuses[number] = AFTER + known if status == IDLE else status

    def answer(self, request: Sequence[bytes]) -> list[bytes]:
        """Return the parts of the reply to a request, whatever it is."""
        if not request or len(request[0]) != _REQUEST.size:
            return _refusal("wrong request header")
        protocol, kind, number = _REQUEST.unpack(request[0])
        answers = {
            b"T": self._full_tree,
            b"S": self._status,
            b"B": self._blackboards,
            b"r": self._toggle_recording,
            b"t": self._take_transitions,
            b"D": _no_breakpoints,
            b"A": _done,
            b"X": _done,
        }
        if protocol != PROTOCOL:
            return _refusal(f"this is version {PROTOCOL} of the protocol, not {protocol}")
        if kind not in answers:
            return _refusal("missions have no breakpoints" if kind in b"IRU" else "request not recognized")
        if self._tree is None:
            return _refusal("no mission has run yet")
        header = _REQUEST.pack(PROTOCOL, kind, number) + self._tree.tree_id
        return [header, *answers[kind](self._tree, request[1] if len(request) > 1 else b"")]

    def _full_tree(self, tree: WatchedTree, _: bytes) -> list[bytes]:
        return [tree.xml]

    def _status(self, tree: WatchedTree, _: bytes) -> list[bytes]:
        numbers = tree.numbers.values()
        return [b"".join(_STATUS.pack(number, self._statuses.get(number, IDLE)) for number in numbers)]

    def _blackboards(self, tree: WatchedTree, wanted: bytes) -> list[bytes]:
        names = wanted.decode(errors="replace").split(";")
        return [
            msgpack.packb(
                {name: self._blackboard(tree.scopes[name]) for name in names if name in tree.scopes}
            )
        ]

    def _blackboard(self, scope: str) -> dict[str, str]:
        found = ((*key.rpartition("/"), value) for key, value in self._keys.items())
        return {name: value for path, _, name, value in found if path == scope}

    def _toggle_recording(self, _: WatchedTree, wanted: bytes) -> list[bytes]:
        starts = wanted == b"start"
        self._begun_us = self._steady_us() if starts else None
        self._transitions.clear()
        return [str(self._now_us()).encode()] if starts else []

    def _take_transitions(self, _: WatchedTree, __: bytes) -> list[bytes]:
        taken = _transition_bytes(self._transitions)
        self._transitions.clear()
        return [taken]


def _transition_bytes(transitions: Iterable[tuple[int, int, int]]) -> bytes:
    return b"".join(
        us.to_bytes(_TIME_BYTES, "little") + _STATUS.pack(number, status)
        for us, number, status in transitions
    )


def _no_breakpoints(tree: WatchedTree, _: bytes) -> list[bytes]:
    return [b"[]"]


def _done(tree: WatchedTree, _: bytes) -> list[bytes]:
    return []


def _refusal(reason: str) -> list[bytes]:
    return [b"error", reason.encode()]
