"""One drive to one goal: plan, follow, wait, recover, give up. The inside of the navigator."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2, normalize_angle
from florence_bt.core.limits import NotNegative, Positive, check_limits
from florence_bt.core.outcome import Outcome, Result, failure, success
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, UNKNOWN_COST, Cells
from florence_bt.skills.navigation.navigate.clearance import Clearance, MapWalls
from florence_bt.skills.navigation.navigate.controller import Control, Controller, ControllerParameters
from florence_bt.skills.navigation.navigate.costmap import Costmap, CostmapParameters
from florence_bt.skills.navigation.navigate.planner import Plan, PlannerParameters, plan_path
from florence_bt.skills.navigation.navigate.results import SERVER_CODES, BaseStop
from florence_bt.skills.navigation.navigate.spin import Spin, SpinParameters
from florence_bt.skills.navigation.navigate.staging import staging_pose


class RecoveryBehaviour(enum.Enum):
    """One thing to try."""

    CLEAR_FAR = "forgetting obstacles that are far away"
    ROTATE = "looking around"
    CLEAR_NEAR = "forgetting obstacles that are not close"
    BACK_UP = "backing up"


RECOVERY_BEHAVIOURS = (
    RecoveryBehaviour.CLEAR_FAR,
    RecoveryBehaviour.ROTATE,
    RecoveryBehaviour.CLEAR_NEAR,
    RecoveryBehaviour.BACK_UP,
    RecoveryBehaviour.ROTATE,
)
"""In this order, each followed by a new attempt (REFERENCE 7.3; backing up comes from Nav2, 7.9). What
is close is never forgotten: the Kinect cannot see it again from here."""


@dataclass(frozen=True, slots=True)
class RecoveryParameters:
    """When to recover, and how.

    Attributes:
        planner_patience: Seconds without a plan before recovering.
        controller_patience: Seconds without a velocity before recovering.
        conservative_reset_dist: Side of the window around the robot whose obstacles are kept, in metres.
        rotate_angle: How far to look around, in radians.
        back_up_distance: Metres.
        back_up_speed: m/s.
        required_movement_radius: The robot must move this far (m) ...
        required_movement_angle: ... or turn this far (rad) ...
        movement_time_allowance: ... in this many seconds.
        approach_time_allowance: It must get nearer to the goal than ever before in this many seconds.

    Source:
        REFERENCE 7.1, 7.3, 7.9.
    """

    planner_patience: Positive = 5.0
    controller_patience: Positive = 3.0
    conservative_reset_dist: Positive = 3.0
    rotate_angle: Positive = math.tau
    back_up_distance: Positive = 0.15
    back_up_speed: Positive = 0.08
    required_movement_radius: Positive = 0.25
    required_movement_angle: Positive = 0.5
    movement_time_allowance: Positive = 10.0
    approach_time_allowance: Positive = 40.0

    def __post_init__(self) -> None:
        check_limits(self)


class BackUp:
    """Drive straight back a little."""

    def __init__(self, start: Pose2, distance: float, speed: float, deadline: float) -> None:
        self._start = start
        self._distance = distance
        self._speed = speed
        self._deadline = deadline

    def step(self, now: float, pose: Pose2, clearance: Clearance) -> Twist2:
        """The velocity of this moment; standstill when it is over or something is behind the robot."""
        left = self._distance - self._start.distance_to(pose)
        if left <= 0.01 or now > self._deadline or not clearance.is_free(-min(left + 0.05, 0.15), 0.0):
            return STANDSTILL
        return Twist2(-self._speed, 0.0)


class ProgressWatch:
    """Whether the robot moves, and gets nearer to its goal."""

    def __init__(self, parameters: RecoveryParameters) -> None:
        self._p = parameters
        self._anchor: Pose2 | None = None
        self._anchor_time = 0.0
        self._least = math.inf
        self._least_time = 0.0

    def reset(self, now: float) -> None:
        """Start counting again."""
        self._anchor = None
        self._least, self._least_time = math.inf, now

    def problem(self, now: float, pose: Pose2, remaining: float) -> str | None:
        """Why this does not count as progress, None when it does.

        Args:
            now: Seconds.
            pose: The robot, in the odometry frame.
            remaining: Metres left along the path.
        """
        p = self._p
        anchor = self._anchor
        if (
            anchor is None
            or anchor.distance_to(pose) >= p.required_movement_radius
            or abs(normalize_angle(pose.yaw - anchor.yaw)) >= p.required_movement_angle
        ):
            self._anchor, self._anchor_time = pose, now
        if remaining < self._least - 0.1:
            self._least, self._least_time = remaining, now
        if now - self._anchor_time > p.movement_time_allowance:
            return f"the robot has not moved for {p.movement_time_allowance:g} s"
        if now - self._least_time > p.approach_time_allowance:
            return f"the robot has not come nearer to the goal for {p.approach_time_allowance:g} s"
        return None


@dataclass(frozen=True, slots=True)
class CycleParameters:
    """The rhythm of navigation.

    Attributes:
        controller_frequency: Hz, how often ``step`` is called while a goal is active.
        planner_frequency: Hz, how often the path is planned again.
        sensor_timeout: Older scans, odometry and places in the map stop the robot, in seconds.
        scan_timeout: When no scan of a required sensor has come for so many seconds, the robot stops. It
            stands within this time and that of braking, 0.25 s + 0.45 m/s / 2.5 m/s^2 = 0.43 s. The laser
            scans every 0.1 s.
        sensor_patience: Without them for this many seconds, the goal fails.
        required_sources: The sensors without which the robot does not move.
        goal_search_radius: When something stands on a goal that is far away, drive to within this many
            metres of it and look again.
        prediction_limit: Odometry is carried forward with its velocity for at most this long, in seconds.
    """

    controller_frequency: Positive = 10.0
    planner_frequency: Positive = 1.0
    sensor_timeout: Positive = 1.0
    scan_timeout: Positive = 0.25
    sensor_patience: Positive = 10.0
    required_sources: tuple[str, ...] = ("scan",)
    goal_search_radius: NotNegative = 1.5
    prediction_limit: NotNegative = 0.2

    def __post_init__(self) -> None:
        check_limits(self)


@dataclass(frozen=True, slots=True)
class NavigatorParameters:
    """All parameters of navigation."""

    cycle: CycleParameters = field(default_factory=CycleParameters)
    costmap: CostmapParameters = field(default_factory=CostmapParameters)
    planner: PlannerParameters = field(default_factory=PlannerParameters)
    controller: ControllerParameters = field(default_factory=ControllerParameters)
    recovery: RecoveryParameters = field(default_factory=RecoveryParameters)
    turn: SpinParameters = field(default_factory=SpinParameters)

    @staticmethod
    def read(read: Callable[[type[Any]], Any]) -> NavigatorParameters:
        """Fill every part with one reader of parameter dataclasses; all names are different."""
        return NavigatorParameters(
            cycle=read(CycleParameters),
            costmap=read(CostmapParameters),
            planner=read(PlannerParameters),
            controller=read(ControllerParameters),
            recovery=read(RecoveryParameters),
            turn=read(SpinParameters),
        )


@dataclass(frozen=True, slots=True)
class Feedback:
    """How far a goal is.

    Attributes:
        distance_remaining: Metres along the path; for a turn the radians that are left.
        time_remaining: Seconds, a rough estimate.
        recoveries: How often the robot had to recover.
        text: What it does, for people; steady while nothing new happens.
    """

    distance_remaining: float = 0.0
    time_remaining: float = 0.0
    recoveries: int = 0
    text: str = ""


@dataclass(frozen=True, slots=True)
class CycleResult:
    """The answer of one cycle.

    Attributes:
        command: The velocity to send; None when navigation has nothing to say.
        feedback: How far the goal is.
        result: How the goal ended, in its last cycle only; that cycle's command is standstill.
    """

    command: Twist2 | None
    feedback: Feedback
    result: Result | None = None


_BEHAVIOUR_TIME_S = 25.0
_GET_OFF_TIME_S = 2.0
"""How long backing off may take to release a bumper, whose travel is a centimetre or two."""
_MOST_BACK_OFFS = 3
"""So often a drive backs off from what only the bumpers feel; then it ends, as it would touch it again."""
_NEAR_GOAL_M = 1.0
_TYPICAL_SPEED, _TYPICAL_TURN_SPEED = 0.35, 0.5


@dataclass(frozen=True, slots=True)
class Costmaps:
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
class RobotState:
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

    def __init__(self, goal: Pose2, costmaps: Costmaps, parameters: NavigatorParameters, now: float) -> None:
        self._goal = goal
        self._costmaps = costmaps
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
        self._untried = list(RECOVERY_BEHAVIOURS)
        self._behaviour: Spin | BackUp | None = None
        self._behaviour_text = ""
        self._recoveries = 0
        self._touched_since: float | None = None
        self._back_offs = 0
        self._contact: tuple[Pose2, Pose2] | None = None
        self._touched = BaseStop()
        self.path: NDArray[np.float64] | None = None

    def step(self, state: RobotState) -> tuple[Twist2, Feedback, Result | None]:
        """One cycle: the velocity, the feedback, and the result when the drive is over."""
        stuck = self._get_off(state)
        if stuck is not None:
            return STANDSTILL, self._feedback(state, math.nan, stuck.reason), stuck
        if self._behaviour is not None:
            command = self._run_behaviour(state)
            if command is not None:
                return command, self._feedback(state, math.nan, self._behaviour_text), None
        if state.now >= self._next_plan:
            hopeless = self._plan(state)
            if hopeless is not None:
                return STANDSTILL, self._feedback(state, math.nan, hopeless.reason), hopeless
        if self.path is None:
            return self._without_plan(state)
        return self._follow(state)

    # Planning.

    def _plan(self, state: RobotState) -> Result | None:
        """Plan again; a result when the goal cannot be reached whatever moves out of the way."""
        self._next_plan = state.now + 1.0 / self._p.cycle.planner_frequency
        here, costmap = state.map_pose, self._costmaps.global_costmap
        if self._plan_to_stage(here):
            self._last_plan = state.now
            return None
        plan = plan_path(costmap, here, self._goal, self._p.planner, tolerance=self._tolerance(here))
        if isinstance(plan, Result):
            self._trouble = (plan.code, plan.reason)
            self.path = None
            on_map = plan_path(costmap, here, self._goal, self._p.planner, costs=self._costmaps.static)
            if isinstance(on_map, Result):
                return on_map
            if plan.code == "no_path":
                self._trouble = ("blocked", "something blocks every way to the goal")
            elif plan.code == "goal_occupied":
                self._trouble = (plan.code, "something that is not in the map stands at the goal")
            return None
        self._take(plan)
        self._last_plan = state.now
        return None

    def _plan_to_stage(self, here: Pose2) -> bool:
        """Plan to the place before a goal that has no room to turn; False when that is not the way to go."""
        self._stage = staging_pose(
            here, self._goal, self._costmaps.global_costmap, self._p.controller.blocked_xy_tolerance
        )
        if self._stage is None:
            return False
        plan = plan_path(self._costmaps.global_costmap, here, self._stage, self._p.planner)
        if isinstance(plan, Result):
            return False
        self._take(plan)
        return True

    def _take(self, plan: Plan) -> None:
        self.path, self._planned_goal = plan.points, plan.goal
        self._controller.set_plan(plan.points, plan.goal)

    def _tolerance(self, here: Pose2) -> float:
        """How far from an occupied goal the path may end: what is seen from afar may be gone on arrival."""
        cost = self._costmaps.global_costmap.cost_at(self._goal.x, self._goal.y)
        occupied = INSCRIBED <= cost < UNKNOWN_COST
        far = here.distance_to(self._goal) > self._p.cycle.goal_search_radius + _NEAR_GOAL_M
        return self._p.cycle.goal_search_radius if occupied and far else 0.0

    def _without_plan(self, state: RobotState) -> tuple[Twist2, Feedback, Result | None]:
        feedback = self._feedback(state, math.nan, f"waiting: {self._trouble[1]}")
        if state.now - self._last_plan > self._p.recovery.planner_patience:
            return STANDSTILL, feedback, self._recover(state)
        return STANDSTILL, feedback, None

    # Driving.

    def _follow(self, state: RobotState) -> tuple[Twist2, Feedback, Result | None]:
        odom_from_map = state.map_from_odom.inverse()
        control = self._controller.control(
            state.pose, state.twist, self._costmaps.local_costmap, odom_from_map, state.clearance
        )
        feedback = self._feedback(state, control.remaining, control.text or f"waiting: {control.blocked}")
        if control.reached:
            return STANDSTILL, feedback, self._arrived()
        return control.command, feedback, self._judge(state, control)

    def _arrived(self) -> Result | None:
        if self._planned_goal is self._goal:
            return success()
        # This was the nearest free place to an occupied goal, or the place to line up for a narrow one.
        self._next_plan = 0.0
        return None

    def _judge(self, state: RobotState, control: Control) -> Result | None:
        """Whether this goes well; starts to recover when it does not."""
        if not control.blocked:
            self._last_control = state.now
            problem = self._progress.problem(state.now, state.pose, control.remaining)
            if problem is None:
                return None
            self._trouble = ("no_progress", problem)
            return self._recover(state)
        self._trouble = ("blocked", control.blocked)
        if state.now - self._last_control > self._p.recovery.controller_patience:
            return self._recover(state)
        return None

    # Recovering.

    def _recover(self, state: RobotState) -> Result | None:
        """Begin the next behaviour; a failure when all were tried."""
        if not self._untried:
            code, reason = self._trouble
            if self._touched.code:
                return self._touched.failure(f"{self._touched.text}, and no way round it was found: {reason}")
            tried = f"{reason}; gave up after {self._recoveries} recoveries"
            return failure(code, tried, server_code=SERVER_CODES[code])
        behaviour = self._next_behaviour(state)
        self._recoveries += 1
        self._behaviour_text = behaviour.value
        p = self._p.recovery
        if behaviour is RecoveryBehaviour.CLEAR_FAR:
            self._clear(state, p.conservative_reset_dist)
        elif behaviour is RecoveryBehaviour.CLEAR_NEAR:
            self._clear(state, 4.0 * self._costmaps.local_costmap.footprint.circumscribed_radius)
        elif behaviour is RecoveryBehaviour.ROTATE:
            self._behaviour = Spin(p.rotate_angle, self._p.turn, state.now, _BEHAVIOUR_TIME_S)
        else:
            self._behaviour = self._back_up(state)
        self._restart(state)
        return None

    def _back_up(self, state: RobotState) -> BackUp:
        p = self._p.recovery
        return BackUp(state.pose, p.back_up_distance, p.back_up_speed, state.now + _BEHAVIOUR_TIME_S)

    def _get_off(self, state: RobotState) -> Result | None:
        """Back off from what holds the base; a failure when that does not help soon."""
        stop = state.stop
        if not stop.holds_forward:
            self._touched_since = None
            return None
        if self._touched_since is None:
            self._touched_since = state.now
            if self._back_offs == _MOST_BACK_OFFS:
                return stop.failure(f"{stop.text}, again after backing off {_MOST_BACK_OFFS} times")
            self._back_offs += 1
            self._recoveries += 1
            self._contact, self._touched = (state.pose, state.map_pose), stop
            self._behaviour, self._behaviour_text = self._back_up(state), f"backing off: {stop.text}"
        if state.now - self._touched_since > _GET_OFF_TIME_S:
            return stop.failure(f"{stop.text}, and backing off did not help")
        return None

    def _next_behaviour(self, state: RobotState) -> RecoveryBehaviour:
        """The next behaviour; a robot that is wedged in backs out first, if there is room."""
        wedged = self.path is not None and RecoveryBehaviour.BACK_UP in self._untried
        room = state.clearance.is_free(-self._p.recovery.back_up_distance, 0.0)
        behaviour = RecoveryBehaviour.BACK_UP if wedged and room else self._untried[0]
        self._untried.remove(behaviour)
        return behaviour

    def _clear(self, state: RobotState, side: float) -> None:
        costmaps, map_pose = self._costmaps, state.map_pose
        costmaps.local_costmap.reset_outside(state.pose.x, state.pose.y, side)
        costmaps.global_costmap.reset_outside(map_pose.x, map_pose.y, side)

    def _restart(self, state: RobotState) -> None:
        """Count the patience from here on."""
        self._last_plan = self._last_control = state.now
        self._next_plan = state.now
        self._progress.reset(state.now)

    def _run_behaviour(self, state: RobotState) -> Twist2 | None:
        """The velocity of the behaviour, None when it is over."""
        behaviour = self._behaviour
        if isinstance(behaviour, Spin):
            command, result = behaviour.step(state.now, state.pose, state.twist, state.clearance)
            over = result is not None
            # A turn that ends because something is near is not a failure of the drive.
            if result is not None and result.outcome is Outcome.FAILED:
                self._behaviour_text = result.reason
        else:
            assert behaviour is not None
            command = behaviour.step(state.now, state.pose, state.clearance)
            over = command.is_zero()
        if not over:
            return command
        self._behaviour = None
        self._mark_contact(state)
        self._restart(state)
        return None

    def _mark_contact(self, state: RobotState) -> None:
        """Mark what was touched, once the robot has backed off: the next path goes round it."""
        if self._contact is None or state.stop.holds_forward:
            return
        odom_pose, map_pose = self._contact
        self._contact = None
        self._costmaps.local_costmap.add_contact(odom_pose, state.now)
        self._costmaps.global_costmap.add_contact(map_pose, state.now)

    def _feedback(self, state: RobotState, remaining: float, text: str) -> Feedback:
        here = state.map_pose
        if math.isnan(remaining):
            remaining = here.distance_to(self._goal)
        turn = abs(math.remainder(self._goal.yaw - here.yaw, math.tau))
        time = remaining / _TYPICAL_SPEED + turn / _TYPICAL_TURN_SPEED
        return Feedback(remaining, time, self._recoveries, text)
