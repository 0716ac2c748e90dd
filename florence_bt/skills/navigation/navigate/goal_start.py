"""The start of a goal: what is asked, and what there is to begin with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from florence_bt.core.geometry import FramedPose, Pose2
from florence_bt.core.outcome import Result, failure
from florence_bt.skills.navigation.navigate.goal import NavigationGoal
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.people_tracks import PeopleTracks
from florence_bt.skills.navigation.navigate.state import Costmaps

ToMap = Callable[[FramedPose], Pose2 | Result]
"""Takes a pose to the map frame, or says why that cannot be done."""


def as_in_map(given: FramedPose) -> Pose2 | Result:
    """Take a pose for one in the map frame, whatever its frame; return a failure when it is none."""
    return failure("bad_input", given.problem) if given.problem else given.pose


@dataclass(frozen=True, slots=True)
class GoalStart:
    """The situation in which a goal begins.

    Attributes:
        now: Seconds.
        costmaps: Where the robot drives.
        parameters: All of navigation.
        people: Where everybody is.
        before: The goal that this one replaces, or that has just ended well; None without one.
        to_map: Takes poses to the map frame.
    """

    now: float
    costmaps: Costmaps
    parameters: NavigatorParameters
    people: PeopleTracks
    before: NavigationGoal | None = None
    to_map: ToMap = as_in_map


class ActionGoal(Protocol):
    """The goal of an action, with the fields of its interface."""

    def begin(self, start: GoalStart) -> NavigationGoal | Result:
        """Make what is driven; a failure when that cannot be done."""
        ...
