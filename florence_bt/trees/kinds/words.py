"""The words of nodes in the mission language, and what they mean: tables over the records of the kinds."""

from __future__ import annotations

from florence_bt.trees.kinds import BY_WORD, OF_MODIFIERS, RunSkill
from florence_bt.trees.language.node_kind import Modifier
from florence_bt.trees.language.vocabulary import ANYWHERE

A_SKILL = "a skill"
"""The name of a skill among the kinds that a modifier belongs to."""
_OWNERS = {**{word: node.kind for word, node in BY_WORD.items()}, A_SKILL: RunSkill.kind}

NODE_KINDS: dict[str, str] = {word: node.kind.about for word, node in BY_WORD.items()}
"""Kind key -> what the node does."""

MODIFIERS: dict[str, Modifier] = {
    modifier.word: modifier for kind in _OWNERS.values() for modifier in kind.modifiers
}
"""The modifiers that only some kinds take."""

OWNERS: dict[str, tuple[str, ...]] = {
    word: tuple(owner for owner, kind in _OWNERS.items() if modifier in kind.modifiers)
    for word, modifier in MODIFIERS.items()
}
"""Modifier -> the kinds that it belongs to."""

NEVER_INPUTS = (
    *(word for word in ANYWHERE if word != "name"),
    *(word for word, modifier in MODIFIERS.items() if modifier.never_input),
)
"""Modifiers that are not good names for inputs: found there, they are indented one step too far."""

RESERVED = frozenset((*NODE_KINDS, *ANYWHERE, *MODIFIERS, "time"))
"""Names that no skill can have; ``time`` stands under ``wait_until``."""

ANYWHERE_TEXTS: dict[str, str] = {
    "name": "shown instead of the name that the kind gives",
    "when": "must hold before the node starts; the node is skipped otherwise",
    "while": "must hold all along; the node is stopped and fails otherwise",
    "because": "the reason of a failure in your own words, or one for each code",
    "finally": "a node that runs afterwards, on success, failure and cancel alike",
    **{word: node.kind.about for word, node in OF_MODIFIERS.items()},
}
"""Modifier that every node may have -> what it does."""

KEY_WORDS = frozenset(
    (
        *(word for word, node in BY_WORD.items() if node.kind.names_keys),
        *(word for word, modifier in MODIFIERS.items() if modifier.names_key),
    )
)
"""Kinds and modifiers that are given keys to write."""

TREE_CODES: dict[str, str] = {
    "missing_key": "a key was read that nothing has written",
    "bad_input": "an input does not fit what the skill or mission declares",
    "bad_output": "a skill succeeded without giving what it promises, or a key was given what it cannot hold",
    "bad_expression": "an expression has no value: a division by zero, an infinite number",
    "no_skill": "this robot lacks the skill",
    "cancelled": "a skill was cancelled by its server",
    "guard_failed": "`while` did not hold",
    **{
        code: meaning
        for node in (*BY_WORD.values(), *OF_MODIFIERS.values())
        for code, meaning in node.kind.failures.items()
    },
}
"""Codes that the tree itself gives -> what they mean."""
