"""What the parts of following somebody share."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.skills.navigation.navigate.following.motions import FollowGoal, Motions
from florence_bt.skills.navigation.navigate.following.track import PersonTrack
from florence_bt.skills.navigation.navigate.parameters import FollowParameters, NavigatorParameters
from florence_bt.skills.navigation.navigate.state import Costmaps


@dataclass(frozen=True, slots=True)
class FollowTask:
    """A goal to follow somebody, and what its parts work with.

    Attributes:
        goal: Whom to follow, and how.
        costmaps: Where the robot drives.
        parameters: Of navigation.
        track: Where the person is.
        motions: What the robot may drive.
    """

    goal: FollowGoal
    costmaps: Costmaps
    parameters: NavigatorParameters
    track: PersonTrack
    motions: Motions

    @property
    def params(self) -> FollowParameters:
        """The parameters ``follow_*``."""
        return self.parameters.follow
