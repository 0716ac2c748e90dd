"""The task that goals about one person share: it outlives each of them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

from florence_bt.core.geometry import Point2
from florence_bt.skills.navigation.navigate.contact import ContactRecovery
from florence_bt.skills.navigation.navigate.following.motions import FollowGoal, Motions
from florence_bt.skills.navigation.navigate.parameters import FollowParameters, NavigatorParameters
from florence_bt.skills.navigation.navigate.people_tracks import PeopleTracks
from florence_bt.skills.navigation.navigate.person_track import PersonTrack
from florence_bt.skills.navigation.navigate.state import Costmaps

_CAME_POINTS = 50
"""So many points are remembered of the way the robot came."""


@dataclass(frozen=True, slots=True)
class FollowTask:
    """A goal about a person, and what its parts work with.

    Attributes:
        goal: Whom to go after, and how.
        costmaps: Where the robot drives.
        parameters: Of navigation.
        people: Where the person is, and everybody else.
        came: The way the robot came, odometry frame, metres.
        contact: What the robot has touched.
        motions: What the robot may drive.
    """

    goal: FollowGoal
    costmaps: Costmaps
    parameters: NavigatorParameters
    people: PeopleTracks
    came: deque[Point2]
    contact: ContactRecovery
    motions: Motions

    @classmethod
    def begin(
        cls, goal: FollowGoal, costmaps: Costmaps, parameters: NavigatorParameters, people: PeopleTracks
    ) -> FollowTask:
        """Make the task of a goal that goes on with no other."""
        params = parameters.follow
        return cls(
            goal,
            costmaps,
            parameters,
            people,
            deque(maxlen=_CAME_POINTS),
            ContactRecovery(costmaps, parameters.recovery),
            Motions(goal, params),
        )

    def go_on(self, goal: FollowGoal) -> FollowTask:
        """Return the task of a newer goal about the same person."""
        return replace(self, goal=goal, motions=Motions(goal, self.params))

    @property
    def track(self) -> PersonTrack:
        """The track of the person."""
        return self.people.of(self.goal.user_id)

    @property
    def params(self) -> FollowParameters:
        """The parameters ``follow_*``."""
        return self.parameters.follow
