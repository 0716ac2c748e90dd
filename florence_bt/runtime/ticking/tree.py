"""A drop-in for ``py_trees.trees.BehaviourTree`` that ticks faster."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from uuid import UUID

from py_trees import trees
from py_trees.behaviour import Behaviour

from florence_bt.runtime.ticking.ticker import Ticker

TickHandler = Callable[[trees.BehaviourTree], None]


class BehaviourTree(trees.BehaviourTree):
    """The tree custodian of py_trees with a :class:`Ticker` inside.

    Handlers, visitors, insertion, pruning, ``tick_tock`` and all the rest are those of py_trees; visitors
    meet the nodes in the same order and with the same statuses.
    """

    def __init__(self, root: Behaviour) -> None:
        super().__init__(root)
        self._plain = Ticker(root)
        self._visited = Ticker(root, visit=self._visit)

    def setup(self, *args: Any, **kwargs: Any) -> None:
        """Set all nodes up, as py_trees does."""
        super().setup(*args, **kwargs)
        self.rebuild()

    def insert_subtree(self, child: Behaviour, unique_id: UUID, index: int) -> bool:
        """Insert a subtree below a composite, as py_trees does."""
        inserted = super().insert_subtree(child, unique_id, index)
        self.rebuild()
        return inserted

    def replace_subtree(self, unique_id: UUID, subtree: Behaviour) -> bool:
        """Put a subtree in the place of another, as py_trees does."""
        replaced = super().replace_subtree(unique_id, subtree)
        self.rebuild()
        return replaced

    def tick(
        self, pre_tick_handler: TickHandler | None = None, post_tick_handler: TickHandler | None = None
    ) -> None:
        """Tick once, with the handlers and visitors around and inside it."""
        if pre_tick_handler is not None:
            pre_tick_handler(self)
        for handler in self.pre_tick_handlers:
            handler(self)
        for visitor in self.visitors:
            visitor.initialise()
        self._tick_root()
        if any(visitor.full for visitor in self.visitors):
            for node in self.root.iterate():
                for visitor in self.visitors:
                    if visitor.full:
                        node.visit(visitor)
        for visitor in self.visitors:
            visitor.finalise()
        for handler in self.post_tick_handlers:
            handler(self)
        if post_tick_handler is not None:
            post_tick_handler(self)
        self.count += 1

    def rebuild(self) -> None:
        """Look at every node afresh: for who has replaced methods of nodes, or added such nodes by hand."""
        self._plain.rebuild()
        self._visited.rebuild()

    def _tick_root(self) -> None:
        if self._plain.root is not self.root:
            self._plain = Ticker(self.root)
            self._visited = Ticker(self.root, visit=self._visit)
        passing = any(not visitor.full for visitor in self.visitors)
        (self._visited if passing else self._plain).tick()

    def _visit(self, node: Behaviour) -> None:
        for visitor in self.visitors:
            if not visitor.full:
                node.visit(visitor)
