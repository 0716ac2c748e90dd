"""What happens on a way through a mission, and whether it is what a property is about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from florence_bt.assurance.plan import codes_behind
from florence_bt.core.declaration import CodeGroup
from florence_bt.core.outcome import Result
from florence_bt.trees.language.code_groups import codes_named
from florence_bt.trees.language.model import PropertyEvent
from florence_bt.trees.language.properties import IT

Groups = Mapping[str, CodeGroup]
"""The groups of codes, by name."""


@dataclass(frozen=True, slots=True)
class Happening:
    """Something that happened in a step, for traces.

    Attributes:
        what: ``start``, ``end``, ``cancel``, ``wrong``, ``unwanted``, ``pause``, ``stop``,
            ``override``.
        path: The node, as a path.
        skill: The skill.
        result: How it ended.
        text: What else there is to say.
        inputs: What a skill was started with.
    """

    what: str
    path: str = ""
    skill: str = ""
    result: Result | None = None
    text: str = ""
    inputs: Mapping[str, Any] = field(default_factory=dict)


def is_at(event: PropertyEvent, each: Happening, groups: Groups) -> bool:
    """Tell whether something that happened to a skill is what an event names."""
    if each.skill != event.who or each.what not in ("start", "end"):
        return False
    if each.what == "start":
        return event.how == "begins"
    result = each.result
    if result is None or event.how in ("begins", "runs"):
        return False
    stopped = result.code == "cancelled"
    ways = {
        "fails": not result.succeeded and not stopped,
        "succeeds": result.succeeded,
        "is stopped": stopped,
    }
    return ways.get(event.how, True) and _has_code(event, result.code, groups)


def is_end(event: PropertyEvent, status: str, code: str, groups: Groups) -> bool:
    """Tell whether an end of the mission is what an event names."""
    ways = {"fails": "FAILED", "succeeds": "SUCCEEDED", "is stopped": "STOPPED"}
    fits = event.who == IT and ways.get(event.how, status) == status
    return fits and _has_code(event, code, groups)


def _has_code(event: PropertyEvent, code: str, groups: Groups) -> bool:
    return not event.code or bool(codes_named(event.code, groups) & codes_behind(code))
