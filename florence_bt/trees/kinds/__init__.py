"""The kinds of nodes, one module each: all that is a fact about a kind stands there.

A module has the node, as it is written in a mission, and its record (``kind``): words, modifiers, what stands
behind them, an example. The methods of the node say what it reads and writes, how it is drawn, how it can end
and which behaviour it becomes. Parser, schema, reference, completion and drawings go over the records; an
analysis that is an algorithm (the flow of keys, what is never reached) has a module of its own in ``checks``.

The behaviours are imported only where a tree is built: a check needs neither them nor py_trees.
"""

from florence_bt.trees.kinds.condition import Condition
from florence_bt.trees.kinds.for_each import ForEach
from florence_bt.trees.kinds.retry import Retry
from florence_bt.trees.language.model import Node

NODES: tuple[type[Node], ...] = (ForEach, Retry, Condition)
"""Every kind of node."""
BY_WORD: dict[str, type[Node]] = {node.kind.word: node for node in NODES}
"""Kind key -> its node."""
