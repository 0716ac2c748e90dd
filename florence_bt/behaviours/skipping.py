"""Skipped nodes: one that ``when`` kept from starting has done nothing.

Whether that counts as success or as failure is decided where the tree is built: it has a status like every
other. Nodes with one thing to do are skipped with it, and say so by their property ``skipped``.
"""

from __future__ import annotations

from py_trees.behaviour import Behaviour


def was_skipped(node: Behaviour | None) -> bool:
    """Tell whether a node that has just ended, or the only thing that it had to do, was skipped."""
    return bool(getattr(node, "skipped", False))
