"""A run with its tree, written in a test as people read it."""

from __future__ import annotations

import re

from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.trees.drawings.ascii import MARKS, TreeRow

_STATUSES = {mark: status for status, mark in MARKS.items()}
_NODE = re.compile(r"( *)(\[[ +x>]\]) (.*?)(?: \((\d+\.\d) s\))?(?: -- (.*))?")
_HEAD = re.compile(r"(\w+): (\w+)(?: · ([\d.]+) s)?(?: · run (\S+))?(?: · asked by (.*))?")


def written_tree(text: str) -> RunTree:
    """Read a status: a head line, notes, the nodes, and warnings."""
    head, *lines = text.splitlines()
    mission, state, seconds, run_id, caller = _HEAD.fullmatch(head).groups(default="")
    found = [_NODE.fullmatch(line) for line in lines]
    first = next((place for place, node in enumerate(found) if node), len(found))
    return RunTree(
        run_id=run_id,
        mission=mission,
        state=state,
        caller=caller,
        seconds=float(seconds) if seconds else None,
        notes=tuple(lines[:first]),
        nodes=tuple(_row(*node.groups(default="")) for node in found if node),
        warnings=tuple(
            line.removeprefix("warning: ") for line in lines[first:] if line.startswith("warning: ")
        ),
    )


def _row(indent: str, mark: str, title: str, seconds: str, says: str) -> TreeRow:
    return TreeRow(len(indent) // 4, _STATUSES[mark], title, says, float(seconds) if seconds else None)
