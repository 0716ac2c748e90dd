"""The words of BehaviorTree.CPP's XML, and those that we add to it.

What we add is of two kinds. Attributes that begin with ``_florence`` are for our own import: BehaviorTree.CPP
keeps them aside and does nothing with them. Nodes that begin with ``Florence`` do what no node of
BehaviorTree.CPP does (``known_nodes.xml``); an export that uses one declares it in ``TreeNodesModel``.
"""

from __future__ import annotations

from florence_bt.core.declaration import Kind

FORMAT = "4"
CATEGORIES = ("Action", "Condition", "Control", "Decorator", "SubTree")
"""Elements that name their node in the attribute ``ID``."""

PREFIX = "florence:"
"""Before a value of a port that is written in the mission language."""
MARK = "_florence"
"""The attribute with an expression as it stands in a mission."""

PRE_CONDITIONS = ("_failureIf", "_successIf", "_skipIf", "_onlyIf", "_while", "_onStart")
"""In the order of their evaluation; ``_onlyIf`` and ``_onStart`` came with version 4.11."""
POST_CONDITIONS = ("_onHalted", "_onFailure", "_onSuccess", "_post")
SCRIPTS = {"Script": ("code", "_onStart", *POST_CONDITIONS), "": ("_onStart", *POST_CONDITIONS)}
"""Element -> its attributes that can assign; those of an empty name are of all others."""

ENDLESS = "forever"
"""The mark of a loop without end that is our own, and has its pauses where it needs them."""
POLL = "10 ms"
"""BehaviorTree.CPP's own pause between two ticks; ours in an endless loop."""

V3_NAMES = {
    "SequenceStar": "SequenceWithMemory",
    "FallbackStar": "Fallback",
    "SubTreePlus": "SubTree",
    "BlackboardCheckInt": "BlackboardCheck",
    "BlackboardCheckDouble": "BlackboardCheck",
    "BlackboardCheckString": "BlackboardCheck",
    "BlackboardCheckBool": "BlackboardCheck",
}
"""Names of version 3 -> names of version 4; ``BlackboardCheck`` is for all that version 4 dropped."""

LOOP_KINDS = {
    "LoopInt": Kind.INTEGER,
    "LoopDouble": Kind.NUMBER,
    "LoopString": Kind.TEXT,
    "LoopBool": Kind.BOOLEAN,
}
"""Loops -> the kind of their values."""

KIND_TYPES: dict[Kind, str] = {
    Kind.TEXT: "std::string",
    Kind.BOOLEAN: "bool",
    Kind.INTEGER: "int",
    Kind.NUMBER: "double",
    Kind.LENGTH: "double",
    Kind.ANGLE: "double",
    Kind.DURATION: "double",
    Kind.SPEED: "double",
    Kind.POSE: "Pose2D",
}
"""Our kinds -> the types of ports."""
KIND_TYPES |= {kind: f"std::vector<{KIND_TYPES[kind.item]}>" for kind in Kind if kind.item is not None}
KIND_UNITS: dict[Kind, str] = {
    Kind.LENGTH: "[m]",
    Kind.ANGLE: "[rad]",
    Kind.DURATION: "[s]",
    Kind.SPEED: "[m/s]",
    Kind.POSE: "[m;m;rad]",
}
KIND_UNITS |= {kind: KIND_UNITS[kind.item] for kind in Kind if kind.item in KIND_UNITS}
"""Kinds with units -> what ends the description of their ports."""


def private_key(tree: str, port: str) -> str:
    """Return where an output goes that a call does not ask for: BehaviorTree.CPP wants a key for each."""
    return f"_{tree}_{port}"
