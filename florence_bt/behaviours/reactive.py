"""The contract of nodes that say when a tick may bring something new, so that a ticker can leave them out.

A ticker (``florence_bt.runtime.ticking``) that ticks incrementally passes over a node that is *settled* until
somebody touches it. A node that does not take part is ticked whenever a full tick would tick it, so taking
part is never necessary for a right result, only for a fast one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from py_trees.common import Status

SETTLES = "settled"
"""The name of the method that makes a class take part."""
LIFE_CYCLE = ("initialise", "update", "terminate", "prepare", "tick", "stop")
"""The methods that decide what a tick does. A subclass that overrides one has to answer for itself."""


class Reactive:
    """Mixed into a behaviour or a decorator that takes part in incremental ticking.

    The class promises: while :meth:`settled` holds, ticking the node once more (for a decorator: with a child
    for which the same is true) would change nothing that anybody can see, until :meth:`touch` is called. In
    particular it would start nothing, count nothing and give the same status. A stop while the node stands at
    INVALID changes nothing either. Touching too often is harmless.

    A subclass that overrides ``initialise``, ``update``, ``terminate``, ``prepare``, ``tick`` or ``stop``
    without overriding :meth:`settled` takes no part: it is ticked every time.
    """

    status: Status
    children: list[Any]
    on_touch: Callable[[], None] | None = None
    """Set by the ticker: called when the node is touched."""

    def settled(self) -> bool:
        """Whether another tick would change nothing until the next touch; asked right after a tick.

        For a decorator: provided that the child is settled too, or that it stands at INVALID and would not be
        ticked.

        The answer here fits a leaf that works while it is RUNNING, and a decorator that does nothing of its
        own while its child is RUNNING: when they have finished, another tick would start them again.
        """
        return self.status is Status.RUNNING and all(c.status is Status.RUNNING for c in self.children)

    def touch(self) -> None:
        """Say that the next tick may bring something new. It does not ask for a tick."""
        if self.on_touch is not None:
            self.on_touch()


class AlwaysSettled(Reactive):
    """Mixed into a node whose status depends on nothing but what touches it (and on its child).

    A condition is such a node, also when it has finished: asked again, it answers the same.
    """

    def settled(self) -> bool:
        """Always, once it and its child were ticked; only a touch can bring something new."""
        return all(child.status is not Status.INVALID for child in self.children)


def takes_part(node: object) -> bool:
    """Whether a node is :class:`Reactive` and none of its subclasses changed what a tick does behind that."""
    cls: Any = type(node)
    return isinstance(node, Reactive) and _keeps_promise(cls)


@cache
def _keeps_promise(cls: Any) -> bool:
    order = cls.__mro__
    promise = next(index for index, owner in enumerate(order) if SETTLES in owner.__dict__)
    mixin = next(index for index, owner in enumerate(order) if owner in (Reactive, AlwaysSettled))
    if promise == mixin:
        # The promise of a mixin counts for the class that names it among its bases.
        promise = max(index for index, owner in enumerate(order) if order[mixin] in owner.__bases__)
    return not any(name in owner.__dict__ for owner in order[:promise] for name in LIFE_CYCLE)
