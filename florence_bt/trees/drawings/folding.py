"""Folds called missions in a dump, so that it shows what goes on and what failed rather than every node."""

from __future__ import annotations

from collections.abc import Sequence

from py_trees.common import Status

from florence_bt.trees.drawings.ascii import TreeRow


def fold_calls(rows: Sequence[TreeRow]) -> tuple[TreeRow, ...]:
    """Leave out the nodes of called missions, but for the ways to what runs and to what failed.

    A call below which nothing runs and that has not failed becomes one row. A failure that the called mission
    has dealt with is left out, too. Where a way ends at a node between two of its children, such as a repeat
    between two rounds, their rows stay.

    Args:
        rows: The nodes of a whole tree, as :func:`~florence_bt.trees.drawings.ascii.tree_rows` gives them.

    Returns:
        The rows that stay, unchanged and in order.
    """
    parents = parents_of(rows)
    ways = ways_to_what_runs(rows, parents)
    between = ways.difference(parents[place] for place in ways)
    called: set[int] = set()
    shown: list[TreeRow] = []
    failing: set[int] = set()
    for place, (row, parent) in enumerate(zip(rows, parents, strict=True)):
        if parent is not None and (rows[parent].call or parent in called):
            called.add(place)
        failed = row.status is Status.FAILURE and (place not in called or parent in failing or parent in ways)
        if failed:
            failing.add(place)
        if failed or place not in called or place in ways or parent in between:
            shown.append(row)
    return tuple(shown)


def parents_of(rows: Sequence[TreeRow]) -> list[int | None]:
    """Return the place of the row above each row, None for the root."""
    parents: list[int | None] = []
    way: list[int] = []
    for place, row in enumerate(rows):
        del way[row.depth :]
        parents.append(way[-1] if way else None)
        way.append(place)
    return parents


def ways_to_what_runs(rows: Sequence[TreeRow], parents: Sequence[int | None]) -> set[int]:
    """Return the places of the rows that run and of all above them.

    What is above need not run: a clean-up goes on below nodes that were stopped. When the whole run was
    stopped, what was stopped with it counts as running, because it says where the run was.
    """
    running: set[int | None] = set()
    ways: set[int] = set()
    for place, (row, parent) in enumerate(zip(rows, parents, strict=True)):
        stopped_with_all = parent is None or (parent in running and rows[parent].left)
        if row.running and (not row.left or stopped_with_all):
            running.add(place)
            above: int | None = place
            while above is not None and above not in ways:
                ways.add(above)
                above = parents[above]
    return ways
