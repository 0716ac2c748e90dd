"""The tree that viewers see: how a row is named for a breakpoint, and which rows have one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from py_trees.common import Status

from florence_bt.runtime.breakpoints import means
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.trees.drawings.folding import parents_of


@dataclass(frozen=True, slots=True)
class ShownTree:
    """The rows of the tree of a run, with the names by which the mission server knows them.

    Once a node has begun, its title may have the value of a key; the name for a breakpoint is the one with
    the key, which the page knows when it has seen the node before it began.

    Attributes:
        run_id: The run; empty without one.
        titles: The titles as they are shown, of parents before those of their children.
        names: The names for breakpoints.
        parents: The place of the row above each row, None for the root.
    """

    run_id: str = ""
    titles: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    parents: tuple[int | None, ...] = ()

    def followed_by(self, tree: RunTree) -> ShownTree:
        """Return the tree as it is shown next; of the same run it keeps what is known of its names."""
        rows = tree.nodes
        same = tree.run_id == self.run_id and len(rows) == len(self.names)
        known = self.names if same else tuple(row.name for row in rows)
        names = tuple(
            row.name if row.status is Status.INVALID else name for row, name in zip(rows, known, strict=True)
        )
        titles = tuple(row.title for row in rows)
        return ShownTree(tree.run_id, titles, names, tuple(parents_of(rows)))

    def has(self, place: int, title: str) -> bool:
        """Tell whether a row is the one that somebody has seen there."""
        return 0 <= place < len(self.titles) and self.titles[place] == title

    def breakpoint_before(self, place: int) -> str:
        """Return the name of a breakpoint that means one row of this mission: short, or its whole path."""
        whole = [name for (name,) in self._way(place)][::-1]
        short = "/".join([whole[0], *whole[1:][-1:]])
        return short if self.marked([short]) == [place] else "/".join(whole)

    def breakpoints_before(self, place: int, names: Sequence[str]) -> list[str]:
        """Return which breakpoints mean a row."""
        return [name for name in names if means(name, self._way(place))]

    def marked(self, names: Sequence[str]) -> list[int]:
        """Return the places of the rows before which there are breakpoints."""
        return [place for place in range(len(self.names)) if self.breakpoints_before(place, names)]

    def _way(self, place: int) -> Iterator[tuple[str]]:
        at: int | None = place
        while at is not None:
            yield (self.names[at],)
            at = self.parents[at]
