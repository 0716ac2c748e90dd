"""What every goal does that is about a person: recover from contacts, and keep off the person."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Point2, Twist2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate.following.motions import Move
from florence_bt.skills.navigation.navigate.following.path_follower import PathFollower
from florence_bt.skills.navigation.navigate.following.retreat_path import RetreatPath
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.personal_space import keep_off
from florence_bt.skills.navigation.navigate.state import Feedback, RobotState

_MINDED_S = 6.0
"""The robot keeps off the place of a person who was not seen for so long. Chosen."""
_STUCK_S = 1.0
"""When no wanted motion is free for so long, the robot backs out a little."""


class PersonGoal(ABC):
    """A goal about a person, which goes on with what the goal before it knew of them.

    It does the first that applies of: back off from a contact, back out from where it is stuck, what the
    goal is about.
    """

    def __init__(self, task: FollowTask, now: float) -> None:
        self._task = task
        self._contact = task.contact
        self._path_follower = PathFollower(task)
        self._retreat_path = RetreatPath(task)
        self._moved = now
        self._stuck_since: float | None = None

    @abstractmethod
    def _choose(self, state: RobotState) -> Move:
        """Decide what to do in this cycle."""

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
        """Where the person was last, in the odometry frame, metres; None before."""
        return None if self._task.track.seen is None else self._task.track.last

    def step(self, state: RobotState) -> tuple[Twist2, Feedback, Result | None]:
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

    def _off_the_person(self, state: RobotState, command: Twist2) -> Twist2:
        """Keep the robot from driving towards somebody who is this near."""
        if not self._task.track.is_seen(state.now, _MINDED_S):
            return command
        return keep_off(state.pose, self._task.track.at(state.now), command)

    def _back_out_when_stuck(self, state: RobotState, wanted: Twist2, command: Twist2) -> None:
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
