"""When a node is settled: what says, right after a tick, that another one would change nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees import decorators
from py_trees.common import Status

from florence_bt.behaviours.reactive import takes_part
from florence_bt.behaviours.stepping import Stepping
from florence_bt.runtime.ticking._dispatch import Maker, maker_of
from florence_bt.runtime.ticking._leaves import make_constant, make_unknown, overrides
from florence_bt.runtime.ticking._own import make_stepping
from florence_bt.runtime.ticking._records import CLEAN

RUNNING, INVALID = Status.RUNNING, Status.INVALID

PURE = (
    decorators.Condition,
    decorators.FailureIsRunning,
    decorators.FailureIsSuccess,
    decorators.Inverter,
    decorators.PassThrough,
    decorators.RunningIsFailure,
    decorators.RunningIsSuccess,
    decorators.SuccessIsFailure,
    decorators.SuccessIsRunning,
)
"""The decorators of py_trees whose answer depends on nothing but the child."""
QUIET = (decorators.ForEach, decorators.Repeat, decorators.Retry)
"""Those that do nothing of their own while the child is RUNNING."""

Settled = Callable[[], bool]


def settled_of(node: Any, maker: Maker, table: Any) -> Settled | None:
    """What says whether another tick would change nothing; None: it always might.

    Args:
        node: A leaf, a decorator or a composite of our own.
        maker: The maker of its functions.
        table: The incremental table, with the records of the other nodes.
    """
    if maker is make_constant:
        return lambda: True
    if isinstance(node, Stepping):
        return _stepping_settled(node, table) if maker is make_stepping else None
    if isinstance(node, decorators.Decorator):
        return None if maker is make_unknown else _decorator_settled(node, table)
    return node.settled if takes_part(node) and not node.children else None


def _stepping_settled(node: Stepping, table: Any) -> Settled:
    record = table.records[id(node)]
    return lambda: (
        node.status is RUNNING
        and all(table.adopt(child, record, 0).state == CLEAN for child in node.active())
    )


def _decorator_settled(node: Any, table: Any) -> Settled | None:
    record = table.records[id(node)]

    def child_clean() -> bool:
        return bool(table.adopt(node.decorated, record, 0).state == CLEAN)

    if takes_part(node):
        without_child = _ignores_stops(node.decorated, table)
        return lambda: (
            node.settled() and (without_child if node.decorated.status is INVALID else child_clean())
        )
    if type(node) in PURE:
        return child_clean
    if type(node) in QUIET:
        return lambda: node.decorated.status is RUNNING and child_clean()
    if type(node) is decorators.OneShot:
        # Once it bounces, a reset by the parent would still reset the child.
        return lambda: node.decorated.status is INVALID if node.final_status else child_clean()
    return None


def _ignores_stops(node: Any, table: Any) -> bool:
    """Whether a stop of a node that stands at INVALID does nothing.

    A full tick, which resets a decorator that had finished, stops the child even then.
    """
    maker = maker_of(table, node)
    promised = isinstance(node, Stepping) or takes_part(node) or maker is make_constant
    if maker is make_unknown or (overrides(node, "terminate") and not promised):
        return False
    return not isinstance(node, decorators.Decorator) or _ignores_stops(node.decorated, table)
