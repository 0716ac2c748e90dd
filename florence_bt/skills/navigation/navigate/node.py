"""The node ``navigate``: its actions (:mod:`actions.node`), plans, costmaps, ``cmd_vel``.

A pose on ``goal_pose`` (RViz) is sent on to the own action, as in Nav2: so every drive can be listed and
cancelled as a goal.

Source: document, sections 3.3 and 3.4; REFERENCE 7.2, 7.3 and 7.9.
"""

from __future__ import annotations

import math
import threading
import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from florence_interfaces.msg import StopReason, Zones
from florence_interfaces.srv import GetFrontier
from geometry_msgs.msg import PoseStamped, Twist
from nav2_msgs.action import ComputePathToPose, NavigateToPose
from nav2_msgs.srv import ClearCostmapAroundRobot, ClearCostmapExceptRegion, ClearEntireCostmap
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Odometry as OdometryMsg
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
from numpy.typing import NDArray
from rclpy.publisher import Publisher
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_msgs.msg import Bool, Float64
from std_srvs.srv import Empty
from unique_identifier_msgs.msg import UUID

from florence_bt.core.clock import Timer, call_every
from florence_bt.core.geometry import STANDSTILL, Pose2
from florence_bt.core.limits import CheckedParameters, NotNegative, Positive
from florence_bt.core.outcome import Outcome, Result, cancelled, failure
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.core.zones import Zone
from florence_bt.ros.action_server import PREEMPTED, SingleGoalServer
from florence_bt.ros.conversions import (
    duration_to_ros,
    frame_from_ros,
    grid_from_ros,
    grid_to_ros,
    odometry_from_ros,
    path_to_ros,
    pose_from_ros,
    pose_stamped_to_ros,
    scan_from_ros,
    stamp_from_ros,
    twist_to_ros,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR, STATE
from florence_bt.ros.tf import TransformListener
from florence_bt.ros.topics import MANUAL_OVERRIDE, ZONES
from florence_bt.ros.zones import zones_from_ros
from florence_bt.skills.navigation.localisation.scan_queue import ScanQueue
from florence_bt.skills.navigation.navigate.actions.node import (
    GOAL_ACTIONS,
    NAVIGATE_TO_POSE,
    GoalAction,
    filled,
)
from florence_bt.skills.navigation.navigate.bindings import SPEED_LIMIT
from florence_bt.skills.navigation.navigate.costmap import BODIES, Costmap
from florence_bt.skills.navigation.navigate.navigator import FEET, Navigator, problem_with_quaternion
from florence_bt.skills.navigation.navigate.parameters import REPLACED_PARAMETERS, NavigatorParameters
from florence_bt.skills.navigation.navigate.people_frames import see_people
from florence_bt.skills.navigation.navigate.planner import Plan
from florence_bt.skills.navigation.navigate.results import NO_MAP, NO_POSE, PLAN_SERVER_CODES, BaseStop
from florence_bt.skills.navigation.navigate.state import CycleResult

_FEEDBACK_PERIOD_S = 0.5
_JUST_AFTER_S = 0.001
OVERRIDDEN = "the manual override is on; release it first: florence release"
SendGoal = NavigateToPose.Impl.SendGoalService


@dataclass(frozen=True, slots=True)
class NavigationNodeParameters(CheckedParameters):
    """Frames and periods of the node.

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


class NavigationNode(FlorenceNode):
    """Serves goals one at a time; works only while one is active."""

    replaced_parameters = REPLACED_PARAMETERS
    parameter_classes = (*NavigatorParameters.CLASSES, NavigationNodeParameters)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None, namespace: str = "") -> None:
        super().__init__("navigate", parameters=parameters, namespace=namespace)
        self._settings = NavigatorParameters.read(self.read_parameters)
        self._p = self.read_parameters(NavigationNodeParameters)
        self._navigator: Navigator | None = None
        self._map_work: OccupancyGridMsg | None = None
        self._held_goal: Callable[[], None] | None = None
        self._held_plan: Callable[[], None] | None = None
        self._base_stop = BaseStop()
        self._speed_limit = 0.0
        self._zones: tuple[Zone, ...] = ()
        self._queue = ScanQueue()
        self.ros_timebase.on_reset(self._forget_readings)
        self._taken: dict[str, float] = {}
        self._cycle: Timer | None = None
        self._overdue: Timer | None = None
        self._owner: GoalAction | None = None
        self._started = 0.0
        self._next_feedback = 0.0
        self._shown_plan: NDArray[np.float64] | None = None
        self._plan_viewers = 0
        self._shows_goal = False
        self._overridden = False
        self._frames = TransformListener(self)
        self._person = 0.0, 0.0
        self._make_publishers()
        self._make_subscriptions()
        self._servers = {action: self._serve(action) for action in GOAL_ACTIONS}
        self._plans = SingleGoalServer(
            self,
            ComputePathToPose,
            "compute_path_to_pose",
            on_goal=self._on_plan_goal,
            on_cancel=self._on_cancel_plan,
            bad_goal_code=PLAN_SERVER_CODES["bad_input"],
        )
        self._make_services()
        action = self.resolve_action_name("navigate_to_pose")
        self._own_goals = self.create_client(SendGoal, f"{action}/_action/send_goal")
        call_every(self.timebase, self._p.costmap_publish_period, self._publish_costmaps)

    def _make_subscriptions(self) -> None:
        self.create_subscription(OccupancyGridMsg, "map", self._on_map, LATCHED)
        self.create_subscription(OdometryMsg, "odom", self._on_odometry, STATE)
        self.create_subscription(StopReason, "turtlebot_node/stop_reason", self._on_base_stop, LATCHED)
        for topic, source in (
            ("filtered_scan", "scan"),
            ("filtered_kinect_scan", "depth"),
            ("filtered_kinect_low_scan", "low"),
            ("filtered_kinect_overhang_scan", "overhangs"),
            ("people_scan", BODIES),
            ("filtered_laser_scan", FEET),
        ):
            self.create_subscription(LaserScanMsg, topic, self._scan_callback(source), SENSOR)
        self.create_subscription(Bool, MANUAL_OVERRIDE, self._on_override, LATCHED)
        self.create_subscription(Float64, SPEED_LIMIT, self._on_speed_limit, RELIABLE)
        self.create_subscription(Zones, ZONES, self._on_zones, LATCHED)
        self.create_subscription(PoseStamped, "goal_pose", self._on_goal_pose, RELIABLE)

    def _serve(self, action: GoalAction) -> SingleGoalServer:
        return SingleGoalServer(
            self,
            action.interface,
            action.name,
            on_goal=partial(self._on_goal, action),
            on_cancel=self._on_cancel,
            bad_goal_code=action.codes["bad_input"],
        )

    def _make_services(self) -> None:
        self.create_service(Empty, "~/clear_costmaps", self._on_clear)
        self.create_service(Empty, "~/clear_unknown_space", self._on_clear_unknown)
        self.create_service(GetPlan, "~/make_plan", self._on_make_plan)
        self.create_service(GetFrontier, "~/get_frontier", self._on_get_frontier)
        for which in ("global", "local"):
            for kind, name in (
                (ClearEntireCostmap, "entirely"),
                (ClearCostmapExceptRegion, "except"),
                (ClearCostmapAroundRobot, "around"),
            ):
                service = f"{which}_costmap/clear_{name}_{which}_costmap"
                self.create_service(kind, service, partial(self._on_clear_one, which, name))

    def _make_publishers(self) -> None:
        self._velocity = self.create_publisher(Twist, "cmd_vel", RELIABLE)
        self._path = self.create_publisher(Path, "plan", RELIABLE)
        self._current_goal = self.create_publisher(PoseStamped, "~/current_goal", LATCHED)
        self._global = self.create_publisher(OccupancyGridMsg, "global_costmap/costmap", LATCHED)
        self._local = self.create_publisher(OccupancyGridMsg, "local_costmap/costmap", LATCHED)

    def close(self) -> None:
        """Stop the robot."""
        if self._cycle is not None:
            self._velocity.publish(twist_to_ros(STANDSTILL))
            self._stop_cycle()
        self._show_no_drive()

    def on_failure(self, reason: str) -> None:
        """Stop the robot and end the goal, which cannot be trusted to go on well."""
        if self._cycle is not None or self._held_goal is not None:
            self._abandon(failure("server_failed", reason))

    def _forget_readings(self) -> None:
        """Forget readings, as the clock has jumped: what was on its way may have a useless stamp."""
        self._queue.clear()
        self._taken.clear()

    # Messages.

    @property
    def has_map(self) -> bool:
        """Whether a map has come and its costmaps are made; before one has come, goals are refused."""
        return self._navigator is not None

    @property
    def makes_costmaps(self) -> bool:
        """Whether the costmaps of a map that has come are being made: goals are held."""
        return self._map_work is not None

    def _on_map(self, message: OccupancyGridMsg) -> None:
        """Make the costmaps on a thread: on a big map that takes seconds. Goals are held meanwhile.

        A map that grows goes into those that are there: it has the size of a home, and the goal goes on.
        """
        if self._navigator is not None and self._settings.exploration.map_grows:
            self._navigator.replace_map(grid_from_ros(message))
            return
        if self._navigator is not None and self._navigator.active:
            self._abandon(failure("no_path", "the map was replaced"))
        self._map_work = message
        threading.Thread(target=self._make_costmaps, args=(message,), name="costmaps", daemon=True).start()

    def _make_costmaps(self, message: OccupancyGridMsg) -> None:
        made: Navigator | Exception
        try:
            made = Navigator(grid_from_ros(message), self._settings)
        except Exception as error:
            made = error
        self.call_soon(partial(self._use_map, message, made))

    def _use_map(self, message: OccupancyGridMsg, made: Navigator | Exception) -> None:
        if message is not self._map_work:
            return  # a newer map has come meanwhile
        self._map_work = None
        if isinstance(made, Exception):
            raise made
        self._navigator = made
        made.base_stop = self._base_stop
        made.speed_limit = self._speed_limit
        made.set_zones(self._zones)
        goal, plan = self._held_goal, self._held_plan
        self._held_goal = self._held_plan = None
        for begin in (goal, plan):
            if begin is not None:
                begin()

    def _on_speed_limit(self, message: Float64) -> None:
        self._speed_limit = max(0.0, message.data)
        if self._navigator is not None:
            self._navigator.speed_limit = self._speed_limit

    def _on_zones(self, message: Zones) -> None:
        self._zones = zones_from_ros(message)
        if self._navigator is not None:
            self._navigator.set_zones(self._zones)

    def _on_override(self, message: Bool) -> None:
        self._overridden = bool(message.data)
        if self._overridden and self._owner is not None:
            self._abandon(failure("rejected", OVERRIDDEN))

    def _scan_callback(self, source: str) -> Any:
        def on_scan(message: LaserScanMsg) -> None:
            stamp = self.time_of(stamp_from_ros(message.header.stamp))
            period = self._p.idle_scan_period if self._cycle is None else self._p.active_scan_period
            # A tenth of tolerance: a scanner of exactly this period shall not lose every other scan.
            if 0.0 <= stamp - self._taken.get(source, -math.inf) < 0.9 * period:
                return
            self._taken[source] = stamp
            self._queue.add_scan(source, self.timed(scan_from_ros(message)))
            self._take_scans()

        return on_scan

    def _on_odometry(self, message: OdometryMsg) -> None:
        self._queue.add_odometry(self.timed(odometry_from_ros(message)))
        self._take_scans()

    def _on_base_stop(self, message: StopReason) -> None:
        self._base_stop = BaseStop(message.code, message.text)
        if self._navigator is not None:
            self._navigator.base_stop = self._base_stop

    def _take_scans(self) -> None:
        navigator = self._navigator
        for source, scan, odom_pose in self._queue.take_ready():
            if navigator is None:
                continue
            try:
                sensor_in_base = self._frames.buffer.lookup(self._p.base_frame, scan.frame_id)
            except TransformUnavailable as error:
                self.get_logger().warning(f"scan ignored: {error}", throttle_duration_sec=5.0)
                continue
            now = self.timebase.now()
            navigator.add_scan(source, scan, sensor_in_base, odom_pose, self._map_from_odom(), now)
            if source in self._settings.cycle.required_sources:
                self._expect_next_scan(now)

    def _expect_next_scan(self, now: float) -> None:
        """Make a step as soon as the next scan is overdue; the cycle would stop the robot later."""
        self._forget_overdue()
        if self._cycle is not None:
            when = now + self._settings.cycle.scan_timeout + _JUST_AFTER_S
            self._overdue = self.timebase.call_at(when, self._step)

    def _forget_overdue(self) -> None:
        if self._overdue is not None:
            self._overdue.cancel()
            self._overdue = None

    def _map_from_odom(self) -> Pose2 | None:
        """Return the place of the odometry frame in the map, None when it was not published lately."""
        buffer, now = self._frames.buffer, self.timebase.now()
        stamp = buffer.latest_stamp(self._p.odom_frame)
        if stamp is None or now - stamp > self._settings.cycle.sensor_timeout:
            return None
        try:
            return buffer.lookup_pose(self._p.map_frame, self._p.odom_frame)
        except TransformUnavailable:
            return None

    def _on_clear(self, _: Empty.Request, response: Empty.Response) -> Empty.Response:
        if self._navigator is not None:
            self._navigator.clear()
        return response

    def _on_clear_unknown(self, _: Empty.Request, response: Empty.Response) -> Empty.Response:
        costmap, robot = self._costmap("global"), self._pose_in("global")
        if costmap is None or robot is None:
            self.get_logger().warning(f"the unknown around the robot is not cleared: {NO_POSE}")
        else:
            costmap.clear_unknown(robot.x, robot.y, 4.0 * costmap.footprint.circumscribed_radius)
        return response

    def _on_clear_one(self, which: str, name: str, request: Any, response: Any) -> Any:
        costmap = self._costmap(which)
        if costmap is not None and name == "entirely":
            costmap.reset_outside(0.0, 0.0, 0.0)
        elif costmap is not None:
            robot = self._pose_in(which)
            if robot is None:
                self.get_logger().warning(f"the {which} costmap is not cleared: {NO_POSE}")
            else:
                clear = costmap.reset_inside if name == "around" else costmap.reset_outside
                clear(robot.x, robot.y, float(request.reset_distance))
        return response

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

    def _plan(self, start: PoseStamped | None, goal: PoseStamped, tolerance: float = 0.0) -> Plan | Result:
        if self._navigator is None:
            return failure("rejected", NO_MAP)
        begin = self._pose_in("global") if start is None else self._goal_in_map(start)
        end = self._goal_in_map(goal)
        if begin is None:
            return failure("no_pose", NO_POSE)
        for place in (begin, end):
            if isinstance(place, Result):
                return place
        assert isinstance(begin, Pose2) and isinstance(end, Pose2)
        return self._navigator.plan_between(begin, end, tolerance)

    def _on_plan_goal(self, request: ComputePathToPose.Goal) -> str | None:
        if self._map_work is not None:
            self._held_plan = partial(self._answer_plan, request)
            return None
        if self._navigator is None:
            return NO_MAP
        self._answer_plan(request)
        return None

    def _on_cancel_plan(self) -> None:
        self._held_plan = None
        self._plans.finish(ComputePathToPose.Result(error_msg="cancelled"), Outcome.CANCELLED)

    def _answer_plan(self, request: ComputePathToPose.Goal) -> None:
        started = self.steady.now()
        plan = self._plan(request.start if request.use_start else None, request.goal)
        took = duration_to_ros(self.steady.now() - started)
        if isinstance(plan, Result):
            code = PLAN_SERVER_CODES.get(plan.code, 200)
            failed = ComputePathToPose.Result(planning_time=took, error_code=code, error_msg=plan.reason)
            self._plans.finish(failed, Outcome.FAILED)
        else:
            done = ComputePathToPose.Result(path=self._path_of(plan), planning_time=took)
            self._plans.finish(done, Outcome.SUCCEEDED)

    def _on_make_plan(self, request: GetPlan.Request, response: GetPlan.Response) -> GetPlan.Response:
        plan = self._plan(request.start, request.goal, float(request.tolerance))
        if isinstance(plan, Result):
            self.get_logger().warning(f"make_plan: {plan.reason}")
        else:
            response.plan = self._path_of(plan)
        return response

    def _on_get_frontier(
        self, request: GetFrontier.Request, response: GetFrontier.Response
    ) -> GetFrontier.Response:
        robot = self._pose_in("global")
        if self._navigator is None or robot is None:
            response.message = NO_POSE
            return response
        result = self._navigator.next_view(robot, request.number)
        response.valid, response.message = result.succeeded, result.reason
        if result.succeeded:
            pose = result.outputs["pose"]
            response.x, response.y, response.phi = pose.x, pose.y, pose.yaw
        return response

    def _path_of(self, plan: Plan) -> Path:
        return path_to_ros(plan.poses(), self._p.map_frame, self.stamp())

    # Goals.

    def _why_not(self) -> str | None:
        """Tell why no goal can be taken now; None when one can."""
        if self._overridden:
            return OVERRIDDEN
        return NO_MAP if self._navigator is None and self._map_work is None else None

    def _on_goal(self, action: GoalAction, request: Any) -> str | None:
        refusal = self._why_not()
        if refusal is not None:
            return refusal
        if self._owner is not None and self._owner is not action:
            # A server replaces its own goals by itself.
            self._finish_goal(self._owner, failure("cancelled", PREEMPTED))
            self._show_no_drive()
        self._owner = action
        # Until somebody is seen, the person is where the goal says.
        self._person = float(getattr(request, "x", 0.0)), float(getattr(request, "y", 0.0))
        self._started = self.timebase.now()
        if self._map_work is not None:
            self._held_goal = partial(self._begin, action, request)
        else:
            self._begin(action, request)
        return None

    def _begin(self, action: GoalAction, request: Any) -> None:
        assert self._navigator is not None, "goals are held until the costmaps are made"
        problem = action.begin(self._navigator, request, self.timebase.now(), self._goal_in_map)
        if problem is not None:
            # An older goal ends with it: the base stops.
            self._abandon(problem)
            return
        if action is NAVIGATE_TO_POSE:
            goal = self._goal_in_map(request.pose)
            assert isinstance(goal, Pose2), "begun"
            self._current_goal.publish(pose_stamped_to_ros(goal, self._p.map_frame, self.stamp()))
            self._shows_goal = True
        self._start_cycle()

    def _on_goal_pose(self, message: PoseStamped) -> None:
        refusal = self._why_not()
        if refusal is None and not self._own_goals.service_is_ready():
            refusal = "the node is just starting; ask again"
        if refusal is not None:
            self.get_logger().warning(f"goal_pose ignored: {refusal}")
            return
        goal = NavigateToPose.Goal(pose=message)
        goal_id = UUID(uuid=list(uuid.uuid4().bytes))
        self._own_goals.call_async(SendGoal.Request(goal_id=goal_id, goal=goal))

    def _goal_in_map(self, message: PoseStamped) -> Pose2 | Result:
        """Return the goal in the map frame, or why it is none."""
        q = message.pose.orientation
        problem = problem_with_quaternion(q.x, q.y, q.z, q.w)
        if problem is not None:
            return failure("bad_input", problem)
        pose, frame = pose_from_ros(message.pose), frame_from_ros(message.header.frame_id)
        if frame in ("", self._p.map_frame):
            return pose
        try:
            return self._frames.buffer.lookup_pose(self._p.map_frame, frame) @ pose
        except TransformUnavailable as error:
            return failure("no_transform", str(error))

    def _abandon(self, result: Result) -> None:
        """End the goal with a result that is not its own, and stop the base."""
        if self._navigator is not None:
            self._navigator.cancel()
        self._velocity.publish(twist_to_ros(STANDSTILL))
        self._stop_cycle()
        self._report(result)

    def _on_cancel(self) -> None:
        if self._held_goal is not None:
            self._abandon(cancelled())
        elif self._navigator is not None and self._navigator.active:
            self._navigator.cancel()
            self._step()

    # The control cycle.

    def _start_cycle(self) -> None:
        self._started = self._next_feedback = self.timebase.now()
        if self._cycle is None:
            period = 1.0 / self._settings.cycle.controller_frequency
            self._cycle = call_every(self.timebase, period, self._step, start=self.timebase.now())

    def _stop_cycle(self) -> None:
        if self._cycle is not None:
            self._cycle.cancel()
            self._cycle = None
        self._forget_overdue()

    def _step(self) -> None:
        navigator = self._navigator
        if navigator is None:
            return
        now = self.timebase.now()
        see_people(navigator, self._frames.buffer, self._p.odom_frame, now)
        step = navigator.step(now, self._queue.odometry, self._map_from_odom())
        if step.command is not None:
            self._velocity.publish(twist_to_ros(step.command))
        if step.result is not None:
            self._stop_cycle()
            self._report(step.result)
        elif step.command is not None:
            self._publish_feedback(navigator, step)
            self._publish_plan(navigator.plan)

    def _publish_feedback(self, navigator: Navigator, step: CycleResult) -> None:
        now, action = self.timebase.now(), self._owner
        if action is None or (now < self._next_feedback and not action.every_cycle):
            return
        self._next_feedback = now + _FEEDBACK_PERIOD_S
        self._person = x, y = self._person_in_base(navigator)
        told, odometry, pose = step.feedback, self._queue.odometry, self._pose_in("global")
        time_left = duration_to_ros(told.time_remaining)
        facts = {
            "x": x,
            "y": y,
            "text": told.text,
            "navigation_time": duration_to_ros(now - self._started),
            "estimated_time_remaining": time_left,
            "time_left": time_left,
            "number_of_recoveries": told.recoveries,
            "distance_remaining": float(told.distance_remaining),
            "distance_to_goal": float(told.distance_remaining),
            "number_of_poses_remaining": told.poses_remaining,
            "distance_traveled": float(told.travelled),
            "angular_distance_traveled": float(told.travelled),
            "speed": 0.0 if odometry is None else float(odometry.twist.linear),
        }
        if pose is not None and odometry is not None:
            facts["current_pose"] = pose_stamped_to_ros(pose, self._p.map_frame, self.stamp(odometry.stamp))
        self._servers[action].publish_feedback(filled(action.interface.Feedback, facts))

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
        # One line of code each: rclpy refuses another severity from the same line.
        if result.succeeded:
            self.get_logger().info("goal succeeded")
        else:
            self.get_logger().warning(f"goal {result.outcome.value} ({result.code}): {result.reason}")

    def _finish_goal(self, action: GoalAction, result: Result) -> None:
        x, y = self._person
        facts = {
            "x": x,
            "y": y,
            "code": result.code if result.outcome is Outcome.FAILED else "",
            "reason": result.reason,
            "error_code": action.number(result),
            "error_msg": result.reason,
            "total_elapsed_time": duration_to_ros(self.timebase.now() - self._started),
        }
        self._servers[action].finish(filled(action.interface.Result, facts), result.outcome)

    # For viewers.

    def _publish_plan(self, plan: NDArray[np.float64] | None) -> None:
        """Publish the way when it is another, an empty one when there is none, or when a viewer has come."""
        before, self._plan_viewers = self._plan_viewers, self._path.get_subscription_count()
        come = plan is not None and self._plan_viewers > before
        if not self._plan_viewers or (plan is self._shown_plan and not come):
            return
        self._shown_plan = plan
        poses = (Pose2(float(x), float(y)) for x, y in (() if plan is None else plan))
        self._path.publish(path_to_ros(poses, self._p.map_frame, self.stamp()))

    def _show_no_drive(self) -> None:
        """Take back the way and the goal of a drive that is over: a goal without a frame is none."""
        self._publish_plan(None)
        if self._shows_goal:
            self._shows_goal = False
            self._current_goal.publish(PoseStamped())

    def _publish_costmaps(self) -> None:
        if self._navigator is None:
            return
        self._publish_grid(self._global, self._navigator.global_grid, self._p.map_frame)
        self._publish_grid(self._local, self._navigator.local_grid, self._p.odom_frame)

    def _publish_grid(self, publisher: Publisher, make: Any, frame: str) -> None:
        if publisher.get_subscription_count():
            grid: OccupancyGrid = make()
            publisher.publish(grid_to_ros(grid, frame, self.stamp()))
