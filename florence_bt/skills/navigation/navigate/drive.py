"""One drive to one goal: plan, follow, wait, recover, give up. The inside of the navigator."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2
from florence_bt.core.outcome import Outcome, Result, failure, success
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, UNKNOWN_COST, Cells
from florence_bt.skills.navigation.navigate.base_stop import BaseStop
from florence_bt.skills.navigation.navigate.clearance import Clearance, MapWalls
from florence_bt.skills.navigation.navigate.controller import Control, Controller
from florence_bt.skills.navigation.navigate.costmap import Costmap
from florence_bt.skills.navigation.navigate.planner import Plan, plan_path
from florence_bt.skills.navigation.navigate.recovery import REMEDIES, BackUp, ProgressWatch, Remedy
from florence_bt.skills.navigation.navigate.results import SERVER_CODES
from florence_bt.skills.navigation.navigate.staging import staging_pose
from florence_bt.skills.navigation.navigate.step import Feedback, NavigatorParameters
from florence_bt.skills.navigation.navigate.turning import Turn

_REMEDY_TIME_S = 25.0
_GET_OFF_TIME_S = 2.0
"""How long backing off may take to release a bumper, whose travel is a centimetre or two."""
_MOST_BACK_OFFS = 3
"""So often a drive backs off from what only the bumpers feel; then it ends, as it would touch it again."""
_NEAR_GOAL_M = 1.0
_TYPICAL_SPEED, _TYPICAL_TURN_SPEED = 0.35, 0.5


@dataclass(frozen=True, slots=True)
class Site:
    """Where the robot drives.

    Attributes:
        global_costmap: In the map frame.
        local_costmap: In the odometry frame.
        static: Inflated costs of the map alone, on the cells of the global costmap.
        walls: The map's walls.
    """

    global_costmap: Costmap
    local_costmap: Costmap
    static: Cells
    walls: MapWalls


@dataclass(frozen=True, slots=True)
class Moment:
    """The robot now.

    Attributes:
        now: Seconds.
        pose: base_footprint in the odometry frame.
        twist: Its velocity.
        map_from_odom: The place of the odometry frame in the map.
        clearance: What is around it.
        stop: What holds the base.
    """

    now: float
    pose: Pose2
    twist: Twist2
    map_from_odom: Pose2
    clearance: Clearance
    stop: BaseStop

    @property
    def map_pose(self) -> Pose2:
        """base_footprint in the map frame."""
        return self.map_from_odom @ self.pose


class Drive:
    """A drive from its start to its result.

    Attributes:
        path: The path that is followed, shape (n, 2) in the map frame, or None.
    """

    def __init__(self, goal: Pose2, site: Site, parameters: NavigatorParameters, now: float) -> None:
        self._goal = goal
        self._site = site
        self._p = parameters
        self._controller = Controller(parameters.controller, parameters.costmap)
        self._progress = ProgressWatch(parameters.recovery)
        self._progress.reset(now)
        self._next_plan = now
        self._planned_goal = goal
        self._stage: Pose2 | None = None
        self._last_plan = now
        self._last_control = now
        self._trouble = ("blocked", "")
        self._remedies = list(REMEDIES)
        self._remedy: Turn | BackUp | None = None
        self._remedy_text = ""
        self._recoveries = 0
        self._touched_since: float | None = None
        self._back_offs = 0
        self.path: NDArray[np.float64] | None = None

    def step(self, moment: Moment) -> tuple[Twist2, Feedback, Result | None]:
        """One cycle: the velocity, the feedback, and the result when the drive is over."""
        stuck = self._get_off(moment)
        if stuck is not None:
            return STANDSTILL, self._feedback(moment, math.nan, stuck.reason), stuck
        if self._remedy is not None:
            command = self._apply_remedy(moment)
            if command is not None:
                return command, self._feedback(moment, math.nan, self._remedy_text), None
        if moment.now >= self._next_plan:
            hopeless = self._plan(moment)
            if hopeless is not None:
                return STANDSTILL, self._feedback(moment, math.nan, hopeless.reason), hopeless
        if self.path is None:
            return self._without_plan(moment)
        return self._follow(moment)

    # Planning.

    def _plan(self, moment: Moment) -> Result | None:
        """Plan anew; a result when the goal cannot be reached whatever moves out of the way."""
        self._next_plan = moment.now + 1.0 / self._p.cycle.planner_frequency
        here, costmap = moment.map_pose, self._site.global_costmap
        if self._plan_to_stage(here):
            self._last_plan = moment.now
            return None
        plan = plan_path(costmap, here, self._goal, self._p.planner, tolerance=self._tolerance(here))
        if isinstance(plan, Result):
            self._trouble = (plan.code, plan.reason)
            self.path = None
            on_map = plan_path(costmap, here, self._goal, self._p.planner, costs=self._site.static)
            if isinstance(on_map, Result):
                return on_map
            if plan.code == "no_path":
                self._trouble = ("blocked", "something blocks every way to the goal")
            elif plan.code == "goal_occupied":
                self._trouble = (plan.code, "something that is not in the map stands at the goal")
            return None
        self._take(plan)
        self._last_plan = moment.now
        return None

    def _plan_to_stage(self, here: Pose2) -> bool:
        """Plan to the place before a goal that has no room to turn; False when that is not the way to go."""
        self._stage = staging_pose(
            here, self._goal, self._site.global_costmap, self._p.controller.blocked_xy_tolerance
        )
        if self._stage is None:
            return False
        plan = plan_path(self._site.global_costmap, here, self._stage, self._p.planner)
        if isinstance(plan, Result):
            return False
        self._take(plan)
        return True

    def _take(self, plan: Plan) -> None:
        self.path, self._planned_goal = plan.points, plan.goal
        self._controller.set_plan(plan.points, plan.goal)

    def _tolerance(self, here: Pose2) -> float:
        """How far from an occupied goal the path may end: what is seen from afar may be gone on arrival."""
        cost = self._site.global_costmap.cost_at(self._goal.x, self._goal.y)
        occupied = INSCRIBED <= cost < UNKNOWN_COST
        far = here.distance_to(self._goal) > self._p.cycle.goal_search_radius + _NEAR_GOAL_M
        return self._p.cycle.goal_search_radius if occupied and far else 0.0

    def _without_plan(self, moment: Moment) -> tuple[Twist2, Feedback, Result | None]:
        feedback = self._feedback(moment, math.nan, f"waiting: {self._trouble[1]}")
        if moment.now - self._last_plan > self._p.recovery.planner_patience:
            return STANDSTILL, feedback, self._recover(moment)
        return STANDSTILL, feedback, None

    # Driving.

    def _follow(self, moment: Moment) -> tuple[Twist2, Feedback, Result | None]:
        odom_from_map = moment.map_from_odom.inverse()
        control = self._controller.control(
            moment.pose, moment.twist, self._site.local_costmap, odom_from_map, moment.clearance
        )
        feedback = self._feedback(moment, control.remaining, control.text or f"waiting: {control.blocked}")
        if control.reached:
            return STANDSTILL, feedback, self._arrived()
        return control.command, feedback, self._judge(moment, control)

    def _arrived(self) -> Result | None:
        if self._planned_goal is self._goal:
            return success()
        # This was the nearest free place to an occupied goal, or the place to line up for a narrow one.
        self._next_plan = 0.0
        return None

    def _judge(self, moment: Moment, control: Control) -> Result | None:
        """Whether this goes well; starts to recover when it does not."""
        if not control.blocked:
            self._last_control = moment.now
            problem = self._progress.problem(moment.now, moment.pose, control.remaining)
            if problem is None:
                return None
            self._trouble = ("no_progress", problem)
            return self._recover(moment)
        self._trouble = ("blocked", control.blocked)
        if moment.now - self._last_control > self._p.recovery.controller_patience:
            return self._recover(moment)
        return None

    # Recovering.

    def _recover(self, moment: Moment) -> Result | None:
        """Begin the next remedy; a failure when all were tried."""
        if not self._remedies:
            code, reason = self._trouble
            tried = f"{reason}; gave up after {self._recoveries} recoveries"
            return failure(code, tried, server_code=SERVER_CODES[code])
        remedy = self._next_remedy(moment)
        self._recoveries += 1
        self._remedy_text = remedy.value
        p = self._p.recovery
        if remedy is Remedy.CLEAR_FAR:
            self._clear(moment, p.conservative_reset_dist)
        elif remedy is Remedy.CLEAR_NEAR:
            self._clear(moment, 4.0 * self._site.local_costmap.footprint.circumscribed_radius)
        elif remedy is Remedy.ROTATE:
            self._remedy = Turn(p.rotate_angle, self._p.turn, moment.now, _REMEDY_TIME_S)
        else:
            self._remedy = self._back_up(moment)
        self._restart(moment)
        return None

    def _back_up(self, moment: Moment) -> BackUp:
        p = self._p.recovery
        return BackUp(moment.pose, p.back_up_distance, p.back_up_speed, moment.now + _REMEDY_TIME_S)

    def _get_off(self, moment: Moment) -> Result | None:
        """Back off from what holds the base; a failure when that does not help soon."""
        stop = moment.stop
        if not stop.holds_forward:
            self._touched_since = None
            return None
        if self._touched_since is None:
            self._touched_since = moment.now
            if self._back_offs == _MOST_BACK_OFFS:
                return stop.failure(f"{stop.text}, again after backing off {_MOST_BACK_OFFS} times")
            self._back_offs += 1
            self._recoveries += 1
            self._remedy, self._remedy_text = self._back_up(moment), f"backing off: {stop.text}"
        if moment.now - self._touched_since > _GET_OFF_TIME_S:
            return stop.failure(f"{stop.text}, and backing off did not help")
        return None

    def _next_remedy(self, moment: Moment) -> Remedy:
        """The next remedy; a robot that is wedged in backs out first, if there is room."""
        wedged = self.path is not None and Remedy.BACK_UP in self._remedies
        room = moment.clearance.is_free(-self._p.recovery.back_up_distance, 0.0)
        remedy = Remedy.BACK_UP if wedged and room else self._remedies[0]
        self._remedies.remove(remedy)
        return remedy

    def _clear(self, moment: Moment, side: float) -> None:
        site, map_pose = self._site, moment.map_pose
        site.local_costmap.reset_outside(moment.pose.x, moment.pose.y, side)
        site.global_costmap.reset_outside(map_pose.x, map_pose.y, side)

    def _restart(self, moment: Moment) -> None:
        """Count the patience from here on."""
        self._last_plan = self._last_control = moment.now
        self._next_plan = moment.now
        self._progress.reset(moment.now)

    def _apply_remedy(self, moment: Moment) -> Twist2 | None:
        """The velocity of the remedy, None when it is over."""
        remedy = self._remedy
        if isinstance(remedy, Turn):
            command, result = remedy.step(moment.now, moment.pose, moment.twist, moment.clearance)
            over = result is not None
            # A turn that ends because something is near is no failure of the drive.
            if result is not None and result.outcome is Outcome.FAILED:
                self._remedy_text = result.reason
        else:
            assert remedy is not None
            command = remedy.step(moment.now, moment.pose, moment.clearance)
            over = command.is_zero()
        if not over:
            return command
        self._remedy = None
        self._restart(moment)
        return None

    def _feedback(self, moment: Moment, remaining: float, text: str) -> Feedback:
        here = moment.map_pose
        if math.isnan(remaining):
            remaining = here.distance_to(self._goal)
        turn = abs(math.remainder(self._goal.yaw - here.yaw, math.tau))
        time = remaining / _TYPICAL_SPEED + turn / _TYPICAL_TURN_SPEED
        return Feedback(remaining, time, self._recoveries, text)
