"""What viewers are sent, in parts that change at different times: each is written once for all viewers."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from florence_bt.skills.locator.hotspots import Hotspot


class LiveParts:
    """The newest value of each part as JSON, with a number that grows when it changes.

    One thread puts, others read: what they get is always whole.
    """

    def __init__(self) -> None:
        self._parts: dict[str, tuple[int, str]] = {}

    def put(self, name: str, value: Any) -> None:
        """Set a part; nothing is sent when it says the same as before."""
        text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
        number, before = self._parts.get(name, (0, ""))
        if text != before:
            self._parts[name] = (number + 1, text)

    def since(self, seen: Mapping[str, int]) -> tuple[str, dict[str, int]]:
        """Return what a viewer has not got.

        Args:
            seen: The numbers of the parts that it has, by name.

        Returns:
            A JSON object of the parts that changed, empty text when none did; and the numbers it has then.
        """
        parts = dict(self._parts)
        new = {name: text for name, (number, text) in parts.items() if seen.get(name) != number}
        frame = "{" + ",".join(f'"{name}":{text}' for name, text in new.items()) + "}" if new else ""
        return frame, {name: number for name, (number, _) in parts.items()}


class ShownNode(NamedTuple):
    """A node of a tree for viewers.

    Attributes:
        name: Its name.
        parent: The number of the node above it, -1 for the root.
        kind: As in ``py_trees_ros_interfaces/Behaviour``.
        status: As there.
        says: What it says about itself.
        active: Whether the last tick went through it.
    """

    name: str
    parent: int
    kind: int
    status: int
    says: str
    active: bool


_MARKS = {1: ".", 2: ">", 3: "+", 4: "x"}
"""Status of a node in py_trees_ros_interfaces -> its sign."""


def tree_parts(nodes: Sequence[ShownNode], keys: Mapping[str, str]) -> dict[str, Any]:
    """Make the parts of a tree: ``tree``, which seldom changes, and ``marks``, where its nodes stand.

    Args:
        nodes: Its nodes.
        keys: The keys that it uses, with their values.
    """
    return {
        "tree": [[node.name, node.parent, node.kind] for node in nodes],
        "marks": {
            "statuses": "".join(_MARKS.get(node.status, " ") for node in nodes),
            "active": [number for number, node in enumerate(nodes) if node.active],
            "said": {number: node.says for number, node in enumerate(nodes) if node.says},
            "keys": dict(keys),
        },
    }


def places_part(places: Iterable[Hotspot]) -> list[dict[str, Any]]:
    """Make the part ``places``: rooms and objects where the robot stands for them."""
    return [
        {"label": each.label, "x": each.pose.x, "y": each.pose.y, "yaw": each.pose.yaw, "kind": each.kind}
        for each in places
    ]
