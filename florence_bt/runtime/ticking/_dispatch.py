"""Which functions a class gets. A node with ways of its own is left to itself."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import CodeType, FunctionType
from typing import Any

from py_trees import composites, decorators
from py_trees.behaviour import Behaviour

from florence_bt.behaviours.decorators import PreparedDecorator
from florence_bt.behaviours.stepping import Stepping
from florence_bt.runtime.ticking._composites import make_selector, make_sequence
from florence_bt.runtime.ticking._decorators import make_decorator, make_eternal_guard, make_one_shot
from florence_bt.runtime.ticking._leaves import (
    CONSTANT_TERMINATES,
    CONSTANTS,
    make_constant,
    make_leaf,
    make_unknown,
)
from florence_bt.runtime.ticking._own import make_gated, make_stepping
from florence_bt.runtime.ticking._parallel import make_parallel
from florence_bt.runtime.ticking._table import Functions, Table

Maker = Callable[[Table, Behaviour], Functions]
"""Makes the functions for the class of an example."""

KNOWN_WAYS: dict[tuple[Any, Any], Maker] = {
    (Behaviour.tick, Behaviour.stop): make_leaf,
    (composites.Sequence.tick, composites.Sequence.stop): make_sequence,
    (composites.Selector.tick, composites.Selector.stop): make_selector,
    (composites.Parallel.tick, composites.Parallel.stop): make_parallel,
    (decorators.Decorator.tick, decorators.Decorator.stop): make_decorator,
    (decorators.EternalGuard.tick, decorators.Decorator.stop): make_eternal_guard,
    (decorators.OneShot.tick, decorators.Decorator.stop): make_one_shot,
    (PreparedDecorator.tick, decorators.Decorator.stop): make_gated,
}
"""The maker for a pair of ``tick`` and ``stop``, whichever class has them."""
METHODS = ("initialise", "update", "terminate", "tick", "stop")


def functions_of(table: Table, node: Behaviour) -> Functions:
    """The functions for the class of a node, with code of their own."""
    functions: Functions = specialised(maker_of(table, node))(table, node)
    return functions


def maker_of(table: Table, node: Behaviour) -> Maker:
    """The maker for the class of a node, by what the class overrides."""
    cls: Any = type(node)
    if cls in table.odd or _hears_of_its_status(cls):
        return make_unknown
    if cls.tick is Stepping.tick:
        return make_stepping  # with any ``stop``
    maker = KNOWN_WAYS.get((cls.tick, cls.stop), make_unknown)
    if maker is make_leaf and cls.update in CONSTANTS and cls.terminate in CONSTANT_TERMINATES:
        return make_constant if cls.initialise is Behaviour.initialise else make_leaf
    return maker


@cache
def _hears_of_its_status(cls: Any) -> bool:
    """Whether a class has a say when its status is set, as py_trees does more often than is needed."""
    return cls.__setattr__ is not object.__setattr__ or hasattr(cls, "status")


def is_odd(node: Behaviour) -> bool:
    """Whether a method that makes up a tick was replaced on this one node."""
    cls = type(node)
    for method in METHODS:
        if getattr(getattr(node, method), "__func__", None) is not getattr(cls, method):
            return True
    return False


def specialised(maker: Maker) -> Any:
    """A copy of a maker whose functions have code of their own.

    The interpreter keeps what it learns about the types at a place in the code beside the code. Nodes of
    different classes that share code would spoil that for each other; with code per class a tick is about a
    quarter faster.
    """
    assert isinstance(maker, FunctionType)
    code = maker.__code__
    constants = tuple(c.replace() if isinstance(c, CodeType) else c for c in code.co_consts)
    return FunctionType(code.replace(co_consts=constants), maker.__globals__, maker.__name__)
