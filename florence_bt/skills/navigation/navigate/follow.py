"""Follow somebody who walks: keep track | follow | avoid | recover. No ROS, no clock of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Point2, Pose2, Twist2
from florence_bt.core.outcome import Result, failure
from florence_bt.skills.navigation.navigate.contact import ContactRecovery
from florence_bt.skills.navigation.navigate.following.give_way import GiveWay
from florence_bt.skills.navigation.navigate.following.keep_distance import KeepDistance
from florence_bt.skills.navigation.navigate.following.motions import FollowGoal, Motions, Move
from florence_bt.skills.navigation.navigate.following.path_follower import PathFollower
from florence_bt.skills.navigation.navigate.following.retreat_path import RetreatPath
from florence_bt.skills.navigation.navigate.following.search import Search
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.following.track import PersonTrack
from florence_bt.skills.navigation.navigate.following.trail_follower import TrailFollower
from florence_bt.skills.navigation.navigate.following.vanished import Vanished
from florence_bt.skills.navigation.navigate.legs import LEGS_ALONE_S
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.personal_space import keep_off
from florence_bt.skills.navigation.navigate.state import Costmaps, Feedback, RobotState

_STUCK_S = 1.0
"""When no wanted motion is free for so long, the robot backs out a little."""
_NO_WAY_S = 15.0
"""A search in which the robot cannot move for so long is over."""


class Follow:
    """Keeps a distance to somebody who is told about by :meth:`saw`, until they are lost or it is cancelled.

    It does the first that applies of: back off from a contact, back out from where it is stuck, step aside,
    keep the distance to who is in sight, go to where they vanished, search. Each has its module in
    ``following``.

    Attributes:
        user_id: The persistent id of the person.

    Source:
        REFERENCE 12.6; document, section 4.1.
    """

    def __init__(
        self, goal: FollowGoal, costmaps: Costmaps, parameters: NavigatorParameters, now: float
    ) -> None:
        self.user_id = goal.user_id
        params = parameters.follow
        self._task = task = FollowTask(
            goal, costmaps, parameters, PersonTrack(params, now), Motions(goal, params)
        )
        self._contact = ContactRecovery(costmaps, parameters.recovery)
        self._path_follower = path_follower = PathFollower(task)
        self._retreat_path = RetreatPath(task)
        self._trail_follower = TrailFollower(task)
        self._give_way = GiveWay(task, self._retreat_path, path_follower)
        self._keep_distance = KeepDistance(task, self._trail_follower, path_follower, self._give_way, now)
        self._vanished: Vanished | None = None
        self._search: Search | None = None
        self._started = self._moved = now
        self._stuck_since: float | None = None

    @property
    def path(self) -> NDArray[np.float64] | None:
        """The path that is followed, shape (n, 2) in the map frame, or None."""
        return self._path_follower.path

    @property
    def person(self) -> Point2 | None:
        """Where the person was last, in the odometry frame, metres; None before."""
        return None if self._task.track.seen is None else self._task.track.last

    def saw(self, stamp: float, x: float, y: float) -> None:
        """Note that the person was seen at a place in the odometry frame, metres; ``stamp`` in seconds."""
        self._task.track.saw(stamp, x, y)

    def saw_scan(
        self, stamp: float, unknown: NDArray[np.float64], robot: Pose2, others: Sequence[Point2] = ()
    ) -> None:
        """Go on with the legs in a scan while the camera does not see the person.

        Args:
            stamp: Seconds.
            unknown: Where beams end at nothing of the map, shape (n, 2), in the odometry frame, metres.
            robot: The robot in the odometry frame at that time.
            others: Where other people are, in the odometry frame, metres.
        """
        self._task.track.saw_scan(stamp, unknown, robot, others)

    def step(self, state: RobotState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step: the velocity, the feedback, and the result when the person is lost."""
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
        self._watch_progress(state, wanted, command)
        return command, self._feedback(move.text), move.result

    def _choose(self, state: RobotState) -> Move:
        seen = self._task.track.seen
        if seen is None:
            return self._wait_for_person(state)
        if self._give_way.steps_aside:
            return Move(self._give_way.step_aside(state), "stepping aside")
        self._task.track.check_camera(state.now, state.pose)
        if self._task.track.is_seen(state.now):
            self._vanished = self._search = None
            return self._keep_distance.step(state)
        return self._out_of_sight(state, state.now - seen)

    def _wait_for_person(self, state: RobotState) -> Move:
        over = state.now - self._started > self._task.params.follow_patience
        text = "the tracker does not see the person who is to be followed"
        return Move(STANDSTILL, f"waiting: {text}", _lost(text) if over else None)

    def _out_of_sight(self, state: RobotState, unseen: float) -> Move:
        self._give_way.nobody_is_too_near()
        if self._vanished is None:
            self._vanished = Vanished(self._task, self._trail_follower, self._path_follower, state.now)
            self._vanished.clear_marks(state)
        if unseen > self._task.params.follow_limit:
            return Move(STANDSTILL, "lost", _lost_after(unseen))
        if self._search is None:
            move = self._vanished.step(state, unseen)
            if move is not None:
                return move
            self._search = Search(self._task, self._path_follower, self._retreat_path, state)
            self._moved = state.now
        move = self._search.step(state)
        over = state.now - self._moved > _NO_WAY_S
        return Move(move.command, move.text, _lost_after(unseen)) if over else move

    def _off_the_person(self, state: RobotState, command: Twist2) -> Twist2:
        """Keep the robot from driving towards somebody who is this near."""
        if not self._task.track.is_seen(state.now, LEGS_ALONE_S):
            return command
        return keep_off(state.pose, self._task.track.at(state.now), command)

    def _watch_progress(self, state: RobotState, wanted: Twist2, command: Twist2) -> None:
        """Back out when the robot wants to move and cannot for long: something or somebody is in the way."""
        if not command.is_zero():
            self._moved, self._stuck_since = state.now, None
            return
        if wanted.is_zero() and not self._task.motions.held:
            self._stuck_since = None
        elif self._stuck_since is None:
            self._stuck_since = state.now
        elif state.now - self._stuck_since > _STUCK_S:
            self._stuck_since = None
            self._retreat_path.begin(state.now)

    def _feedback(self, text: str) -> Feedback:
        return Feedback(recoveries=self._contact.back_offs, text=text)


def _lost_after(unseen: float) -> Result:
    return _lost(f"the person has been out of sight for {unseen:.1f} s")


def _lost(reason: str) -> Result:
    return failure("user_lost", reason)
