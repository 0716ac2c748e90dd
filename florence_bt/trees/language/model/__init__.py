"""A mission as written: frozen data with the position of every part. No behaviour and no checks live here."""

from florence_bt.trees.language.expressions.syntax import Expression
from florence_bt.trees.language.model.composites import (
    If,
    Parallel,
    Policy,
    PolicyKind,
    Selector,
    Sequence,
    Switch,
)
from florence_bt.trees.language.model.decorators import (
    Cooldown,
    Delay,
    Force,
    Invert,
    Once,
    Repeat,
    Retry,
    Succeed,
    Timeout,
)
from florence_bt.trees.language.model.leaves import Call, Condition, Fail, Set, Use, Wait
from florence_bt.trees.language.model.mission import Mission, default_of, values_of
from florence_bt.trees.language.model.node import Node, Wrapper, walk
from florence_bt.trees.language.model.values import (
    Literal,
    PoseParts,
    Reasons,
    Reference,
    Template,
    Value,
    references,
    show,
)

__all__ = [
    "Call",
    "Condition",
    "Cooldown",
    "Delay",
    "Expression",
    "Fail",
    "Force",
    "If",
    "Invert",
    "Literal",
    "Mission",
    "Node",
    "Once",
    "Parallel",
    "Policy",
    "PolicyKind",
    "PoseParts",
    "Reasons",
    "Reference",
    "Repeat",
    "Retry",
    "Selector",
    "Sequence",
    "Set",
    "Succeed",
    "Switch",
    "Template",
    "Timeout",
    "Use",
    "Value",
    "Wait",
    "Wrapper",
    "default_of",
    "references",
    "show",
    "values_of",
    "walk",
]
