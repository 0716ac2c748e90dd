"""Common base of the goals about a person: recover from contacts, and keep off the person."""

from __future__ import annotations

from abc import abstractmethod
from typing import Self

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Point2, Twist2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.following.motions import FollowGoal, Move
from florence_bt.skills.navigation.navigate.following.path_follower import PathFollower
from florence_bt.skills.navigation.navigate.following.retreat_path import RetreatPath
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.goal import NavigationGoal
from florence_bt.skills.navigation.navigate.goal_start import GoalStart
from florence_bt.skills.navigation.navigate.personal_space import keep_off
from florence_bt.skills.navigation.navigate.state import CycleState, Feedback

_MINDED_S = 6.0
"""The robot keeps off the place of a person who was not seen for so long. Chosen."""
_STUCK_S = 1.0
"""Time without a free motion, of those wanted, after which the robot backs out a little."""


class PersonGoal(NavigationGoal):
    """A goal about a person, which goes on with what the goal before it knew of them.

    It does the first that applies of: back off from a contact, back out from where it is stuck, what the
    goal is about.
    """

    keeps_map = True

    def __init__(self, task: FollowTask, now: float) -> None:
        self._task = task
        self._contact = task.contact
        self._path_follower = PathFollower(task)
        self._retreat_path = RetreatPath(task)
        self._moved = now
        self._stuck_since: float | None = None

    @classmethod
    def begin(cls, goal: FollowGoal, start: GoalStart) -> Self:
        """Begin; go on with what the goal before knew of the same person."""
        before, now = start.before, start.now
        if isinstance(before, PersonGoal) and before.user_id == goal.user_id and before.track_is_past(now):
            return cls(before._task.go_on(goal), now)
        start.people.forget(now)
        return cls(FollowTask.begin(goal, start.costmaps, start.parameters, start.people), now)

    @abstractmethod
    def _choose(self, state: CycleState) -> Move:
        """Decide what to do in this cycle."""

    def track_is_past(self, now: float) -> bool:
        """Tell whether the person was not seen after now: the clock was not set back."""
        return (self._task.track.seen or now) <= now

    @property
    def user_id(self) -> int:
        """The persistent id of the person."""
        return self._task.goal.user_id

    @property
    def path(self) -> NDArray[np.float64] | None:
        """The path that is followed, shape (n, 2) in the map frame, or None."""
        return self._path_follower.path

    @property
    def person(self) -> Point2 | None:
        """Give the person's last place, in the odometry frame, metres; None before."""
        return None if self._task.track.seen is None else self._task.track.last

    @property
    def followed(self) -> tuple[int, Point2 | None]:
        """Give who is followed, and their last place: nobody whom the robot keeps clear of."""
        return self.user_id, self.person

    def step(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step: the velocity, the feedback, and the result when the goal is over."""
        contact = self._contact.step(state)
        if isinstance(contact, Result):
            return STANDSTILL, self._feedback(contact.reason), contact
        if contact is not None:
            return contact, self._feedback(self._contact.text), None
        self._retreat_path.remember(state)
        command = self._retreat_path.back_out(state)
        if not command.is_zero():
            self._moved = state.now
            return command, self._feedback("backing out"), None
        self._task.motions.held = False
        move = self._choose(state)
        wanted = self._off_the_person(state, move.command)
        command = state.people.slowed(state.pose, wanted)
        self._back_out_when_stuck(state, wanted, command)
        return command, self._feedback(move.text), move.result

    def _off_the_person(self, state: CycleState, command: Twist2) -> Twist2:
        """Keep the robot from driving towards somebody who is this near."""
        if not self._task.track.is_seen(state.now, _MINDED_S):
            return command
        return keep_off(state.pose, self._task.track.at(state.now), command)

    def _back_out_when_stuck(self, state: CycleState, wanted: Twist2, command: Twist2) -> None:
        """Back out when the robot wants to move and cannot for long: something or somebody is in the way."""
        if not command.is_zero():
            self._moved = state.now
        if not command.is_zero() or (wanted.is_zero() and not self._task.motions.held):
            self._stuck_since = None
        elif self._stuck_since is None:
            self._stuck_since = state.now
        elif state.now - self._stuck_since > _STUCK_S:
            self._stuck_since = None
            self._retreat_path.begin(state.now)

    def _feedback(self, text: str) -> Feedback:
        return Feedback(recoveries=self._contact.back_offs, text=text)
