"""Navigation as a component: scans, odometry, people, zones and goals in; velocities, plans and costmaps out.

Source: document, sections 3.3 and 3.4; REFERENCE 7.2, 7.3 and 7.9.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from florence_bt.core import topic_names
from florence_bt.core.base_stop import BaseStop
from florence_bt.core.clock import Timer, call_every
from florence_bt.core.geometry import STANDSTILL, FramedPath, FramedPose, Pose2, Twist2
from florence_bt.core.limits import CheckedParameters, NotNegative, Positive
from florence_bt.core.outcome import Outcome, Result, cancelled, failure
from florence_bt.core.ports import Action, Delivery, Fields, Goals, NoFields, Output, Ports, Service, Topic
from florence_bt.core.sensing import LaserScan, OccupancyGrid, Odometry
from florence_bt.core.topic_names import MANUAL_OVERRIDE
from florence_bt.core.topics import BASE_STOP, GLOBAL_COSTMAP, MAP, ODOMETRY, ZONES
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.core.zones import Zone
from florence_bt.skills.navigation.localisation.scan_queue import ScanQueue
from florence_bt.skills.navigation.navigate.bindings import SPEED_LIMIT as SPEED_LIMIT_TOPIC
from florence_bt.skills.navigation.navigate.costmap import BODIES, Costmap
from florence_bt.skills.navigation.navigate.drive_actions import (
    DRIVE_ACTIONS,
    NAVIGATE_TO_POSE,
    DriveAction,
)
from florence_bt.skills.navigation.navigate.navigator import FEET, Navigator
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.navigation.navigate.people_frames import see_people
from florence_bt.skills.navigation.navigate.planner import Plan
from florence_bt.skills.navigation.navigate.results import NO_MAP, NO_POSE, PLAN_SERVER_CODES
from florence_bt.skills.navigation.navigate.state import CycleResult

_FEEDBACK_PERIOD_S = 0.5
"""Period of the feedback of a goal. Chosen."""
_JUST_AFTER_S = 0.001
"""A look at that moment itself would find the scan still new. Chosen."""
_PREEMPTED = "preempted by a newer goal"
OVERRIDDEN = "the manual override is on; release it first: florence release"


@dataclass(frozen=True, slots=True)
class NavigationParameters(CheckedParameters):
    """Frames and periods of navigation.

    Attributes:
        map_frame: The map's frame.
        odom_frame: The odometry's frame.
        base_frame: The robot's frame.
        active_scan_period: Seconds between two scans that reach the costmaps while a goal is active.
        idle_scan_period: The same while the robot has nothing to do, seconds.
        costmap_publish_period: Seconds between two costmaps that are published for viewers.
    """

    map_frame: str = "map"
    odom_frame: str = "odom"
    base_frame: str = "base_footprint"
    active_scan_period: NotNegative = 0.1
    idle_scan_period: NotNegative = 0.5
    costmap_publish_period: Positive = 1.0


@dataclass(frozen=True, slots=True)
class ClearRequest:
    """The request of ``nav2_msgs/ClearCostmapAroundRobot`` and ``ClearCostmapExceptRegion``, metres."""

    reset_distance: float


@dataclass(frozen=True, slots=True)
class FrontierRequest:
    """The request of ``florence_interfaces/GetFrontier``."""

    number: int


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """The request of ``nav_msgs/GetPlan``."""

    start: FramedPose
    goal: FramedPose
    tolerance: float = 0.0


@dataclass(frozen=True, slots=True)
class PlanGoal:
    """A goal of ``nav2_msgs/ComputePathToPose``."""

    goal: FramedPose
    use_start: bool = False
    start: FramedPose | None = None


SCANS = {
    topic_names.FILTERED_SCAN: "scan",
    topic_names.FILTERED_KINECT_SCAN: "depth",
    topic_names.FILTERED_KINECT_LOW_SCAN: "low",
    topic_names.FILTERED_KINECT_OVERHANG_SCAN: "overhangs",
    topic_names.PEOPLE_SCAN: BODIES,
    topic_names.FILTERED_LASER_SCAN: FEET,
}
"""Topic -> source of the costmaps."""
OVERRIDE = Topic(MANUAL_OVERRIDE, bool, Delivery.LATCHED)
SPEED_LIMIT = Topic(SPEED_LIMIT_TOPIC, float)
VELOCITY = Topic(topic_names.CMD_VEL, Twist2)
PLAN = Topic(topic_names.PLAN, FramedPath, interface="nav_msgs/msg/Path")
CURRENT_GOAL = Topic("~/current_goal", FramedPose, Delivery.LATCHED, "geometry_msgs/msg/PoseStamped")
LOCAL_COSTMAP = Topic(topic_names.LOCAL_COSTMAP, OccupancyGrid, Delivery.LATCHED)
COMPUTE_PATH = Action(
    "compute_path_to_pose",
    "nav2_msgs/action/ComputePathToPose",
    PlanGoal,
    PLAN_SERVER_CODES["bad_input"],
)
CLEARINGS = (
    ("entirely", "ClearEntireCostmap", NoFields),
    ("except", "ClearCostmapExceptRegion", ClearRequest),
    ("around", "ClearCostmapAroundRobot", ClearRequest),
)
"""The services that clear a costmap: part of their names, types, requests."""


class Navigation:
    """Serves goals one at a time; works only while one is active.

    Args:
        ports: Its connections.
        settings: Of the navigator.
        parameters: Its own.
    """

    def __init__(self, ports: Ports, settings: NavigatorParameters, parameters: NavigationParameters) -> None:
        self._ports, self._settings, self._p = ports, settings, parameters
        self._navigator: Navigator | None = None
        self._map_work: OccupancyGrid | None = None
        self._held_goal: Callable[[], None] | None = None
        self._held_plan: Callable[[], None] | None = None
        self._base_stop = BaseStop()
        self._speed_limit = 0.0
        self._zones: tuple[Zone, ...] = ()
        self._queue = ScanQueue()
        self._taken: dict[str, float] = {}
        self._cycle: Timer | None = None
        self._overdue: Timer | None = None
        self._owner: DriveAction | None = None
        self._started = 0.0
        self._next_feedback = 0.0
        self._shown_plan: NDArray[np.float64] | None = None
        self._plan_viewers = 0
        self._shows_goal = False
        self._overridden = False
        self._person = 0.0, 0.0
        ports.on_time_jump(self._forget_readings)
        self._frames = ports.listen_to_frames()
        self._publish()
        self._listen()
        self._goals = {action: self._serve(action) for action in DRIVE_ACTIONS}
        self._plans = ports.serve_goals(COMPUTE_PATH, self._begin_plan, self._cancel_plan)
        self._serve_services()
        call_every(ports.clock, self._p.costmap_publish_period, self._show_costmaps)

    def _publish(self) -> None:
        ports = self._ports
        self._velocity = ports.output(VELOCITY)
        self._path = ports.output(PLAN)
        self._current_goal = ports.output(CURRENT_GOAL)
        self._global = ports.output(GLOBAL_COSTMAP)
        self._local = ports.output(LOCAL_COSTMAP)

    def _listen(self) -> None:
        ports = self._ports
        ports.listen(MAP, self._take_map)
        ports.listen(ODOMETRY, self._take_odometry)
        ports.listen(BASE_STOP, self._take_base_stop)
        for name, source in SCANS.items():
            ports.listen(Topic(name, LaserScan, Delivery.SENSOR), partial(self._take_scan, source))
        ports.listen(OVERRIDE, self._take_override)
        ports.listen(SPEED_LIMIT, self._take_speed_limit)
        ports.listen(ZONES, self._take_zones)

    def _serve(self, action: DriveAction) -> Goals:
        return self._ports.serve_goals(action.port, partial(self._take_goal, action), self._cancel)

    def _serve_services(self) -> None:
        ports = self._ports
        ports.serve(Service("~/clear_costmaps", "std_srvs/srv/Empty"), self._clear)
        ports.serve(Service("~/clear_unknown_space", "std_srvs/srv/Empty"), self._clear_unknown)
        ports.serve(Service("~/make_plan", "nav_msgs/srv/GetPlan", PlanRequest), self._make_plan)
        frontier = Service("~/get_frontier", "florence_interfaces/srv/GetFrontier", FrontierRequest)
        ports.serve(frontier, self._get_frontier)
        for which in ("global", "local"):
            for name, kind, request in CLEARINGS:
                service = f"{which}_costmap/clear_{name}_{which}_costmap"
                ports.serve(
                    Service(service, f"nav2_msgs/srv/{kind}", request),
                    partial(self._clear_one, which, name),
                )

    def close(self) -> None:
        """Stop the robot."""
        if self._cycle is not None:
            self._velocity.send(STANDSTILL)
            self._stop_cycle()
        self._show_no_drive()

    def fail(self, reason: str) -> None:
        """Stop the robot and end the goal, which cannot be trusted to go on well."""
        if self._cycle is not None or self._held_goal is not None:
            self._abandon(failure("server_failed", reason))

    def _forget_readings(self) -> None:
        """Forget readings, as the clock has jumped: what was on its way may have a useless stamp."""
        self._queue.clear()
        self._taken.clear()

    # What is heard.

    @property
    def navigator(self) -> Navigator | None:
        """Give what drives; None before a map has come and its costmaps are made, when goals are refused."""
        return self._navigator

    @property
    def makes_costmaps(self) -> bool:
        """Tell whether the costmaps of a map that has come are being made: goals are held."""
        return self._map_work is not None

    @property
    def active(self) -> bool:
        """Tell whether something is being driven."""
        return self._cycle is not None

    def _take_map(self, grid: OccupancyGrid) -> None:
        """Make the costmaps beside the rest: on a big map that takes seconds. Goals are held meanwhile.

        A map that grows goes into those that are there: it has the size of a home, and the goal goes on.
        """
        if self._navigator is not None and self._settings.exploration.map_grows:
            self._navigator.replace_map(grid)
            return
        if self._navigator is not None and self._navigator.active:
            self._abandon(failure("no_path", "the map was replaced"))
        self._map_work = grid
        self._ports.work(lambda: Navigator(grid, self._settings), partial(self._use_map, grid))

    def _use_map(self, grid: OccupancyGrid, made: Navigator) -> None:
        if grid is not self._map_work:
            return  # a newer map has come meanwhile
        self._map_work = None
        self._navigator = made
        made.base_stop = self._base_stop
        made.speed_limit = self._speed_limit
        made.set_zones(self._zones)
        goal, plan = self._held_goal, self._held_plan
        self._held_goal = self._held_plan = None
        for begin in (goal, plan):
            if begin is not None:
                begin()

    def _take_speed_limit(self, limit: float) -> None:
        self._speed_limit = max(0.0, limit)
        if self._navigator is not None:
            self._navigator.speed_limit = self._speed_limit

    def _take_zones(self, zones: tuple[Zone, ...]) -> None:
        self._zones = zones
        if self._navigator is not None:
            self._navigator.set_zones(self._zones)

    def _take_override(self, overridden: bool) -> None:
        self._overridden = overridden
        if self._overridden and self._owner is not None:
            self._abandon(failure("rejected", OVERRIDDEN))

    def _take_scan(self, source: str, scan: LaserScan) -> None:
        period = self._p.idle_scan_period if self._cycle is None else self._p.active_scan_period
        # A tenth of tolerance: a scanner of exactly this period shall not lose every other scan.
        if 0.0 <= scan.stamp - self._taken.get(source, -math.inf) < 0.9 * period:
            return
        self._taken[source] = scan.stamp
        self._queue.add_scan(source, scan)
        self._use_scans()

    def _take_odometry(self, odometry: Odometry) -> None:
        self._queue.add_odometry(odometry)
        self._use_scans()

    def _take_base_stop(self, stop: BaseStop) -> None:
        self._base_stop = stop
        if self._navigator is not None:
            self._navigator.base_stop = self._base_stop

    def _use_scans(self) -> None:
        navigator = self._navigator
        for source, scan, odom_pose in self._queue.take_ready():
            if navigator is None:
                continue
            try:
                sensor_in_base = self._frames.buffer.lookup(self._p.base_frame, scan.frame_id)
            except TransformUnavailable as error:
                self._ports.warn(f"scan ignored: {error}", source)
                continue
            now = self._ports.clock.now()
            navigator.add_scan(source, scan, sensor_in_base, odom_pose, self._map_from_odom(), now)
            if source in self._settings.cycle.required_sources:
                self._expect_next_scan(now)

    def _expect_next_scan(self, now: float) -> None:
        """Make a step as soon as the next scan is overdue; the cycle would stop the robot later."""
        self._forget_overdue()
        if self._cycle is not None:
            when = now + self._settings.cycle.scan_timeout + _JUST_AFTER_S
            self._overdue = self._ports.clock.call_at(when, self._step)

    def _forget_overdue(self) -> None:
        if self._overdue is not None:
            self._overdue.cancel()
            self._overdue = None

    def _map_from_odom(self) -> Pose2 | None:
        """Return the place of the odometry frame in the map, None when it was not published lately."""
        buffer, now = self._frames.buffer, self._ports.clock.now()
        stamp = buffer.latest_stamp(self._p.odom_frame)
        if stamp is None or now - stamp > self._settings.cycle.sensor_timeout:
            return None
        try:
            return buffer.lookup_pose(self._p.map_frame, self._p.odom_frame)
        except TransformUnavailable:
            return None

    # Costmaps.

    def _clear(self, _: NoFields) -> Fields:
        if self._navigator is not None:
            self._navigator.clear()
        return {}

    def _clear_unknown(self, _: NoFields) -> Fields:
        costmap, robot = self._costmap("global"), self._pose_in("global")
        if costmap is None or robot is None:
            self._ports.warn(f"the unknown around the robot is not cleared: {NO_POSE}", "clear")
        else:
            costmap.clear_unknown(robot.x, robot.y, 4.0 * costmap.footprint.circumscribed_radius)
        return {}

    def _clear_one(self, which: str, name: str, request: ClearRequest | NoFields) -> Fields:
        costmap = self._costmap(which)
        if costmap is not None and isinstance(request, NoFields):
            costmap.reset_outside(0.0, 0.0, 0.0)
        elif costmap is not None and isinstance(request, ClearRequest):
            robot = self._pose_in(which)
            if robot is None:
                self._ports.warn(f"the {which} costmap is not cleared: {NO_POSE}", "clear")
            else:
                clear = costmap.reset_inside if name == "around" else costmap.reset_outside
                clear(robot.x, robot.y, request.reset_distance)
        return {}

    def _costmap(self, which: str) -> Costmap | None:
        navigator = self._navigator
        if navigator is None:
            return None
        return navigator.global_costmap if which == "global" else navigator.local_costmap

    def _pose_in(self, which: str) -> Pose2 | None:
        """Return the robot in the frame of a costmap, None while it is not known."""
        odometry, place = self._queue.odometry, self._map_from_odom()
        if odometry is None or (which == "global" and place is None):
            return None
        return odometry.pose if place is None or which == "local" else place @ odometry.pose

    # Plans that nobody drives.

    def _plan(self, start: FramedPose | None, goal: FramedPose, tolerance: float = 0.0) -> Plan | Result:
        if self._navigator is None:
            return failure("rejected", NO_MAP)
        begin = self._pose_in("global") if start is None else self._to_map(start)
        end = self._to_map(goal)
        if begin is None:
            return failure("no_pose", NO_POSE)
        for place in (begin, end):
            if isinstance(place, Result):
                return place
        assert isinstance(begin, Pose2) and isinstance(end, Pose2)
        return self._navigator.plan_between(begin, end, tolerance)

    def _begin_plan(self, goal: PlanGoal) -> str | None:
        if self._map_work is not None:
            self._held_plan = partial(self._answer_plan, goal)
            return None
        if self._navigator is None:
            return NO_MAP
        self._answer_plan(goal)
        return None

    def _cancel_plan(self) -> None:
        self._held_plan = None
        self._plans.finish({"error_msg": "cancelled"}, Outcome.CANCELLED)

    def _answer_plan(self, goal: PlanGoal) -> None:
        started = self._ports.steady.now()
        plan = self._plan(goal.start if goal.use_start else None, goal.goal)
        told: dict[str, Any] = {"planning_time": self._ports.steady.now() - started}
        if isinstance(plan, Result):
            told |= {"error_code": PLAN_SERVER_CODES.get(plan.code, 200), "error_msg": plan.reason}
            self._plans.finish(told, Outcome.FAILED)
        else:
            told |= {"path": self._way(plan.poses()), "error_code": 0, "error_msg": ""}
            self._plans.finish(told, Outcome.SUCCEEDED)

    def _make_plan(self, request: PlanRequest) -> Fields:
        plan = self._plan(request.start, request.goal, request.tolerance)
        if isinstance(plan, Result):
            self._ports.warn(f"make_plan: {plan.reason}", "make_plan")
            return {}
        return {"plan": self._way(plan.poses())}

    def _get_frontier(self, request: FrontierRequest) -> Fields:
        robot = self._pose_in("global")
        if self._navigator is None or robot is None:
            return {"valid": False, "message": NO_POSE}
        result = self._navigator.next_view(robot, request.number)
        told: dict[str, Any] = {"valid": result.succeeded, "message": result.reason}
        if result.succeeded:
            pose = result.outputs["pose"]
            told |= {"x": pose.x, "y": pose.y, "phi": pose.yaw}
        return told

    def _way(self, poses: Any) -> FramedPath:
        return FramedPath(tuple(poses), self._p.map_frame)

    # Goals.

    def why_not(self) -> str | None:
        """Tell why no goal can be taken now; None when one can."""
        if self._overridden:
            return OVERRIDDEN
        return NO_MAP if self._navigator is None and self._map_work is None else None

    def _take_goal(self, action: DriveAction, goal: Any) -> str | None:
        refusal = self.why_not()
        if refusal is not None:
            return refusal
        if self._owner is not None and self._owner is not action:
            # A server replaces its own goals by itself.
            self._finish_goal(self._owner, failure("cancelled", _PREEMPTED))
            self._show_no_drive()
        self._owner = action
        # Until somebody is seen, the person is where the goal says.
        self._person = float(getattr(goal, "x", 0.0)), float(getattr(goal, "y", 0.0))
        self._started = self._ports.clock.now()
        if self._map_work is not None:
            self._held_goal = partial(self._begin, action, goal)
        else:
            self._begin(action, goal)
        return None

    def _begin(self, action: DriveAction, goal: Any) -> None:
        assert self._navigator is not None, "goals are held until the costmaps are made"
        self._navigator.start(goal, self._ports.clock.now(), self._to_map)
        pose = self._to_map(goal.pose) if action is NAVIGATE_TO_POSE else None
        if isinstance(pose, Pose2):
            self._current_goal.send(FramedPose(pose, self._p.map_frame))
            self._shows_goal = True
        self._start_cycle()

    def _to_map(self, given: FramedPose) -> Pose2 | Result:
        """Return a pose in the map frame, or why it is none."""
        if given.problem:
            return failure("bad_input", given.problem)
        if given.frame in ("", self._p.map_frame):
            return given.pose
        try:
            return self._frames.buffer.lookup_pose(self._p.map_frame, given.frame) @ given.pose
        except TransformUnavailable as error:
            return failure("no_transform", str(error))

    def _abandon(self, result: Result) -> None:
        """End the goal with a result that is not its own, and stop the base."""
        if self._navigator is not None:
            self._navigator.cancel()
        self._velocity.send(STANDSTILL)
        self._stop_cycle()
        self._report(result)

    def _cancel(self) -> None:
        if self._held_goal is not None:
            self._abandon(cancelled())
        elif self._navigator is not None and self._navigator.active:
            self._navigator.cancel()
            self._step()

    # The control cycle.

    def _start_cycle(self) -> None:
        now = self._started = self._next_feedback = self._ports.clock.now()
        if self._cycle is None:
            period = 1.0 / self._settings.cycle.controller_frequency
            self._cycle = call_every(self._ports.clock, period, self._step, start=now)

    def _stop_cycle(self) -> None:
        if self._cycle is not None:
            self._cycle.cancel()
            self._cycle = None
        self._forget_overdue()

    def _step(self) -> None:
        navigator = self._navigator
        if navigator is None:
            return
        now = self._ports.clock.now()
        see_people(navigator, self._frames.buffer, self._p.odom_frame, now)
        step = navigator.step(now, self._queue.odometry, self._map_from_odom())
        if step.command is not None:
            self._velocity.send(step.command)
        if step.result is not None:
            self._stop_cycle()
            self._report(step.result)
        elif step.command is not None:
            self._tell_of(navigator, step)
            self._show_plan(navigator.plan)

    def _tell_of(self, navigator: Navigator, step: CycleResult) -> None:
        now, action = self._ports.clock.now(), self._owner
        if action is None or (now < self._next_feedback and not action.every_cycle):
            return
        self._next_feedback = now + _FEEDBACK_PERIOD_S
        self._person = x, y = self._person_in_base(navigator)
        told, odometry, pose = step.feedback, self._queue.odometry, self._pose_in("global")
        facts = {
            "x": x,
            "y": y,
            "text": told.text,
            "navigation_time": now - self._started,
            "estimated_time_remaining": told.time_remaining,
            "time_left": told.time_remaining,
            "number_of_recoveries": told.recoveries,
            "distance_remaining": float(told.distance_remaining),
            "distance_to_goal": float(told.distance_remaining),
            "number_of_poses_remaining": told.poses_remaining,
            "distance_traveled": float(told.travelled),
            "angular_distance_traveled": float(told.travelled),
            "speed": 0.0 if odometry is None else float(odometry.twist.linear),
        }
        if pose is not None:
            facts["current_pose"] = FramedPose(pose, self._p.map_frame)
        self._goals[action].feedback(facts)

    def _person_in_base(self, navigator: Navigator) -> tuple[float, float]:
        """Return where the person was last, robot's frame, metres; unchanged while nobody knows."""
        odometry, person = self._queue.odometry, navigator.person
        if odometry is None or person is None:
            return self._person
        return odometry.pose.inverse().apply(*person)

    def _report(self, result: Result) -> None:
        owner, self._owner, self._held_goal = self._owner, None, None
        self._show_no_drive()
        if owner is not None:
            self._finish_goal(owner, result)
        if result.succeeded:
            self._ports.tell("goal succeeded", good=True)
        else:
            self._ports.tell(f"goal {result.outcome.value} ({result.code}): {result.reason}", good=False)

    def _finish_goal(self, action: DriveAction, result: Result) -> None:
        x, y = self._person
        facts = {
            "x": x,
            "y": y,
            "code": result.code if result.outcome is Outcome.FAILED else "",
            "reason": result.reason,
            "error_code": action.number(result),
            "error_msg": result.reason,
            "total_elapsed_time": self._ports.clock.now() - self._started,
        }
        self._goals[action].finish(facts, result.outcome)

    # For viewers.

    def _show_plan(self, plan: NDArray[np.float64] | None) -> None:
        """Publish the way when it is another, an empty one when there is none, or when a viewer has come."""
        before, self._plan_viewers = self._plan_viewers, self._path.listeners
        come = plan is not None and self._plan_viewers > before
        if not self._plan_viewers or (plan is self._shown_plan and not come):
            return
        self._shown_plan = plan
        self._path.send(self._way(Pose2(float(x), float(y)) for x, y in (() if plan is None else plan)))

    def _show_no_drive(self) -> None:
        """Take back the way and the goal of a drive that is over: a goal without a frame is none."""
        self._show_plan(None)
        if self._shows_goal:
            self._shows_goal = False
            self._current_goal.send(FramedPose(Pose2()))

    def _show_costmaps(self) -> None:
        if self._navigator is None:
            return
        _show_grid(self._global, self._navigator.global_grid)
        _show_grid(self._local, self._navigator.local_grid)


def _show_grid(output: Output[OccupancyGrid], make: Callable[[], OccupancyGrid]) -> None:
    if output.listeners:
        output.send(make())
