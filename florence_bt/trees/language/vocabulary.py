"""The vocabulary of the mission language: kinds of nodes, modifiers, and where each modifier belongs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

NODE_KINDS: dict[str, str] = {
    "sequence": "runs its nodes one after the other until one fails",
    "selector": "tries its nodes one after the other until one succeeds",
    "parallel": "runs its nodes at the same time",
    "if": "runs one of two nodes",
    "switch": "runs the node whose case equals a value",
    "for_each": "runs a node once for each item of a list",
    "retry": "starts a node again when it fails, up to a number of attempts",
    "repeat": "runs a node a number of times",
    "timeout": "stops a node that takes longer",
    "once": "runs a node once and keeps its result",
    "invert": "turns the success of a node into failure and its failure into success",
    "succeed": "runs a node and counts its failure as success",
    "condition": "succeeds when an expression holds",
    "fail": "fails with a reason",
    "wait": "pauses",
    "wait_until": "pauses until something is so",
    "set": "writes keys",
    "add": "adds to numbers and quantities",
    "append": "adds to a text or a list",
    "run": "runs another mission with keys of its own",
}
"""Kind key -> what the node does."""

GUARDS = ("when", "while")
"""Modifiers that say when a node may start and go on; their values are expressions."""

OUTSIDE = ("name", "when", "because", "finally")
"""Modifiers that are about a node together with what its `until`, `on_failure` and `ensure` do."""

ANYWHERE = ("name", *GUARDS, "interrupted_by", "until", "on_failure", "ensure", "because", "finally")
"""Modifiers that every node may have."""

MODIFIERS: dict[str, tuple[str, ...]] = {
    "do": ("for_each", "retry", "repeat", "timeout"),
    "then": ("if",),
    "else": ("if",),
    "cases": ("switch",),
    "default": ("switch",),
    "as": ("for_each",),
    "index": ("for_each",),
    "go_on_over": ("for_each",),
    "first_success": ("for_each",),
    "on": ("retry",),
    "attempt": ("retry",),
    "between": ("retry",),
    "memory": ("sequence", "selector", "if"),
    "policy": ("parallel",),
    "code": ("fail", "condition", "invert", "for_each"),
    "with": ("run",),
    "out": ("run", "a skill"),
    "every": ("a skill",),
}
"""Further modifiers -> the kinds that they belong to."""

BESIDE: dict[str, tuple[str, ...]] = {"code": ("while", "until", "ensure")}
"""Modifiers of :data:`MODIFIERS` -> other modifiers of a node that allow them too, whatever its kind."""

NEVER_INPUTS = (
    "out",
    "every",
    "because",
    "finally",
    "do",
    "with",
    "when",
    "while",
    "interrupted_by",
    "until",
    "on_failure",
    "ensure",
    "then",
    "else",
    "cases",
    "between",
    "go_on_over",
    "first_success",
)
"""Modifiers that are not good names for inputs: found there, they are indented one step too far."""

RESERVED = frozenset((*NODE_KINDS, *ANYWHERE, *MODIFIERS, "time"))
"""Names that no skill can have; ``time`` stands under ``wait_until``."""

MISSION_KEYS = ("mission", "description", "imported_from", "inputs", "outputs", "keys", "on_restart", "tree")
INTERRUPTION_KEYS = ("if", "do")
"""What stands under ``interrupted_by``: what is asked, and what is done then."""
INPUT_KEYS = ("type", "default", "min", "max", "description")
KEY_KEYS = INPUT_KEYS
OUTPUT_KEYS = ("type", "description")
SKILL_INPUT_KEYS = (*INPUT_KEYS, "names", "choices")
SKILL_OUTPUT_KEYS = (*OUTPUT_KEYS, "default", "names")
LABELLED = ("room", "hotspot")
"""What a text can name of a home: ``names`` of an input or output of a skill."""
POLICIES = ("all", "any")
"""Policies of a parallel that are a word; the others are a list of names, or a table."""
POLICY_KEYS = ("succeed", "fail")
ON_RESTART = ("abort", "restart", "resume")

IDENTIFIER = re.compile(r"[a-z][a-z0-9_]*")
"""How missions, skills, inputs, outputs, keys and codes are named."""

MAX_QUICK_ROUNDS = 5000
"""How often a tree may be ticked in a row although nothing outside it has happened: a loop of nodes that take
no time has no more rounds. Chosen: 2,000 quick rounds are somebody's loop, and 5,000 are over in seconds."""
FAILED = "failed"
"""The code of ``fail`` when it names none."""
CONDITION_FALSE = "condition_false"
"""The code of a ``condition`` that names none."""
UNEXPECTED_SUCCESS = "unexpected_success"
"""The code of an ``invert`` that names none."""
GUARD_FAILED = "guard_failed"
"""The code of a ``while`` that names none."""
UNTIL_NOT_MET = "until_not_met"
"""The code of an ``until`` that names none."""
NOT_ENSURED = "not_ensured"
"""The code of an ``ensure`` that names none."""
NONE_WORKED = "none_worked"
"""The code of a ``for_each`` with ``first_success: true`` that names none."""
FOREVER = "forever"
"""What stands after ``repeat`` and ``retry`` in place of a number."""

TREE_CODES: dict[str, str] = {
    "missing_key": "a key was read that nothing has written",
    "bad_input": "an input does not fit what the skill or mission declares",
    "bad_output": "a skill succeeded without giving what it promises, or a key was given what it cannot hold",
    "bad_expression": "an expression has no value: a division by zero, an infinite number",
    "no_skill": "this robot lacks the skill",
    "timed_out": "a time-out or a deadline passed",
    "cancelled": "a skill was cancelled by its server",
    "unexpected_success": "what was inverted succeeded",
    "skipped": "`when` kept a node of a selector from starting",
    "guard_failed": "`while` did not hold",
    "until_not_met": "a node was done before what its `until` waits for",
    "not_ensured": "a node succeeded, and its `ensure` does not hold",
    "condition_false": "the expression of a `condition` does not hold",
    "none_worked": "a `for_each` with `first_success: true` has no item that succeeds",
    "no_case": "no case of a `switch` fits",
    "failed": "`fail` without a code",
}
"""Codes that the tree itself gives -> what they mean."""

OTHER_YAWS = ("theta", "phi", "th", "angle", "heading", "orientation")
"""What others call the heading of a pose."""


def by_spelling(spellings: Mapping[str, Iterable[str]]) -> dict[str, str]:
    """Invert a table from each word to what others call it."""
    return {other: word for word, others in spellings.items() for other in others}
