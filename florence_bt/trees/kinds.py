"""The vocabulary of the mission language: kinds of nodes, modifiers, and where each modifier belongs."""

from __future__ import annotations

import re

NODE_KINDS: dict[str, str] = {
    "sequence": "does its nodes one after the other, until one fails",
    "selector": "tries its nodes one after the other, until one succeeds",
    "parallel": "does its nodes at the same time",
    "retry": "starts a node again when it fails, at most so many times",
    "repeat": "does a node so many times",
    "timeout": "stops a node that takes longer",
    "invert": "turns the success of a node into failure and its failure into success",
    "succeed": "does a node and counts its failure as success",
    "fail": "fails with a reason",
    "wait": "pauses",
    "set": "writes keys",
    "run": "runs another mission with keys of its own",
}
"""Kind key -> what the node does."""

ANYWHERE = ("name", "because", "finally")
"""Modifiers that every node may have."""

MODIFIERS: dict[str, tuple[str, ...]] = {
    "do": ("retry", "repeat", "timeout"),
    "on": ("retry",),
    "attempt": ("retry",),
    "memory": ("sequence", "selector"),
    "policy": ("parallel",),
    "code": ("fail",),
    "with": ("run",),
    "out": ("run", "a skill"),
}
"""Further modifiers -> the kinds that they belong to."""

NEVER_INPUTS = ("out", "because", "finally", "do", "with")
"""Modifiers that are no good names for inputs: found there, they are indented one step too far."""

RESERVED = frozenset((*NODE_KINDS, *ANYWHERE, *MODIFIERS))
"""Names that no skill can have."""

MISSION_KEYS = ("mission", "description", "inputs", "outputs", "on_restart", "tree")
INPUT_KEYS = ("type", "default", "min", "max", "description")
OUTPUT_KEYS = ("type", "description")
ON_RESTART = ("abort", "restart", "resume")

IDENTIFIER = re.compile(r"[a-z][a-z0-9_]*")
"""How missions, skills, inputs, outputs, keys and codes are named."""

FAILED = "failed"
"""The code of ``fail`` when it names none."""
