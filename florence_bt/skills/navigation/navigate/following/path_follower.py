"""Along a planned path: to the person round what is in the way, to step aside, and in a search."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Point2, Pose2, Twist2
from florence_bt.core.outcome import Result
from florence_bt.skills.navigation.navigate._cell_kernels import LETHAL
from florence_bt.skills.navigation.navigate.controller import Controller
from florence_bt.skills.navigation.navigate.costmap import BODIES
from florence_bt.skills.navigation.navigate.following.line_of_sight import PERSON_M
from florence_bt.skills.navigation.navigate.following.task import FollowTask
from florence_bt.skills.navigation.navigate.personal_space import NEAREST_M
from florence_bt.skills.navigation.navigate.planner import plan_path
from florence_bt.skills.navigation.navigate.state import CycleState

_PERIOD_S = 0.5
"""Period of planning a path: the person walks on."""
_FORGET_AFTER_S, _FORGET_M = 2.0, 3.0
"""Without a way for so long, the robot forgets where people stood up to so far away: whoever still stands
there is marked anew. A table's corner that the camera has seen stays until its place is seen free."""


class PathFollower:
    """Plans a path to a place that moves, and drives along it.

    Attributes:
        path: Shape (n, 2), map frame, metres; None when there is none.
        trouble: Why there is no path, or the robot does not drive along it; empty else.
    """

    def __init__(self, task: FollowTask) -> None:
        self._task = task
        self._controller = Controller(task.parameters.controller)
        self._next_plan = -math.inf
        self._no_way_since: float | None = None
        self.path: NDArray[np.float64] | None = None
        self.trouble = ""

    def forget(self) -> None:
        """Forget the path, which is not needed any more."""
        self.path = None
        self.plan_anew()

    def plan_anew(self) -> None:
        """Plan anew at once: the next path leads to another place."""
        self._next_plan = -math.inf

    def drive(self, state: CycleState, place: Point2, person: Point2 | None = None) -> tuple[Twist2, float]:
        """Return the velocity, standstill without a path, and the metres that are left, infinite without one.

        Args:
            state: Of this moment.
            place: Where to, odometry frame, metres. What is marked round it counts for nothing: a person.
            person: In place of that, who is kept away from, odometry frame, metres.
        """
        if state.now >= self._next_plan:
            self._next_plan = state.now + _PERIOD_S
            self._plan(state, place, person)
        if self.path is None:
            return STANDSTILL, math.inf
        odom_from_map, costmap = state.map_from_odom.inverse(), self._task.costmaps.local_costmap
        control = self._controller.control(
            state.pose, state.twist, costmap, odom_from_map, state.clearance, state.people
        )
        self.trouble = control.blocked
        self._task.motions.held = bool(control.blocked)
        goal = self._task.goal
        return control.command.slowed_to(goal.max_linear, goal.max_angular), control.remaining

    def _plan(self, state: CycleState, place: Point2, person: Point2 | None) -> None:
        here, there = state.map_pose, state.map_from_odom @ Pose2(*place)
        goal = Pose2(there.x, there.y, math.atan2(there.y - here.y, there.x - here.x))
        costs = self._costs_without(there) if person is None else self._costs_round(state, person)
        costmap, parameters = self._task.costmaps.global_costmap, self._task.parameters.planner
        plan = plan_path(costmap, here, goal, parameters, tolerance=PERSON_M, costs=costs)
        if isinstance(plan, Result):
            self.path, self.trouble = None, plan.reason
            self._forget_marks(state)
            return
        self.path, self._no_way_since = plan.points, None
        self._controller.set_plan(plan.points, plan.goal)

    def _forget_marks(self, state: CycleState) -> None:
        """Forget where people stood nearby when there has been no way for long: they have walked on."""
        self._no_way_since = self._no_way_since or state.now
        if state.now - self._no_way_since < _FORGET_AFTER_S:
            return
        self._no_way_since = None
        costmaps = self._task.costmaps
        for costmap, here in (costmaps.global_costmap, state.map_pose), (costmaps.local_costmap, state.pose):
            costmap.clear_disc((BODIES,), (here.x, here.y), _FORGET_M)

    def _costs_without(self, person: Pose2) -> NDArray[np.uint8]:
        """Return the costs of the global costmap; round the person (map frame) those of the map alone."""
        costmap = self._task.costmaps.global_costmap
        costs, near = costmap.master.copy(), costmap.distances_to(person.x, person.y) <= PERSON_M
        costs[near] = self._task.costmaps.static[near]
        return costs

    def _costs_round(self, state: CycleState, person: Point2) -> NDArray[np.uint8]:
        """Return the global costmap's costs; no way leads nearer to the person than allowed."""
        costmap, here = self._task.costmaps.global_costmap, state.map_pose
        in_map = state.map_from_odom.apply(*person)
        costs, away = costmap.master.copy(), costmap.distances_to(*in_map)
        costs[(away <= NEAREST_M) & (away < math.dist(in_map, (here.x, here.y)))] = LETHAL
        return costs
