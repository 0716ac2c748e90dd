"""The words of BehaviorTree.CPP's XML, and those that we add to it.

What we add is of two kinds. Attributes that begin with ``_florence`` are for our own import: BehaviorTree.CPP
keeps them aside and does nothing with them. Nodes that begin with ``Florence`` do what no node of
BehaviorTree.CPP does; an export that uses one declares it in ``TreeNodesModel``.
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
"""In the order in which they are looked at; ``_onlyIf`` and ``_onStart`` came with version 4.11."""
POST_CONDITIONS = ("_onHalted", "_onFailure", "_onSuccess", "_post")

FOREVER = 1_000_000_000
"""How often something is done for ever: 31 years at one a second."""
POLL = "10 ms"
"""BehaviorTree.CPP's own pause between two ticks; ours when something is tried for ever."""

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

_SWITCHES = [f"Switch{cases}" for cases in range(2, 7)]
_SEQUENCES = ["Sequence", "AsyncSequence", "SequenceWithMemory", "ReactiveSequence"]
_FALLBACKS = ["Fallback", "AsyncFallback", "ReactiveFallback"]
_FURTHER = ["Parallel", "ParallelAll", "IfThenElse", "WhileDoElse", "TryCatch", "Finally", "ManualSelector"]
_ROUNDS = ["RetryUntilSuccessful", "RetryUntilSuccesful", "Repeat", "KeepRunningUntilFailure", "RunOnce"]
_ENDS = ["Inverter", "ForceSuccess", "ForceFailure", "Precondition", "Timeout", "Delay"]
_UPDATES = ["SkipUnlessUpdated", "WaitValueUpdate", "BlackboardCheck"]
_BLACKBOARD = ["Script", "ScriptCondition", "SetBlackboard", "UnsetBlackboard", "WasEntryUpdated"]

LOOP_KINDS = {
    "LoopInt": Kind.INTEGER,
    "LoopDouble": Kind.NUMBER,
    "LoopString": Kind.TEXT,
    "LoopBool": Kind.BOOLEAN,
}
"""Loops -> the kind of their values."""
CONTROLS = frozenset([*_SEQUENCES, *_FALLBACKS, *_FURTHER, *_SWITCHES])
DECORATORS = frozenset([*_ROUNDS, *_ENDS, *LOOP_KINDS, *_UPDATES])
LEAVES = frozenset([*_BLACKBOARD, "AlwaysSuccess", "AlwaysFailure", "Sleep"])
NAV2_CONTROLS = frozenset(("RecoveryNode", "RoundRobin", "PipelineSequence"))
"""Controls of Nav2 whose meaning is known."""

OWN_CONTROLS = frozenset(("FlorenceFinally", "FlorenceParallel", "FlorenceSwitch"))
OWN_DECORATORS = frozenset(
    ("FlorenceRetry", "FlorenceTimeout", "FlorenceDelay", "FlorenceCooldown", "FlorenceGuard")
)
OWN_LEAVES = frozenset(("FlorenceWait", "FlorenceSet", "FlorenceCondition"))

OWN_PORTS: dict[str, dict[str, str]] = {
    "FlorenceFinally": {},
    "FlorenceParallel": {"names": "the branches that must succeed, with ; between them"},
    "FlorenceSwitch": {
        "value": "what is looked at, once, at the start",
        "cases": "the values of the branches, a list as in YAML; a further branch is the default",
    },
    "FlorenceRetry": {
        "num_attempts": "how often at most",
        "on": "the failure codes that are worth another attempt, with ; between them; empty for all",
        "attempt": "receives the number of the attempt",
    },
    "FlorenceTimeout": {"seconds": "how long the child may take"},
    "FlorenceDelay": {"seconds": "the pause before the child starts"},
    "FlorenceCooldown": {"seconds": "how long after a success the child cannot start again"},
    "FlorenceGuard": {
        "when": "what must hold before the start, as in a mission",
        "unless": "what must not hold before the start, as in a mission",
        "while": "what must hold all along, as in a mission",
    },
    "FlorenceWait": {"seconds": "the length of the pause"},
    "FlorenceSet": {"values": "keys and values, as in a mission"},
    "FlorenceCondition": {"code": "what must hold, as in a mission"},
}
"""Our own nodes -> their ports with what they mean."""

OUTPUT_PORTS = frozenset({("FlorenceRetry", "attempt")})
"""The ports of our own nodes that are written."""

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
KIND_UNITS: dict[Kind, str] = {
    Kind.LENGTH: "[m]",
    Kind.ANGLE: "[rad]",
    Kind.DURATION: "[s]",
    Kind.SPEED: "[m/s]",
    Kind.POSE: "[m;m;rad]",
}
"""Kinds with units -> what ends the description of their ports."""


def category_of(tag: str) -> str | None:
    """Whether a known element is a control, a decorator or a leaf; None when it is none of them."""
    if tag in CONTROLS | OWN_CONTROLS | NAV2_CONTROLS:
        return "Control"
    if tag in DECORATORS | OWN_DECORATORS:
        return "Decorator"
    return "Action" if tag in LEAVES | OWN_LEAVES else None


def private_key(tree: str, port: str) -> str:
    """Where an output goes that a call does not ask for: BehaviorTree.CPP wants a key for each."""
    return f"_{tree}_{port}"
