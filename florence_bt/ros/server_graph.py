"""The ROS graph as a node sees it: who serves which name, and the states of managed nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from lifecycle_msgs.srv import GetState
from rclpy.action import get_action_server_names_and_types_by_node
from rclpy.client import Client
from rclpy.node import NodeNameNonExistentError

from florence_bt.core.server_comparison import (
    ACTION,
    PUBLISHER,
    SERVICE,
    SUBSCRIBER,
    Lack,
    Offers,
    Wanted,
    compare,
)

if TYPE_CHECKING:
    from florence_bt.ros.node import FlorenceNode

GRAPH_HOLDS_S = 0.5
"""Time for which what was seen counts: many skills ask in one moment. Steady time."""
ASK_AGAIN_S = 2.0
"""Period of asking a managed node for its state, whether it has answered or not. Steady time."""
_GET_STATE = "/get_state"
_STATE_TYPE = "lifecycle_msgs/srv/GetState"

Names = dict[str, set[str]]


class ServerGraph:
    """Knows what the graph offers. It answers at once; states of managed nodes come a little later.

    Args:
        node: Sees the graph.
    """

    def __init__(self, node: FlorenceNode) -> None:
        self._node = node
        self._offers = Offers()
        self._seen = float("-inf")
        self._states: dict[str, str] = {}
        self._asked: dict[str, float] = {}
        self._clients: dict[str, Client] = {}

    def lack(self, wanted: Wanted) -> Lack:
        """Return why a server cannot be reached; empty when it can, or when nothing is known.

        Managed nodes are asked for their states, which are part of the answer from the next time on.
        """
        return compare(wanted, self.offers())

    def offers(self) -> Offers:
        """Return what other nodes offer now."""
        now = self._node.steady.now()
        if now - self._seen >= GRAPH_HOLDS_S:
            self._seen = now
            names, nodes = self._names()
            managed = self._managed(names[SERVICE])
            for node in managed:
                self._ask(node, now)
            self._forget_others(managed)
            self._offers = Offers(names, self._states, nodes)
        return self._offers

    def waits_for_states(self) -> bool:
        """Tell whether a managed node has not answered yet."""
        self.offers()
        return not self._asked.keys() <= self._states.keys()

    def _names(self) -> tuple[dict[str, Names], dict[str, Names]]:
        """Return role -> name -> types, and role -> name -> nodes."""
        found: dict[str, Names] = {role: {} for role in (ACTION, SERVICE, PUBLISHER, SUBSCRIBER)}
        nodes: dict[str, Names] = {role: {} for role in found}
        node = self._node
        listings: tuple[tuple[str, Callable[[str, str], Any]], ...] = (
            (ACTION, lambda name, space: get_action_server_names_and_types_by_node(node, name, space)),
            (SERVICE, node.get_service_names_and_types_by_node),
            (PUBLISHER, node.get_publisher_names_and_types_by_node),
            (SUBSCRIBER, node.get_subscriber_names_and_types_by_node),
        )
        own = (node.get_name(), node.get_namespace())
        for other in set(node.get_node_names_and_namespaces()) - {own}:
            for role, listing in listings:
                for name, types in _attempt(listing, *other):
                    if "/_action/" not in name:
                        found[role].setdefault(name, set()).update(types)
                        nodes[role].setdefault(name, set()).add(f"{other[1].rstrip('/')}/{other[0]}")
        return found, nodes

    def _managed(self, services: Names) -> list[str]:
        own = self._node.get_fully_qualified_name()
        found = (
            name.removesuffix(_GET_STATE)
            for name, types in services.items()
            if name.endswith(_GET_STATE) and _STATE_TYPE in types
        )
        return [name for name in found if name != own]

    def _ask(self, managed: str, now: float) -> None:
        """Ask a managed node for its state, unless it was asked a moment ago."""
        client = self._clients.get(managed)
        if client is None:
            client = self._clients[managed] = self._node.create_client(GetState, managed + _GET_STATE)
        if (
            now - self._asked.setdefault(managed, float("-inf")) < ASK_AGAIN_S
            or not client.service_is_ready()
        ):
            return
        self._asked[managed] = now

        def take(future: Any) -> None:
            answer = future.result()
            if answer is not None and managed in self._asked:
                self._states[managed] = answer.current_state.label
                self._seen = float("-inf")

        client.call_async(GetState.Request()).add_done_callback(self._node.guarded(take))

    def _forget_others(self, managed: list[str]) -> None:
        """Forget nodes that are gone; their clients stay, for when they come back."""
        for gone in self._asked.keys() - set(managed):
            self._asked.pop(gone)
            self._states.pop(gone, None)


def _attempt(listing: Callable[[str, str], Any], name: str, space: str) -> Iterator[tuple[str, list[str]]]:
    """Yield what a node offers; nothing when it went away meanwhile."""
    try:
        yield from listing(name, space)
    except NodeNameNonExistentError:
        return
