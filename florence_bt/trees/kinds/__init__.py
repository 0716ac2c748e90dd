"""The kinds of nodes, one module each: all that is a fact about a kind stands there.

A module has the node, as it is written in a mission, and its record (``kind``): words, modifiers, what stands
behind them, an example. The methods of the node say what it reads and writes, how it is drawn, how it can end
and which behaviour it becomes. Parser, schema, reference, completion and drawings go over the records; an
analysis that is an algorithm (the flow of keys, what is never reached) has a module of its own in ``checks``.

The behaviours are imported only where a tree is built: a check needs neither them nor py_trees.
"""

from florence_bt.trees.kinds.append import Append
from florence_bt.trees.kinds.call_mission import CallMission
from florence_bt.trees.kinds.condition import Condition
from florence_bt.trees.kinds.ensure import Ensure
from florence_bt.trees.kinds.fail import Fail
from florence_bt.trees.kinds.for_each import ForEach
from florence_bt.trees.kinds.if_ import If
from florence_bt.trees.kinds.interruptible import Interruptible
from florence_bt.trees.kinds.invert import Invert
from florence_bt.trees.kinds.on_failure import OnFailure
from florence_bt.trees.kinds.once import Once
from florence_bt.trees.kinds.parallel import Parallel, ParallelPolicy, PolicyKind
from florence_bt.trees.kinds.repeat import Repeat
from florence_bt.trees.kinds.retry import Retry
from florence_bt.trees.kinds.run_skill import RunSkill
from florence_bt.trees.kinds.selector import Selector
from florence_bt.trees.kinds.sequence import Sequence
from florence_bt.trees.kinds.set import Add, Set
from florence_bt.trees.kinds.succeed import Succeed
from florence_bt.trees.kinds.switch import Switch
from florence_bt.trees.kinds.timeout import Timeout
from florence_bt.trees.kinds.until import Until
from florence_bt.trees.kinds.wait import Wait
from florence_bt.trees.kinds.wait_until import WaitUntil
from florence_bt.trees.language.model import Node

BY_WORD: dict[str, type[Node]] = {
    node.kind.word: node
    for node in (
        *(Sequence, Selector, Parallel, If, Switch, ForEach, Retry, Repeat, Timeout, Once, Invert, Succeed),
        *(Condition, Fail, Wait, WaitUntil, Set, Add, Append, CallMission),
    )
}
"""Kind key -> its node, in the order of the manual. Every other kind key is the name of a skill."""
OF_MODIFIERS: dict[str, type[Node]] = {
    node.kind.word: node for node in (Interruptible, Until, OnFailure, Ensure)
}
"""Modifier that any node may have -> the node that it puts round it."""
ALL: tuple[type[Node], ...] = (*BY_WORD.values(), *OF_MODIFIERS.values(), RunSkill)
"""The nodes of all kinds."""

__all__ = [
    "ALL",
    "BY_WORD",
    "OF_MODIFIERS",
    "Add",
    "Append",
    "CallMission",
    "Condition",
    "Ensure",
    "Fail",
    "ForEach",
    "If",
    "Interruptible",
    "Invert",
    "OnFailure",
    "Once",
    "Parallel",
    "ParallelPolicy",
    "PolicyKind",
    "Repeat",
    "Retry",
    "RunSkill",
    "Selector",
    "Sequence",
    "Set",
    "Succeed",
    "Switch",
    "Timeout",
    "Until",
    "Wait",
    "WaitUntil",
]
