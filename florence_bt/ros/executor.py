"""Spinning: the events executor with its rough edges taken off.

``spin()`` of this executor serves nothing in rclpy 7.1, and a wait without a time-out burns a core; so this
is a loop over ``spin_once``, which handles one event at a time. The executor knows no guard conditions,
``wake()`` does not end a wait, and an exception in a task or in a future's callback is fatal to the process:
tasks wake it instead, and every callback of a :class:`FlorenceNode` passes its exception to
:meth:`SpinLoop.spin_once`.
"""

from __future__ import annotations

import threading
from typing import Any

from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.rounds import Rounds
from florence_bt.ros.shared_clock import SharedClock

LONG_S = 3600.0
"""A wait that something ends sooner. Chosen."""


class SpinLoop:
    """Serves some nodes on the calling thread; together they listen to ``/clock`` once.

    Args:
        context: The ROS context; the process's own one when not given.
        keep_going: Hand an exception of a callback to :meth:`FlorenceNode.fail` in place of raising it.
    """

    def __init__(self, context: Context | None = None, *, keep_going: bool = False) -> None:
        self._keep_going = keep_going
        self._executor: Any = EventsExecutor(context=context)
        self._nodes: list[Node] = []
        self._own: tuple[FlorenceNode, ...] = ()
        self._more = False
        self._clock = SharedClock()
        self._rounds = Rounds(self._executor.create_task, self._on_late)

    def add(self, node: Node) -> None:
        """Serve a node from now on."""
        self._executor.add_node(node)
        # A node knows its executor only when it is set like this; setting it twice is harmless.
        node.executor = self._executor
        self._nodes.append(node)
        if isinstance(node, FlorenceNode):
            node.loop_rounds = self._rounds
        self._sort_out()
        self._clock.add(node)

    def remove(self, node: Node) -> None:
        """Serve a node no more."""
        self._nodes.remove(node)
        if isinstance(node, FlorenceNode):
            node.loop_rounds = None
        self._sort_out()
        self._clock.remove(node)
        self._executor.remove_node(node)

    def spin_once(self, timeout_s: float = LONG_S) -> None:
        """Handle one event, or give up after a while.

        Raises:
            Exception: What a callback raised, unless the loop keeps going; always what is fatal to a node.
        """
        own = self._own
        thread = threading.get_ident()
        for node in own:
            node.served_by = thread
        try:
            self._executor.spin_once(timeout_sec=0.0 if self._more else timeout_s)
            self._more = False
            for node in own:
                self._more |= node.run_soon()
        finally:
            for node in own:
                node.served_by = None
        for node in own:
            if node.fatal is not None:
                fatal, node.fatal = node.fatal, None
                raise fatal
            while node.failures:
                error = node.failures.popleft()
                if not self._keep_going:
                    raise error
                node.fail(error)

    def drain(self, events: int = 100) -> None:
        """Handle what is waiting already, at most some events."""
        for _ in range(events):
            self.spin_once(0.0)

    def _on_late(self, late_s: float) -> None:
        """Let the first of our nodes tell that all of them are late."""
        for node in self._own[:1]:
            node.attempt(node.health.count_late, late_s)

    def _sort_out(self) -> None:
        self._own = tuple(node for node in self._nodes if isinstance(node, FlorenceNode))

    def interrupt(self) -> None:
        """Make a waiting :meth:`spin_once` return; may be called from any thread."""
        self._executor.create_task(_nothing)

    def close(self) -> None:
        """Stop serving all nodes."""
        for node in reversed(tuple(self._nodes)):
            self.remove(node)
        self._executor.shutdown()


def _nothing() -> None:
    """Do nothing, as an interrupted executor does."""
