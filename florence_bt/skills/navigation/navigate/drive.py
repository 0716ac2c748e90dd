"""One drive to one goal: plan, follow, wait, recover, give up. The inside of the navigator."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import STANDSTILL, Pose2, Twist2
from florence_bt.core.outcome import Outcome, Result, failure, success
from florence_bt.skills.navigation.navigate._cell_kernels import INSCRIBED, LETHAL, UNKNOWN_COST
from florence_bt.skills.navigation.navigate.contact import BackUp, ContactRecovery
from florence_bt.skills.navigation.navigate.controller import Control, Controller
from florence_bt.skills.navigation.navigate.costmap import BODIES, CONTACTS, LASER
from florence_bt.skills.navigation.navigate.fine_approach import FineApproach
from florence_bt.skills.navigation.navigate.goal import NavigationGoal
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.planner import Plan, plan_path
from florence_bt.skills.navigation.navigate.recovery import (
    RECOVERY_BEHAVIOURS,
    TRANSITIONS,
    DriveEvent,
    DriveState,
    LostTime,
    ProgressWatch,
    RecoveryBehaviour,
    StuckWatch,
)
from florence_bt.skills.navigation.navigate.spin import Spin
from florence_bt.skills.navigation.navigate.staging import (
    has_room_to_turn,
    is_lined_up,
    staging_pose,
    straight_way_in,
    turning_place,
)
from florence_bt.skills.navigation.navigate.state import Costmaps, CycleState, Feedback
from florence_bt.skills.navigation.navigate.vacated_cells import clear_person

_SURE_S = 60.0
"""Age at which, when no way is left, what was touched, or seen of people who sit or lie, is not believed any
more; nor is a place that was too tight then."""
_RECOVERY_TIME_S = 12.0
_LOOK_FROM_M = 1.6
"""From so far away the robot looks at what seems to stand at its goal, once no wall hides it: nearer the
camera does not see what hangs over."""
_NEAR_M = 1.0
"""From so near the robot sees whether it has room to turn at its goal."""
_LOOKING = "looking at the goal"
TYPICAL_SPEED, TYPICAL_TURN_SPEED = 0.35, 0.5
"""m/s and rad/s, for the time that is left."""


class Drive(NavigationGoal):
    """A drive from its start to its result.

    Args:
        goal: In the map frame.
        costmaps: Where the robot drives.
        parameters: All of navigation.
        now: Seconds.
        precise: Whether it ends within :data:`PRECISE_M` and :data:`PRECISE_RAD` of the goal, or fails.

    Attributes:
        state: Where it stands in the table of :mod:`recovery`.
        path: The path that is followed, shape (n, 2) in the map frame, or None.
        remaining: Metres along it in the last cycle, infinity before the first.
    """

    path: NDArray[np.float64] | None = None

    def __init__(
        self,
        goal: Pose2,
        costmaps: Costmaps,
        parameters: NavigatorParameters,
        now: float,
        *,
        precise: bool = False,
    ) -> None:
        self._goal = goal
        self._costmaps = costmaps
        self._p = parameters
        self._controller = Controller(parameters.controller)
        self._progress = ProgressWatch(parameters.recovery, parameters.recovery.oscillation_timeout)
        self._progress.reset(now)
        self._lost = LostTime(parameters.recovery, now)
        self.state = DriveState.PLANNING
        self._next_plan = now
        self._planned_goal = goal
        self._stage: Pose2 | None = None
        self._beside: Pose2 | None = None
        self._narrow = False
        self._precise = precise
        self._fine: FineApproach | None = None
        self._began = now
        self._stuck = StuckWatch(parameters.recovery)
        self._last_plan = now
        self._last_control = now
        still = f"the robot has not come nearer to the goal for {parameters.recovery.give_up_time:g} s"
        self._trouble = ("no_progress", still)
        self._untried = list(RECOVERY_BEHAVIOURS)
        self._recovery: Spin | BackUp | None = None
        self._recovery_text = ""
        self._came_near = self._looked = False
        turn = parameters.turn
        speed = max(turn.spin_min_speed, parameters.recovery.rotate_speed)
        self._rotation = replace(turn, spin_max_speed=speed)
        self._recoveries = 0
        self._contact = ContactRecovery(costmaps, parameters.recovery)
        self.remaining = math.inf

    def step(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        """Take one step: the velocity, the feedback, and the result when the drive is over."""
        contact = self._contact.step(state)
        if isinstance(contact, Result):
            self._on(DriveEvent.TOUCHED)
            self._on(DriveEvent.HOPELESS)
            return STANDSTILL, self._feedback(state, math.nan, contact.reason), contact
        if contact is not None:
            self._on(DriveEvent.TOUCHED)
            self._recovery = self._fine = None
            self._lost.saw(state.now, math.inf)
            return contact, self._feedback(state, math.nan, self._contact.text), None
        if self.state is DriveState.BACKING_OFF:
            self._on(DriveEvent.BACKED_OFF)
            self._restart(state)
        command, feedback, result = self._work(state)
        self._watch_progress(state)
        if result is None and self._lost.seconds > self._p.recovery.give_up_time:
            self._on(DriveEvent.TIME_OVER)
            result = self._give_up()
        return command if result is None else STANDSTILL, feedback, result

    def resume(self, now: float) -> None:
        """Go on after the robot did not know where it was: nothing of before counts as lost time."""
        self._progress.reset(now)
        self._lost = LostTime(self._p.recovery, now)
        self._last_plan = self._last_control = self._next_plan = now
        self._narrow = self._came_near = self._looked = False
        self._fine = None

    def _on(self, event: DriveEvent) -> None:
        if (self.state, event) != (DriveState.BACKING_OFF, DriveEvent.TOUCHED):
            self.state = TRANSITIONS[self.state, event]

    def _work(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        if self.state is DriveState.CLEARING:
            command = self._run_recovery(state)
            if command is not None:
                return command, self._feedback(state, math.nan, self._recovery_text), None
        if self._fine is not None:
            return self._correct(state, self._fine)
        if state.now >= self._next_plan:
            hopeless = self._plan(state)
            if hopeless is not None:
                return STANDSTILL, self._feedback(state, math.nan, hopeless.reason), hopeless
        if self.state is DriveState.PLANNING:
            return self._without_plan(state)
        return self._follow(state)

    def _watch_progress(self, state: CycleState) -> None:
        """Count the time without progress; with it every recovery behaviour may be tried again."""
        driving = self.state is DriveState.CONTROLLING
        if self._lost.saw(state.now, self.remaining if driving else math.inf):
            self._untried = list(RECOVERY_BEHAVIOURS)

    # Planning.

    def _plan(self, state: CycleState) -> Result | None:
        """Plan again; a result when the goal cannot be reached whatever moves out of the way."""
        self._next_plan = state.now + 1.0 / self._p.cycle.planner_frequency
        here, costmap, zones = state.map_pose, self._costmaps.global_costmap, self._costmaps.zones
        self._costmaps.tight.look()
        forbidden = zones.problem_with(self._goal)
        if forbidden is not None:
            return self._hopeless(failure("goal_occupied", forbidden))
        narrow = self._is_narrow(here)
        self._stage = None
        if narrow and self._plan_to_stage(here):
            self._last_plan = state.now
            return None
        spare = self._p.controller.blocked_xy_tolerance
        plan: Plan | Result | None = straight_way_in(here, self._goal, costmap, spare) if narrow else None
        goal = self._goal
        if plan is None:
            goal = self._turning_place(here, spare) if narrow else goal
            plan = plan_path(costmap, here, goal, self._p.planner, tolerance=self._tolerance(here))
        if isinstance(plan, Result):
            return self._explain(state, plan)
        if plan.goal is not goal:
            there = plan.goal
            plan = replace(
                plan, goal=replace(there, yaw=there.yaw + there.bearing_to(self._goal.x, self._goal.y))
            )
        self._take(plan)
        self._last_plan = state.now
        return None

    def _explain(self, state: CycleState, failed: Result) -> Result | None:
        """Find out why there is no plan: a result when waiting would not help, else what is waited for."""
        here, costmap, zones = state.map_pose, self._costmaps.global_costmap, self._costmaps.zones
        self._trouble = (failed.code, failed.reason)
        for each in (costmap, self._costmaps.local_costmap):
            each.forget([CONTACTS, BODIES], before=state.now - _SURE_S)
        self._costmaps.tight.forget(before=state.now - _SURE_S, of_map=False)
        on_map = plan_path(costmap, here, self._goal, self._p.planner, costs=self._costmaps.static)
        if isinstance(on_map, Result):
            return self._hopeless(on_map)
        if zones.closes_ways:
            allowed = plan_path(costmap, here, self._goal, self._p.planner, costs=zones.permanent)
            if isinstance(allowed, Result):
                return self._hopeless(zones.no_way_to(self._goal))
        self._lose_plan()
        if failed.code == "no_path":
            return self._explain_no_way(here)
        if failed.code == "goal_occupied":
            self._trouble = (failed.code, "something that is not in the map stands at the goal")
            if self._looked:
                self._forget_who_left(state)
        return None

    def _explain_no_way(self, here: Pose2) -> Result | None:
        """Tell what blocks every way: a result when that is a place where the robot did not get through."""
        self._trouble = ("blocked", "something blocks every way to the goal")
        tight = self._costmaps.tight.only_way(here, self._goal, self._p.planner)
        if tight is None:
            return None
        place = f"({tight.pose.x:.2f}, {tight.pose.y:.2f})"
        reason = f"the only way leads through {place}, where {tight.width:.2f} m are too narrow for the robot"
        self._trouble = ("blocked", reason)
        # What the map does not show may go away, while the robot stands before it.
        if tight.on_map or tight.since < self._began:
            return self._hopeless(failure(*self._trouble))
        return None

    def _lose_plan(self) -> None:
        self.path = None
        if self.state is DriveState.CONTROLLING:
            self._on(DriveEvent.PLAN_LOST)

    def _hopeless(self, result: Result) -> Result:
        """End the drive: nothing that could move away is in its way."""
        self._lose_plan()
        self._on(DriveEvent.HOPELESS)
        return result

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
        if self.state is DriveState.PLANNING:
            self._on(DriveEvent.PLAN_FOUND)
        self.path, self._planned_goal = plan.points, plan.goal
        self._controller.set_plan(plan.points, plan.goal)

    def _is_narrow(self, here: Pose2) -> bool:
        """Tell whether the goal has no room to turn; found so from near, it stays so: marks come and go."""
        narrow = self._narrow or not has_room_to_turn(self._goal, self._costmaps.global_costmap)
        self._narrow = narrow and here.distance_to(self._goal) <= _NEAR_M
        return narrow

    def _turning_place(self, here: Pose2, spare: float) -> Pose2:
        """Return the pose at which to turn instead of at the goal, or the goal."""
        if is_lined_up(here, self._goal):
            return self._goal
        costmap = self._costmaps.global_costmap
        if self._beside is None or not has_room_to_turn(self._beside, costmap):
            self._beside = turning_place(self._goal, costmap, spare)
            if self._beside is not None:
                self._controller.start()  # it may have reached the goal already
        return self._beside or self._goal

    def _tolerance(self, here: Pose2) -> float:
        """Return how far from an occupied goal the path may end: what was seen may be gone by now."""
        cost = self._costmaps.global_costmap.cost_at(self._goal.x, self._goal.y)
        near = self._came_near or self._looked or self._sees_goal(here)
        return 0.0 if near or not INSCRIBED <= cost < UNKNOWN_COST else self._p.cycle.goal_search_radius

    def _sees_goal(self, here: Pose2) -> bool:
        """Tell whether the goal is near, with no wall of the map in between."""
        distance, costmap = here.distance_to(self._goal), self._costmaps.global_costmap
        if distance > _LOOK_FROM_M:
            return False
        steps = 2 + math.ceil(2.0 * distance / costmap.resolution)
        between = np.linspace((here.x, here.y), (self._goal.x, self._goal.y), steps)
        return not (costmap.costs_at(between, self._costmaps.static) == LETHAL).any()

    def _without_plan(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        feedback = self._feedback(state, math.nan, f"waiting: {self._trouble[1]}")
        occupied = self._trouble[0] == "goal_occupied"
        if occupied and not self._looked:
            self._look_at_goal(state)
            return STANDSTILL, feedback, None
        params = self._p.recovery
        if state.now - self._last_plan > (params.goal_patience if occupied else params.planner_patience):
            return STANDSTILL, feedback, self._recover(state, DriveEvent.PLANNER_PATIENCE)
        return STANDSTILL, feedback, None

    # Driving.

    def _follow(self, state: CycleState) -> tuple[Twist2, Feedback, Result | None]:
        odom_from_map = state.map_from_odom.inverse()
        control = self._controller.control(
            state.pose,
            state.twist,
            self._costmaps.local_costmap,
            odom_from_map,
            state.clearance,
            state.people.around_goal(odom_from_map @ self._goal),
        )
        self.remaining = control.remaining
        feedback = self._feedback(state, control.remaining, control.text or f"waiting: {control.blocked}")
        if control.reached and self._precise and self._planned_goal in (self._goal, self._beside):
            self._fine = FineApproach(self._goal, state.now)
            self._lost = LostTime(self._p.recovery, state.now)
        elif control.reached:
            return STANDSTILL, feedback, self._arrived()
        return control.command, feedback, self._judge(state, control)

    def _correct(self, state: CycleState, fine: FineApproach) -> tuple[Twist2, Feedback, Result | None]:
        command, result = fine.step(state)
        feedback = self._feedback(state, math.nan, "correcting where it stands")
        if result is not None:
            self._on(DriveEvent.REACHED if result.succeeded else DriveEvent.OFF)
        return command, feedback, result

    def _arrived(self) -> Result | None:
        if self._planned_goal in (self._goal, self._beside):
            self._on(DriveEvent.REACHED)
            return success()
        # This was the nearest free place to an occupied goal, or the place to line up for a narrow one.
        self._came_near = self._stage is None
        self._next_plan = 0.0
        return None

    def _judge(self, state: CycleState, control: Control) -> Result | None:
        """Judge whether the drive goes well; start to recover when it does not."""
        if not control.blocked:
            self._last_control = state.now
            problem = self._progress.problem(state.now, state.pose, control.remaining)
            if problem is None:
                return None
            self._trouble = ("no_progress", problem)
            return self._recover(state, DriveEvent.NO_PROGRESS)
        self._trouble = ("blocked", control.blocked)
        self._narrow |= control.is_narrow
        stuck = control.is_tight and self._stuck.too_long(state.now, state.map_pose)
        if not stuck and state.now - self._last_control <= self._p.recovery.controller_patience:
            return None
        if control.is_tight:
            if self._stuck.recovered and self._close_way(state):
                return None
            self._stuck.note_recovery()
        return self._recover(state, DriveEvent.CONTROLLER_PATIENCE)

    def _close_way(self, state: CycleState) -> bool:
        """Close the way ahead for the planner, as a recovery behaviour has not helped; False if it cannot."""
        local, odom_from_map = self._costmaps.local_costmap, state.map_from_odom.inverse()
        assert self.path is not None
        if not self._costmaps.tight.close(self.path, state.map_pose, local, odom_from_map, state.now):
            return False
        self._stuck.forget()
        self._last_control = self._next_plan = state.now
        return True

    # Recovering.

    def _recover(self, state: CycleState, event: DriveEvent) -> Result | None:
        """Begin the next recovery behaviour; a failure when none could help."""
        if self._trouble[0] == "goal_occupied":
            # It was looked at, and nothing but waiting makes it go away.
            self._on(DriveEvent.OCCUPIED)
            return self._give_up()
        if not self._untried:
            return None  # it waits: people may go away
        self._on(event)
        behaviour = self._next_recovery(state)
        self._recoveries += 1
        self._recovery_text = behaviour.value
        p = self._p.recovery
        if behaviour is RecoveryBehaviour.CONSERVATIVE_RESET:
            self._clear(state, p.conservative_reset_dist)
        elif behaviour is RecoveryBehaviour.AGGRESSIVE_RESET:
            self._clear(state, 4.0 * self._costmaps.local_costmap.footprint.circumscribed_radius)
        elif behaviour is RecoveryBehaviour.CLEARING_ROTATION:
            self._recovery = Spin(p.rotate_angle, self._rotation, state.now, _RECOVERY_TIME_S)
        else:
            self._recovery = BackUp(state, p, _RECOVERY_TIME_S)
        return None

    def _look_at_goal(self, state: CycleState) -> None:
        """Turn to what stands at the goal: it was marked before, and may have gone unseen."""
        self._on(DriveEvent.UNSEEN)
        self._looked, self._recovery_text = True, _LOOKING
        bearing = state.map_pose.bearing_to(self._goal.x, self._goal.y)
        self._recovery = Spin(bearing, self._rotation, state.now, _RECOVERY_TIME_S)

    def _give_up(self) -> Result:
        code, reason = self._trouble
        touched = self._contact.last
        if touched.code:
            return touched.failure(f"{touched.text}, and no way round it was found: {reason}")
        tried = f"{reason}; gave up after {self._all_recoveries} recoveries"
        return failure(code, tried)

    def _next_recovery(self, state: CycleState) -> RecoveryBehaviour:
        """Return the next recovery behaviour; a robot that is wedged in backs out first, if there is room."""
        wedged = self.path is not None and RecoveryBehaviour.BACK_UP in self._untried
        way = self._p.recovery.back_up_distance
        room = state.clearance.is_free(-way, 0.0) and state.driven.covers(state.pose, way / 2.0)
        behaviour = RecoveryBehaviour.BACK_UP if wedged and room else self._untried[0]
        self._untried.remove(behaviour)
        return behaviour

    def _clear(self, state: CycleState, side: float) -> None:
        """Forget what the laser marked outside of a window; what the camera marked goes by looking."""
        costmaps, map_pose = self._costmaps, state.map_pose
        costmaps.local_costmap.reset_outside(state.pose.x, state.pose.y, side, [LASER])
        costmaps.global_costmap.reset_outside(map_pose.x, map_pose.y, side, [LASER])

    def _forget_who_left(self, state: CycleState) -> None:
        """Forget what the camera marked above feet at the goal: a person in view is seen again."""
        in_map = self._goal.x, self._goal.y
        place = state.map_from_odom.inverse().apply(*in_map)
        clear_person(self._costmaps, place, in_map, above_feet=True)

    def _restart(self, state: CycleState, patience_s: float = math.inf) -> None:
        """Count from here on; after a recovery behaviour only the costmaps need some time."""
        p = self._p.recovery
        self._last_plan = state.now - max(0.0, p.planner_patience - patience_s)
        self._last_control = state.now - max(0.0, p.controller_patience - patience_s)
        self._next_plan = state.now
        self._progress.reset(state.now)

    def _run_recovery(self, state: CycleState) -> Twist2 | None:
        """Return the velocity of the recovery behaviour, None when it is over."""
        behaviour = self._recovery
        if isinstance(behaviour, Spin):
            command, _, result = behaviour.step(state)
            over = result is not None
            # A turn that ends because something is near is not a failure of the drive.
            if result is not None and result.outcome is Outcome.FAILED:
                self._recovery_text = result.reason
        else:
            command = STANDSTILL if behaviour is None else behaviour.step(state)
            over = command.is_zero()
        if not over:
            return command
        self._recovery = None
        self._on(DriveEvent.CLEARED)
        # What was looked at may still go away.
        looked = self._recovery_text == _LOOKING
        self._restart(state, math.inf if looked else self._p.recovery.recovery_pause)
        return None

    @property
    def _all_recoveries(self) -> int:
        return self._recoveries + self._contact.back_offs

    def _feedback(self, state: CycleState, remaining: float, text: str) -> Feedback:
        here = state.map_pose
        if math.isnan(remaining):
            remaining = here.distance_to(self._goal)
        turn = abs(math.remainder(self._goal.yaw - here.yaw, math.tau))
        time = remaining / TYPICAL_SPEED + turn / TYPICAL_TURN_SPEED
        return Feedback(remaining, time, self._all_recoveries, text)
