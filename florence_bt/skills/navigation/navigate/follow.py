"""Follow somebody who walks: keep the distance, give way, go to where they vanished. No ROS, no own clock."""

from __future__ import annotations

from florence_bt.core.geometry import STANDSTILL
from florence_bt.core.outcome import failure
from florence_bt.skills.navigation.navigate.following.give_way import GiveWay
from florence_bt.skills.navigation.navigate.following.keep_distance import KeepDistance
from florence_bt.skills.navigation.navigate.following.motions import Move
from florence_bt.skills.navigation.navigate.following.person_goal import PersonGoal
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.following.trail_follower import TrailFollower
from florence_bt.skills.navigation.navigate.following.vanished import Vanished
from florence_bt.skills.navigation.navigate.state import CycleState


class Follow(PersonGoal):
    """Keeps a distance to somebody until they are lost or it is cancelled.

    It does the first that applies of: step aside, keep the distance to who is in sight, go to where they
    vanished. Each has its module in ``following``. The search for who is lost is another goal, and the
    mission's choice.

    Source:
        REFERENCE 12.6; document, section 4.1.
    """

    def __init__(self, task: FollowTask, now: float) -> None:
        super().__init__(task, now)
        path_follower = self._path_follower
        self._trail_follower = TrailFollower(task)
        self._give_way = GiveWay(task, self._retreat_path, path_follower)
        self._keep_distance = KeepDistance(task, self._trail_follower, path_follower, self._give_way, now)
        self._vanished: Vanished | None = None
        self._started = now

    def _choose(self, state: CycleState) -> Move:
        seen = self._task.track.seen
        if seen is None:
            return self._wait_for_person(state)
        if self._give_way.steps_aside:
            return Move(self._give_way.step_aside(state), "stepping aside")
        if self._task.track.is_seen(state.now):
            self._vanished = None
            return self._keep_distance.step(state)
        return self._out_of_sight(state, state.now - seen)

    def _wait_for_person(self, state: CycleState) -> Move:
        over = state.now - self._started > self._task.params.follow_patience
        text = "the tracker does not see the person who is to be followed"
        return Move(STANDSTILL, f"waiting: {text}", failure("user_lost", text) if over else None)

    def _out_of_sight(self, state: CycleState, unseen: float) -> Move:
        self._give_way.nobody_is_too_near()
        if self._vanished is None:
            self._vanished = Vanished(self._task, self._trail_follower, self._path_follower, state.now)
            self._vanished.clear_marks(state)
        lost = failure("user_lost", f"the person has been out of sight for {unseen:.1f} s")
        return self._vanished.step(state, unseen) or Move(STANDSTILL, "lost", lost)
