"""Every shipped skill and how it is served; the tables are in the modules ``bindings``."""

from __future__ import annotations

from collections.abc import Mapping

from florence_bt.core.serving import ActionBinding, SkillBinding
from florence_bt.skills.base import bindings as base
from florence_bt.skills.choice import bindings as choice
from florence_bt.skills.locator import bindings as locator
from florence_bt.skills.navigation.navigate import bindings as navigate
from florence_bt.skills.people.approach_user import bindings as approach_user
from florence_bt.skills.people.user_tracker import bindings as user_tracker
from florence_bt.skills.speech import bindings as speech
from florence_bt.skills.time_of_day import bindings as time_of_day

BINDINGS: tuple[SkillBinding, ...] = (
    *navigate.BINDINGS,
    *user_tracker.BINDINGS,
    *approach_user.BINDINGS,
    *locator.BINDINGS,
    *base.BINDINGS,
    *speech.BINDINGS,
    *choice.BINDINGS,
    *time_of_day.BINDINGS,
)

ACTIONS = (
    *(served.name for served in BINDINGS if isinstance(served, ActionBinding)),
    *navigate.ACTIONS_WITHOUT_SKILL,
)
"""The names of all actions: what moves the robot, and what it must not move during."""


def error_codes(skill: str) -> Mapping[int, str]:
    """Map the error numbers of a skill's server to its failure codes; none where it has no numbers."""
    return next(
        (each.error_codes for each in BINDINGS if isinstance(each, ActionBinding) and each.skill == skill), {}
    )
