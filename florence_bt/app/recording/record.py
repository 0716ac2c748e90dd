"""``florence record``: the recorder alone, with what it has written so far on the terminal."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

from florence_bt.app.recording.node import RecorderNode
from florence_bt.ros.process import run_nodes

_SHOWN_EVERY_S = 1.0
"""Period of the progress in the terminal. Chosen."""


def run_recorder(parameters: Mapping[str, Any]) -> int:
    """Record until Ctrl-C, and say what was written.

    Args:
        parameters: Of the node.

    Returns:
        The exit code.
    """
    nodes: list[RecorderNode] = []

    def make() -> RecorderNode:
        node = RecorderNode(parameters=parameters)
        nodes.append(node)
        if sys.stderr.isatty():
            node.create_timer(_SHOWN_EVERY_S, lambda: _show_progress(node))
        return node

    print(f"recording into {parameters['folder']}; Ctrl-C ends it", flush=True)
    code = run_nodes([make])
    for node in nodes:
        print(summary(node), flush=True)
    return code


def _show_progress(node: RecorderNode) -> None:
    counts, files = node.counts, node.files
    size = files.size_mb if files else 0.0
    line = f"{len(counts)} topics, {counts.total():,} messages, {size:.1f} MB"
    print(f"\r\033[K{line}", end="", file=sys.stderr, flush=True)


def summary(node: RecorderNode) -> str:
    """Return a table of what was recorded, and the files."""
    counts, types, files = node.counts, node.types, node.files
    width = max((len(name) for name in counts), default=0)
    lines = [f"{name:<{width}}  {counts[name]:>8,}  {types[name]}" for name in sorted(counts)]
    written = files.written if files else []
    here = [file for file in written if file.exists()]
    gone = len(written) - len(here)
    lines += [f"{file}  {file.stat().st_size / 1e6:.1f} MB" for file in here]
    if gone:
        lines.append(f"{gone} older files of this recording were removed to keep to the bounds")
    return "\n".join(lines)
