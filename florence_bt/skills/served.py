"""Every shipped skill and how it is served; the tables are in the ``declaration`` modules."""

from __future__ import annotations

from florence_bt.core.serving import Served, ServedAction
from florence_bt.skills.base import declaration as base
from florence_bt.skills.choice import declaration as choice
from florence_bt.skills.locator import declaration as locator
from florence_bt.skills.navigation.navigate import declaration as navigate
from florence_bt.skills.people.approach_user import declaration as approach_user
from florence_bt.skills.people.user_tracker import declaration as user_tracker
from florence_bt.skills.speech import declaration as speech
from florence_bt.skills.time_of_day import declaration as time_of_day

SERVED: tuple[Served, ...] = (
    *navigate.SERVED,
    *user_tracker.SERVED,
    *approach_user.SERVED,
    *locator.SERVED,
    *base.SERVED,
    *speech.SERVED,
    *choice.SERVED,
    *time_of_day.SERVED,
)

ACTIONS = (
    *(served.name for served in SERVED if isinstance(served, ServedAction)),
    *navigate.ACTIONS_WITHOUT_SKILL,
)
"""The names of all actions: what moves the robot, and what it must not move during."""
