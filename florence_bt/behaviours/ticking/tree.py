"""A drop-in for ``py_trees.trees.BehaviourTree`` that ticks faster."""

from __future__ import annotations

from collections.abc import Callable

from py_trees import trees
from py_trees.behaviour import Behaviour

from florence_bt.behaviours.ticking.ticker import Ticker

TickHandler = Callable[[trees.BehaviourTree], None]


class BehaviourTree(trees.BehaviourTree):
    """The tree custodian of py_trees with a :class:`Ticker` inside.

    Handlers, visitors, insertion, pruning, ``tick_tock`` and all the rest are those of py_trees; visitors
    meet the nodes in the same order and with the same statuses.
    """

    def __init__(self, root: Behaviour) -> None:
        super().__init__(root)
        self._ticker = Ticker(root)
        self._visiting_ticker = Ticker(root, visit=self._visit)

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
        for visitor in self.visitors:
            visitor.finalise()
        for handler in self.post_tick_handlers:
            handler(self)
        if post_tick_handler is not None:
            post_tick_handler(self)
        self.count += 1

    def _tick_root(self) -> None:
        visits_ticked = any(not visitor.full for visitor in self.visitors)
        ticker = self._visiting_ticker if visits_ticked else self._ticker
        ticker.root = self.root
        ticker.tick()
        full = [visitor for visitor in self.visitors if visitor.full]
        for node in self.root.iterate() if full else ():
            for visitor in full:
                node.visit(visitor)

    def _visit(self, node: Behaviour) -> None:
        for visitor in self.visitors:
            if not visitor.full:
                node.visit(visitor)
