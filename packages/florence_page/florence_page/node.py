"""What the page shows, from the topics of a running system: a node of ROS that gathers, and moves nothing."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from action_msgs.msg import GoalStatus, GoalStatusArray
from florence_interfaces.msg import RunTree as RunTreeMsg
from florence_interfaces.msg import Zones
from florence_interfaces.srv import AnswerQuestion, SetBreakpoints
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Path as PathMsg
from sensor_msgs.msg import Image
from sensor_msgs.msg import LaserScan as LaserScanMsg
from visualization_msgs.msg import MarkerArray

from florence_bt.app.runs.client import ACTIVE_STATES, is_paused
from florence_bt.app.runs.run_trees import run_tree_from_ros
from florence_bt.core.beam_ends import beam_ends
from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import FrameError
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.heard import Freshness, Heard, age_text
from florence_bt.core.message_skills import AskedQuestion
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.topic_names import (
    AMCL_POSE,
    CLOCK,
    COLOUR_IMAGE,
    FILTERED_SCAN,
    GLOBAL_COSTMAP,
    HOTSPOTS,
    LOCAL_COSTMAP,
    MAP,
    PLACE_STATUS,
    PLAN,
    RUN_TREE,
    USER_MARKERS,
    ZONES,
)
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.ros.conversions import colours_from_ros, grid_from_ros, pose_from_ros, scan_from_ros
from florence_bt.ros.endings import Silence, tellers_of
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, NO_EVENTS, RELIABLE, SENSOR
from florence_bt.ros.robot_state import (
    BATTERY,
    DRIVE_GOAL,
    HELD,
    OVERRIDE,
    RUN,
    SPOKEN,
    BatteryCharge,
    RobotState,
)
from florence_bt.ros.tf import TransformListener
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.skills.locator.hotspots import Hotspots
from florence_bt.skills.locator.markers import hotspots_from_ros
from florence_page.asking import StandingQuestion
from florence_page.parts import LiveParts, places_part, tree_parts
from florence_page.pictures import camera_picture, costmap_picture, map_picture
from florence_page.shown_tree import ShownTree

MAP_FRAME, BASE_FRAME = "map", "base_link"
FOLLOW_S = 0.1
"""How often the robot's pose is looked up."""
MOST_SCAN_POINTS = 240
"""Points of a scan that are shown: one in 1.5 degrees of a whole circle."""
SCENE, CAMERA = "scene", "camera"
LAYERS = {
    "global_costmap": GLOBAL_COSTMAP,
    "local_costmap": LOCAL_COSTMAP,
    CAMERA: COLOUR_IMAGE,
}
"""What is shown on request -> its topic."""
WANTS = frozenset({SCENE, *LAYERS})
"""What a viewer can want to see; what comes seldom is always there."""
CAMERA_S = 0.5
"""Seconds between two pictures of the camera, at least."""
SCENE_SILENT_S = 3.0
"""Seconds of silence after which what comes several times a second has ended: the pose, scans, people, the
camera's pictures. Chosen: a busy machine holds a message up by less."""
ENDED_LOOK_S = 1.0
"""How often is looked what has ended."""
GONE = "GONE"
"""The state of a run whose mission server is gone."""
DRIVES = ("navigate_to_pose", "navigate_through_poses")
"""The actions of Nav2 whose drives have a way. It does not publish that there is none any more."""
ACTIVE_GOALS = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING)
TREE_SHARE = 0.08
"""Part of the time that goes into the tree, at most."""
BASE, MISSIONS = "base", "missions"
NAVIGATION = frozenset({"navigation", "navigate"})
"""The process that drives the robot, and with ``--split`` that of its node."""
ASK_S = 0.5
"""How often the mission server is asked for open questions and breakpoints, while somebody looks."""
BREAKPOINTS = "florence_bt/breakpoints"


class PageNode(FlorenceNode):
    """Gathers what the page shows. While nobody looks it hears only what comes seldom.

    Args:
        context: The ROS context.

    Attributes:
        parts: What viewers are sent.
        pictures: By name: ``map`` and the costmaps as PNG, the camera's as JPEG.
        places: The rooms and objects of the locator.
        tree: The tree that viewers see.
        override: What the base's driver has said last about the manual override.
        on_stop: Called when the base's driver has counted one more stop, whoever pressed.
    """

    def __init__(self, *, context: Any = None) -> None:
        super().__init__("page", context=context)
        self.parts = LiveParts()
        self.pictures: dict[str, bytes] = {}
        self.places = Hotspots()
        # From the wall clock, in milliseconds, which JavaScript counts exactly: browsers keep pictures longer
        # than a simulation lasts, and its stamps begin anew.
        self._versions = itertools.count(time.time_ns() // 1_000_000)
        self._state: dict[str, Any] = {
            "stop": "",
            "battery": None,
            "battery_was": None,
            "said": "",
            "sure": None,
            "trouble": None,
        }
        self.robot = RobotState(self)
        self._stops: int | None = None
        self.on_stop: Callable[[], None] = lambda: None
        self._made_at = self.steady.now()
        # That the mission server answers is its word; it is asked twice a second.
        self._missions: Heard[bool] = Heard(self.robot.time, ASK_S)
        self._missions.take(True)
        self._run: dict[str, Any] = {}
        self._questions: StandingQuestion[tuple[AskedQuestion, ...]] = StandingQuestion(
            self, AnswerQuestion, "florence_bt/answer", self._read_questions, ()
        )
        self.tree = ShownTree()
        self._breakpoints: StandingQuestion[tuple[str, ...] | None] = StandingQuestion(
            self, SetBreakpoints, BREAKPOINTS, self._read_breakpoints, None
        )
        # That the process of navigation runs is the supervisor's word; without one nobody denies it.
        self._navigation: Heard[bool] = Heard(self.robot.time, ASK_S)
        self._navigation.take(True)
        self._subscribe_to_states()
        self._put()
        self.create_timer(ENDED_LOOK_S, self.robot.look_who_is_left)
        self.create_timer(ASK_S, self._note_silence)

    @property
    def simulated(self) -> bool:
        """Tell whether a simulation says what time it is."""
        return self.count_publishers(CLOCK) > 0

    @property
    def overridden(self) -> bool:
        """Tell whether the manual override is on, as far as the base's driver has said."""
        return self.override.last is not None and self.override.last.on

    def add_picture(self, name: str, data: bytes) -> list[int]:
        """Keep a picture; return its version, which no other one has had."""
        self.pictures[name] = data
        return [next(self._versions)]

    def show_speeds(self, speeds: Twist2) -> None:
        """Show how fast a hand drives the robot: metres and radians a second."""
        self._put(speeds=[round(speeds.linear, 2), round(speeds.angular, 2)])

    @property
    def questions(self) -> tuple[AskedQuestion, ...]:
        """List what missions wait to be answered, by the mission server's last word, while that is new."""
        return self._questions.value

    def take_away(self, question: AskedQuestion) -> None:
        """Show a question no longer: it has its answer."""
        self._questions.take(tuple(each for each in self.questions if each != question))

    def begin_to_ask(self) -> None:
        """Take note that somebody has begun to look: the mission server is asked from now on."""
        self._missions.take(True)

    def ask_mission_server(self) -> None:
        """Ask for open questions and breakpoints; that it answers shows that the mission server lives."""
        self._questions.ask()
        self._breakpoints.ask()
        self._show_breakpoints()

    def _read_questions(self, answer: Any) -> tuple[AskedQuestion, ...]:
        self._missions.take(True)
        return tuple(AskedQuestion(each.id, each.text, tuple(each.choices)) for each in answer.questions)

    # ---- breakpoints ----------------------------------------------------------------------------------

    @property
    def breakpoints(self) -> tuple[str, ...]:
        """List the breakpoints that are set, by whomever; empty while the mission server says nothing."""
        return self._breakpoints.value or ()

    def take_breakpoints(self, names: Sequence[str]) -> None:
        """Show the breakpoints that there are after a change."""
        self._breakpoints.take(tuple(names))
        self._show_breakpoints()

    def show_tree(self, tree: RunTree) -> None:
        """Show the tree of a run, with its breakpoints; without nodes none is shown."""
        self.tree = self.tree.followed_by(tree)
        for name, value in tree_parts(tree.nodes).items():
            self.parts.put(name, value)
        self._show_breakpoints()

    def _read_breakpoints(self, answer: Any) -> tuple[str, ...]:
        self._missions.take(True)
        return tuple(answer.breakpoints)

    def _show_breakpoints(self) -> None:
        names = self.breakpoints
        self.parts.put("breakpoints", {"names": names, "rows": self.tree.marked(names)})

    def _note_silence(self) -> None:
        """Tell viewers who has said nothing for how many whole seconds, of those whose word is shown."""
        if not NAVIGATION & self.robot.processes_down():
            self._navigation.take(True)
        heard = {BASE: self.override, MISSIONS: self._missions, "navigation": self._navigation}
        self.parts.put(
            "silent", {who: int(word.age) for who, word in heard.items() if word.freshness is Freshness.OLD}
        )
        self._show_ages()

    def _show_ages(self) -> None:
        """Show what is told again and again as long as it is fresh, and how old the last word is then."""
        battery, place = self._battery, self._place()
        trouble = [f"{what}: {how}" for what, how in self.robot.processes_in_trouble().items()]
        self._put(
            battery=_percent(battery.fresh),
            battery_was=None if battery.freshness is not Freshness.OLD else _was(battery),
            sure=place,
            trouble="; ".join([*trouble, *self.robot.late()]) or None,
        )

    def _place(self) -> str | None:
        """Say how sure the localiser is; None while none has told."""
        for _, heard in self.robot.diagnoses(about=PLACE_STATUS):
            if heard.last is not None:
                word = heard.last.message
                if heard.fresh is None:
                    return f"unsure: the localiser has said nothing for {age_text(heard.age)}"
                return word if heard.last.level is Severity.OK else f"unsure: {word}"
        return None

    # ---- what comes seldom ----------------------------------------------------------------------------

    def _subscribe_to_states(self) -> None:
        self.create_subscription(OccupancyGridMsg, MAP, self._on_map, LATCHED)
        self.create_subscription(MarkerArray, HOTSPOTS, self._on_hotspots, LATCHED)
        self.create_subscription(Zones, ZONES, self._on_zones, LATCHED)
        self.override = self.robot.listen(OVERRIDE, self._on_override)
        self._battery = self.robot.listen(BATTERY, self._show_ages)
        self.robot.listen_to_diagnostics()
        self._run_state = self.robot.listen(RUN, self._show_run, vouched_by=self._missions)
        self._goal = self.robot.listen(DRIVE_GOAL, self._show_goal, vouched_by=self._navigation)
        self._held = self.robot.listen(
            HELD, lambda: self._put(stop=self._held.last or ""), vouched_by=self.override
        )
        self._spoken = self.robot.listen(SPOKEN, lambda: self._put(said=self._spoken.last or ""))

    def _put(self, **changes: Any) -> None:
        self._state |= changes
        self.parts.put("state", self._state)

    def _on_map(self, message: OccupancyGridMsg) -> None:
        grid = grid_from_ros(message)
        self.parts.put("map", _placed(grid, self.add_picture("map", map_picture(grid))))

    def _on_hotspots(self, message: MarkerArray) -> None:
        self.places = hotspots_from_ros(message)
        self.parts.put("places", places_part(self.places))

    def _on_zones(self, message: Zones) -> None:
        self.parts.put(
            "zones",
            [
                {
                    "label": zone.label,
                    "kind": "keep_out" if zone.kind == zone.KEEP_OUT else "slow",
                    "corners": [[_m(point.x), _m(point.y)] for point in zone.area.points],
                }
                for zone in message.zones
            ],
        )

    def _show_run(self) -> None:
        """Show the run; when the mission server is gone, nobody knows how it stands unless it had ended."""
        told = self._run_state.last
        if told is not None:
            names = ("run_id", "mission", "state", "code", "reason")
            self._run = {name: getattr(told, name) for name in names} | {"paused": is_paused(told)}
        elif self._run["state"] in ACTIVE_STATES:
            self._run |= {"state": GONE, "reason": "its mission server is gone"}
        self.parts.put("run", self._run)

    def _show_goal(self) -> None:
        told = self._goal.last
        drives = told is not None and bool(told.header.frame_id)
        self.parts.put("goal", _pose(pose_from_ros(told.pose)) if told is not None and drives else None)

    def _on_override(self) -> None:
        message = self.override.last
        assert message is not None
        if message.on and self._stops not in (None, message.stops):
            self.on_stop()
        self._stops = message.stops
        self.parts.put(
            "override",
            {
                "on": message.on,
                "stops": message.stops,
                "standing": message.standing,
                "by_hand": message.driven_by_hand,
                "problem": message.problem,
            },
        )


class SceneNode(FlorenceNode):
    """Gathers what comes often: it exists while somebody looks.

    Args:
        page: Has what viewers are sent.
        simulated: Whether the stamps of messages are those of a simulation.
        context: The ROS context.
    """

    def __init__(self, page: PageNode, *, simulated: bool, context: Any = None) -> None:
        super().__init__("page_scene", parameters={"use_sim_time": simulated}, context=context)
        self.simulated = simulated
        self.wanted: frozenset[str] = frozenset()
        self._page = page
        self._parts = page.parts
        self._layers: dict[str, Any] = {}
        self._silence = Silence(self.steady, SCENE_SILENT_S)
        self._pose_stamp: float | None = None
        self._driving: set[str] = set()
        self._next_picture = -math.inf
        self._scene: dict[str, Any] = {"pose": None, "scan": [], "people": []}
        self._scan: LaserScan | None = None
        self._tf = TransformListener(self)
        brief: dict[str, Any] = {"event_callbacks": NO_EVENTS}
        self.create_subscription(LaserScanMsg, FILTERED_SCAN, self._on_scan, SENSOR, **brief)
        self.create_subscription(PathMsg, PLAN, self._on_plan, RELIABLE, **brief)
        for action in DRIVES:
            take = partial(self._on_drives, action)
            self.create_subscription(GoalStatusArray, f"{action}/_action/status", take, LATCHED, **brief)
        self._tellers = {
            "plan": tellers_of(self, PLAN, self._forget_plan),
            RUN_TREE: tellers_of(self, RUN_TREE, self._forget_tree),
        }
        self.create_subscription(
            MarkerArray, USER_MARKERS, self._on_people, RELIABLE, newest_only=True, **brief
        )
        self._tree: bytes | None = None
        self._tree_due = -math.inf
        checked = self._checked(self._on_tree, RUN_TREE, RunTreeMsg, None, judge_stamps=False)
        self._decode_tree = self._decoded(checked, RUN_TREE, RunTreeMsg)
        self.create_subscription(RunTreeMsg, RUN_TREE, self._on_tree_bytes, LATCHED, raw=True, **brief)
        self.create_subscription(PoseWithCovarianceStamped, AMCL_POSE, self._on_pose, LATCHED, **brief)
        self.create_timer(FOLLOW_S, self._follow_robot)
        page.begin_to_ask()
        call_every(self.steady, ASK_S, page.ask_mission_server)
        call_every(self.steady, ENDED_LOOK_S, self._look_what_has_ended)  # a simulation that died has no time

    def want(self, wanted: frozenset[str]) -> None:
        """Listen to the layers that somebody wants to see, and to no others."""
        self.wanted = wanted
        for name in wanted & LAYERS.keys() - self._layers.keys():
            self._layers[name] = self._listen_to(name)
        for name in self._layers.keys() - wanted:
            self.destroy_subscription(self._layers.pop(name))
            self._tellers.pop(name, None)
            self._parts.put(name, None)

    def _listen_to(self, name: str) -> Any:
        if name == CAMERA:
            return self.create_subscription(
                Image, LAYERS[name], self._on_camera, SENSOR, event_callbacks=NO_EVENTS
            )
        take = partial(self._on_costmap, name)
        self._tellers[name] = tellers_of(self, LAYERS[name], partial(self._parts.put, name, None))
        return self.create_subscription(
            OccupancyGridMsg, LAYERS[name], take, LATCHED, event_callbacks=NO_EVENTS
        )

    def _on_costmap(self, name: str, message: OccupancyGridMsg) -> None:
        if name not in self._layers:
            return  # of the subscription before, which is not gone yet
        grid = grid_from_ros(message)
        try:
            frame = self._tf.buffer.lookup_pose(MAP_FRAME, message.header.frame_id)
        except TransformUnavailable:
            return
        placed = _placed(grid, self._page.add_picture(name, costmap_picture(grid)))
        self._parts.put(name, placed | {"origin": _pose(frame @ grid.origin)})
        self._tellers[name].heard()

    def _on_camera(self, message: Image) -> None:
        now = self.steady.now()
        if CAMERA not in self._layers or now < self._next_picture:
            return
        self._next_picture = now + CAMERA_S
        try:
            colours = colours_from_ros(message)
        except FrameError as error:
            self.get_logger().warning(f"no picture of the camera: {error}", throttle_duration_sec=60.0)
            return
        self._parts.put(CAMERA, {"version": self._page.add_picture(CAMERA, camera_picture(colours))})
        self._silence.heard(CAMERA)

    def close(self) -> None:
        """Take what is not heard any more out of the picture."""
        self._scene = {}
        self._show(pose=None, scan=[], people=[])
        self._forget_plan()
        self._forget_tree()
        for name in self._layers:
            self._parts.put(name, None)

    def _look_what_has_ended(self) -> None:
        for tellers in self._tellers.values():
            tellers.look()
        for name in self._silence.take_ended():
            if name == CAMERA:
                self._parts.put(CAMERA, None)
            elif name == "pose":
                self._scene.pop("deviation", None)
                self._show(pose=None)
            else:
                self._show(**{name: []})

    def _forget_plan(self) -> None:
        self._parts.put("plan", [])

    def _forget_tree(self) -> None:
        self._tree = None
        self._page.show_tree(RunTree())

    def _show(self, **changes: Any) -> None:
        self._scene |= changes
        self._parts.put("scene", self._scene)

    def _follow_robot(self) -> None:
        try:
            pose = self._tf.buffer.lookup_pose(MAP_FRAME, BASE_FRAME)
            stamp = self._tf.buffer.newest_between(MAP_FRAME, BASE_FRAME)
        except TransformUnavailable:
            self._show(pose=None)
        else:
            if stamp is None or stamp != self._pose_stamp:
                self._pose_stamp = stamp
                self._silence.heard("pose")
                self._show(pose=_pose(pose))
        self._show_scan()
        self._show_tree()

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        variances = np.asarray(message.pose.covariance)[[0, 7, 35]]
        self._show(deviation=[_m(each) for each in np.sqrt(np.maximum(variances, 0.0)).tolist()])

    def _on_scan(self, message: LaserScanMsg) -> None:
        self._scan = scan_from_ros(message)  # shown when the transforms of its time have come

    def _show_scan(self) -> None:
        scan = self._scan
        if scan is None:
            return
        try:
            sensor = self._tf.buffer.lookup(MAP_FRAME, scan.frame_id, self.time_of(scan.middle_stamp))
        except TransformUnavailable:
            return
        self._scan = None
        ends = beam_ends(scan, sensor, scan.range_min)
        self._show(scan=np.round(ends[:: -(-len(ends) // MOST_SCAN_POINTS) or 1], 2).ravel().tolist())
        self._silence.heard("scan")

    def _on_drives(self, action: str, message: GoalStatusArray) -> None:
        """Take the way away when the last drive is over."""
        before = bool(self._driving)
        drives = any(goal.status in ACTIVE_GOALS for goal in message.status_list)
        self._driving = self._driving | {action} if drives else self._driving - {action}
        if before and not self._driving:
            self._forget_plan()

    def _on_plan(self, message: PathMsg) -> None:
        self._tellers["plan"].heard()
        poses = message.poses[::4] + message.poses[-1:]
        self._parts.put("plan", [[_m(each.pose.position.x), _m(each.pose.position.y)] for each in poses])

    def _on_people(self, message: MarkerArray) -> None:
        people = []
        for marker in message.markers:
            if marker.ns != "user_text":
                continue
            try:
                frame = self._tf.buffer.lookup(MAP_FRAME, marker.header.frame_id)
            except TransformUnavailable:
                continue
            place = marker.pose.position
            x, y, _ = frame.apply(np.array([[place.x, place.y, place.z]]))[0].tolist()
            people.append({"id": marker.id, "text": marker.text, "x": _m(x), "y": _m(y)})
        self._show(people=people)
        self._silence.heard("people")

    def _on_tree_bytes(self, serialised: bytes) -> None:
        self._tree = serialised
        self._tellers[RUN_TREE].heard()

    def _show_tree(self) -> None:
        """Decode the newest tree, as often as its size allows: 2,000 nodes take a quarter second."""
        begin = self.steady.now()
        if self._tree is None or begin < self._tree_due:
            return
        tree, self._tree = self._tree, None
        self._decode_tree(tree)
        end = self.steady.now()
        self._tree_due = end + (end - begin) / TREE_SHARE

    def _on_tree(self, message: RunTreeMsg) -> None:
        self._page.show_tree(run_tree_from_ros(message))


def _percent(battery: BatteryCharge | None) -> int | None:
    return None if battery is None or battery.charge is None else round(100.0 * battery.charge)


def _was(battery: Heard[BatteryCharge]) -> str | None:
    """Say how full the battery was when its driver spoke last; None when it did not know."""
    percent = _percent(battery.last)
    return None if percent is None else f"{percent} % {age_text(battery.age)} ago"


def _m(value: float) -> float:
    """Round metres for a picture."""
    return round(float(value), 3)


def _pose(pose: Pose2) -> list[float]:
    return [_m(pose.x), _m(pose.y), _m(pose.yaw)]


def _placed(grid: OccupancyGrid, version: list[int]) -> dict[str, Any]:
    rows, columns = grid.cells.shape
    size = [_m(columns * grid.resolution), _m(rows * grid.resolution)]
    return {"origin": _pose(grid.origin), "size": size, "version": version, "cells": [columns, rows]}
