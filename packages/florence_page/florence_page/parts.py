"""What viewers are sent, in parts that change at different times: each is written once for all viewers."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from py_trees.common import Status

from florence_bt.skills.locator.hotspots import Hotspot
from florence_bt.trees.drawings.ascii import MARKS, STOPPED, TreeRow
from florence_bt.trees.drawings.folding import parents_of


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


NOT_REACHED = "."
SIGNS = {**{mark: mark[1] for mark in (*MARKS.values(), STOPPED)}, MARKS[Status.INVALID]: NOT_REACHED}
"""Mark of a node in a text -> its sign on the page."""


def tree_parts(nodes: Sequence[TreeRow]) -> dict[str, Any]:
    """Make the parts of a tree: ``tree``, which seldom changes, and ``marks``, where its nodes stand."""
    parents = parents_of(nodes)
    return {
        "tree": [
            [node.title, -1 if parent is None else parent]
            for node, parent in zip(nodes, parents, strict=True)
        ],
        "marks": {
            "statuses": "".join(SIGNS[node.mark] for node in nodes),
            "said": {number: node.says for number, node in enumerate(nodes) if node.says},
        },
    }


def places_part(places: Iterable[Hotspot]) -> list[dict[str, Any]]:
    """Make the part ``places``: rooms and objects where the robot stands for them."""
    return [
        {"label": each.label, "x": each.pose.x, "y": each.pose.y, "yaw": each.pose.yaw, "kind": each.kind}
        for each in places
    ]
