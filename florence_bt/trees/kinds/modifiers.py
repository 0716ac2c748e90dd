"""Modifiers that several kinds of nodes take; those of one kind stand beside it."""

from __future__ import annotations

from florence_bt.trees.language.node_kind import Modifier
from florence_bt.trees.language.value_schemas import NAME, NODE

DO = Modifier("do", "the node that this one is about", NODE, never_input=True)
CODE = Modifier("code", "the code of the failure: what others find it by", {"$ref": "#/definitions/code"})
MEMORY = Modifier(
    "memory",
    "false: conditions are watched while a later node runs",
    {"type": "boolean", "default": True, "errorMessage": "true or false"},
)
OUT = Modifier(
    "out",
    "the outputs, each with the key that receives it",
    {"type": ["object", "null"], "propertyNames": NAME},
    never_input=True,
)
