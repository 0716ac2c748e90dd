"""Every shipped skill and how it is served; the tables are in the ``declaration`` modules."""

from __future__ import annotations

from florence_bt.core.serving import ActionBinding, SkillBinding
from florence_bt.skills.base import declaration as base
from florence_bt.skills.choice import declaration as choice
from florence_bt.skills.locator import declaration as locator
from florence_bt.skills.navigation.navigate import declaration as navigate
from florence_bt.skills.people.approach_user import declaration as approach_user
from florence_bt.skills.people.user_tracker import declaration as user_tracker
from florence_bt.skills.speech import declaration as speech
from florence_bt.skills.time_of_day import declaration as time_of_day

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
