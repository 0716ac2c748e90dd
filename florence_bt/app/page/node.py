"""What the page shows, from the topics of a running system: a node of ROS that gathers, and moves nothing."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from action_msgs.msg import GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from florence_interfaces.msg import ManualOverride, RunState, StopReason, Zones
from florence_interfaces.srv import AnswerQuestion
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Path as PathMsg
from py_trees_ros_interfaces.msg import BehaviourTree
from rclpy.qos import QoSProfile
from sensor_msgs.msg import BatteryState, Image
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from florence_bt.app.page.endings import Silence, Tellers
from florence_bt.app.page.parts import LiveParts, ShownNode, places_part, tree_parts
from florence_bt.app.page.pictures import camera_picture, costmap_picture, map_picture
from florence_bt.app.runs.client import ACTIVE_STATES, is_paused
from florence_bt.core.beam_ends import beam_ends
from florence_bt.core.clock import call_every
from florence_bt.core.errors import FrameError
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.message_skills import AskedQuestion
from florence_bt.core.sensing import LaserScan, OccupancyGrid
from florence_bt.core.topics import ZONES
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.ros.conversions import colours_from_ros, grid_from_ros, pose_from_ros, scan_from_ros
from florence_bt.ros.late_nodes import LateNodes
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, NO_EVENTS, RELIABLE, SENSOR, STATE
from florence_bt.ros.server_processes import DiscoveredServers
from florence_bt.ros.tf import TransformListener
from florence_bt.ros.topics import HOTSPOTS, OVERRIDE_STATE
from florence_bt.skills.locator.hotspots import Hotspots
from florence_bt.skills.locator.markers import hotspots_from_ros

MAP_FRAME, BASE_FRAME = "map", "base_link"
FOLLOW_S = 0.1
"""How often the robot's pose is looked up."""
MOST_POINTS = 240
"""Points of a scan that are shown: one in 1.5 degrees of a whole circle."""
SCENE, CAMERA = "scene", "camera"
LAYERS = {
    "global_costmap": "global_costmap/costmap",
    "local_costmap": "local_costmap/costmap",
    CAMERA: "camera/rgb/image_color",
}
"""What is shown on request -> its topic."""
WANTS = frozenset({SCENE, *LAYERS})
"""What a viewer can want to see; what comes seldom is always there."""
CAMERA_S = 0.5
"""Seconds between two pictures of the camera, at least."""
QUESTIONS_S = 3.0
"""Seconds for which the mission server's word about open questions counts. It is asked twice a second."""
SILENT_S = 3.0
"""Seconds of silence after which what comes several times a second has ended: the pose, scans, people, the
camera's pictures. Chosen: a busy machine holds a message up by less."""
LOOK_S = 1.0
"""How often is looked what has ended."""
GONE = "GONE"
"""The state of a run whose mission server is gone."""
DRIVES = ("navigate_to_pose", "navigate_through_poses")
"""The actions of Nav2 whose drives have a way. It does not publish that there is none any more."""
ACTIVE_GOALS = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING, GoalStatus.STATUS_CANCELING)
TREE = "florence_bt/snapshots"
TREE_SHARE = 0.08
"""Part of the time that goes into the tree, at most."""
LOCALISER = "Place in the map"
"""End of the name of the diagnosis that tells how sure the localiser is."""


OLD_S = 1.5
"""Seconds without a word after which what somebody has said is old; each of them speaks twice a second."""
BASE, MISSIONS = "base", "missions"
ASK_S = 0.5
"""How often the mission server is asked whether a mission waits for an answer, while somebody looks."""


class HeardOverride(NamedTuple):
    """What the base's driver has said about the manual override, and when: in steady seconds."""

    state: ManualOverride
    heard_at: float


class PageNode(FlorenceNode):
    """Gathers what the page shows. While nobody looks it hears only what comes seldom.

    Args:
        context: The ROS context.

    Attributes:
        parts: What viewers are sent.
        pictures: By name: ``map`` and the costmaps as PNG, the camera's as JPEG.
        places: The rooms and objects of the locator.
        override: What the base's driver has said last about the manual override; None when it never has.
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
            "said": "",
            "sure": None,
            "late": None,
        }
        self.override: HeardOverride | None = None
        self.on_stop: Callable[[], None] = lambda: None
        self._made_at = self._missions_heard_at = self.steady.now()
        self._run: dict[str, Any] = {}
        self._questions: tuple[AskedQuestion, ...] = ()
        self._questions_until = -math.inf
        self._answers = self.create_client(AnswerQuestion, "florence_bt/answer")
        self._asked: Any = None
        self._asked_until = -math.inf
        self._tellers: list[Tellers] = []
        self._subscribe_to_states()
        self._put()
        self.create_timer(LOOK_S, self._look_who_is_left)
        self.create_timer(ASK_S, self._note_silence)

    @property
    def simulated(self) -> bool:
        """Whether a simulation says what time it is."""
        return self.count_publishers("clock") + self.count_publishers("/clock") > 0

    @property
    def overridden(self) -> bool:
        """Whether the manual override is on, as far as the base's driver has said."""
        return self.override is not None and self.override.state.on

    def add_picture(self, name: str, data: bytes) -> list[int]:
        """Keep a picture; return its version, which no other one has had."""
        self.pictures[name] = data
        return [next(self._versions)]

    def show_speeds(self, speeds: Twist2) -> None:
        """Show how fast a hand drives the robot: metres and radians a second."""
        self._put(speeds=[round(speeds.linear, 2), round(speeds.angular, 2)])

    @property
    def questions(self) -> tuple[AskedQuestion, ...]:
        """What missions wait to be answered, by the last word of the mission server, while that is new."""
        return self._questions if self.steady.now() < self._questions_until else ()

    def take_away(self, question: AskedQuestion) -> None:
        """Show a question no longer: it has its answer."""
        self._questions = tuple(each for each in self._questions if each != question)

    def begin_to_ask(self) -> None:
        """Take note that somebody has begun to look: the mission server is asked from now on."""
        self._missions_heard_at = self.steady.now()

    def look_for_questions(self) -> None:
        """Ask the mission server for open questions, one call at a time; that it answers shows it lives."""
        now = self.steady.now()
        if not self._answers.service_is_ready():
            self._questions = ()
        elif self._asked is None or self._asked.done() or now >= self._asked_until:
            if self._asked is not None:
                self._answers.remove_pending_request(self._asked)
            self._asked = self._answers.call_async(AnswerQuestion.Request())
            self._asked_until = now + QUESTIONS_S
            self._asked.add_done_callback(self.guarded(self._on_questions))

    def _on_questions(self, asked: Any) -> None:
        self._missions_heard_at = self.steady.now()
        self._questions_until = self._missions_heard_at + QUESTIONS_S
        self._questions = tuple(
            AskedQuestion(each.id, each.text, tuple(each.choices)) for each in asked.result().questions
        )

    def _note_silence(self) -> None:
        """Tell viewers who has said nothing for how many whole seconds, of those whose word is shown."""
        now = self.steady.now()
        base = self._made_at if self.override is None else self.override.heard_at
        heard = {BASE: base, MISSIONS: self._missions_heard_at}
        self.parts.put("silent", {who: int(now - at) for who, at in heard.items() if now - at > OLD_S})

    # ---- what comes seldom ----------------------------------------------------------------------------

    def _subscribe_to_states(self) -> None:
        self.create_subscription(OccupancyGridMsg, "map", self._on_map, LATCHED)
        self.create_subscription(MarkerArray, HOTSPOTS, self._on_hotspots, LATCHED)
        self.create_subscription(Zones, ZONES.name, self._on_zones, LATCHED)
        self.create_subscription(ManualOverride, OVERRIDE_STATE, self._on_override, LATCHED)
        self.create_subscription(DiagnosticArray, "diagnostics", self._on_diagnostics, RELIABLE)
        self._late = LateNodes(self)
        run, goal = "florence_bt/run_state", "navigate/current_goal"
        self._show_told(RunState, run, self._on_run, LATCHED, gone=self._lose_run)
        self._show_told(PoseStamped, goal, self._on_goal, LATCHED, gone=lambda: self.parts.put("goal", None))
        stop, battery = "turtlebot_node/stop_reason", "battery_state"
        self._show_told(StopReason, stop, self._on_stop, LATCHED, gone=lambda: self._put(stop=""))
        self._show_told(BatteryState, battery, self._on_battery, STATE, gone=lambda: self._put(battery=None))
        self._show_told(String, "speaking", self._on_speaking, LATCHED, gone=lambda: self._put(said=""))
        # The localiser says in the same breath how sure it is.
        self._sure = tellers_of(self, "amcl_pose", lambda: self._put(sure=None))
        self._tellers.append(self._sure)

    def _show_told(
        self,
        kind: Any,
        topic: str,
        take: Callable[[Any], None],
        qos: QoSProfile,
        *,
        gone: Callable[[], None],
    ) -> None:
        """Take what a topic tells until nobody is left who has told it."""
        tellers = tellers_of(self, topic, gone)
        self._tellers.append(tellers)

        def on_message(message: Any) -> None:
            take(message)
            tellers.heard()

        self.create_subscription(kind, topic, on_message, qos)

    def _look_who_is_left(self) -> None:
        for tellers in self._tellers:
            tellers.look()

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

    def _on_run(self, message: RunState) -> None:
        names = ("run_id", "mission", "state", "code", "reason")
        self._run = {name: getattr(message, name) for name in names} | {"paused": is_paused(message)}
        self.parts.put("run", self._run)

    def _lose_run(self) -> None:
        """Say of a run that nobody knows how it stands; one that had ended has ended."""
        if self._run["state"] in ACTIVE_STATES:
            self._run |= {"state": GONE, "reason": "its mission server is gone"}
            self.parts.put("run", self._run)

    def _on_goal(self, message: PoseStamped) -> None:
        self.parts.put("goal", _pose(pose_from_ros(message.pose)) if message.header.frame_id else None)

    def _on_stop(self, message: StopReason) -> None:
        self._put(stop=message.text)

    def _on_override(self, message: ManualOverride) -> None:
        if message.on and self.override is not None and message.stops != self.override.state.stops:
            self.on_stop()
        self.override = HeardOverride(message, self.steady.now())
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

    def _on_speaking(self, message: String) -> None:
        self._put(said=message.data)

    def _on_battery(self, message: BatteryState) -> None:
        known = math.isfinite(message.percentage)
        self._put(battery=round(100.0 * message.percentage) if known else None)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        late = "; ".join(self._late.sentences()) or None
        if late != self._state["late"]:
            self._put(late=late)
        for status in message.status:
            if status.name.endswith(LOCALISER):
                self._put(sure=status.message if status.level == status.OK else f"unsure: {status.message}")
                self._sure.heard()


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
        self._silence = Silence(self.steady, SILENT_S)
        self._pose_stamp: float | None = None
        self._driving: set[str] = set()
        self._next_picture = -math.inf
        self._scene: dict[str, Any] = {"pose": None, "scan": [], "people": []}
        self._scan: LaserScan | None = None
        self._tf = TransformListener(self)
        brief: dict[str, Any] = {"event_callbacks": NO_EVENTS}
        self.create_subscription(LaserScanMsg, "filtered_scan", self._on_scan, SENSOR, **brief)
        self.create_subscription(PathMsg, "plan", self._on_plan, RELIABLE, **brief)
        for action in DRIVES:
            take = partial(self._on_drives, action)
            self.create_subscription(GoalStatusArray, f"{action}/_action/status", take, LATCHED, **brief)
        self._tellers = {
            "plan": tellers_of(self, "plan", self._forget_plan),
            TREE: tellers_of(self, TREE, self._forget_tree),
        }
        self.create_subscription(
            MarkerArray, "user_markers", self._on_people, RELIABLE, newest_only=True, **brief
        )
        self._tree: bytes | None = None
        self._tree_due = -math.inf
        self._decode_tree = self._decoded(self._on_tree, TREE, BehaviourTree)
        self.create_subscription(BehaviourTree, TREE, self._on_tree_bytes, LATCHED, raw=True, **brief)
        self.create_subscription(PoseWithCovarianceStamped, "amcl_pose", self._on_pose, LATCHED, **brief)
        self.create_timer(FOLLOW_S, self._follow_robot)
        page.begin_to_ask()
        call_every(self.steady, ASK_S, page.look_for_questions)
        call_every(self.steady, LOOK_S, self._look_what_has_ended)  # a simulation that died has no time

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
        for name, value in tree_parts([], {}).items():
            self._parts.put(name, value)

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
        self._show(scan=np.round(ends[:: -(-len(ends) // MOST_POINTS) or 1], 2).ravel().tolist())
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
        self._tellers[TREE].heard()

    def _show_tree(self) -> None:
        """Decode the newest tree, as often as its size allows: 2,000 nodes take a quarter second."""
        begin = self.steady.now()
        if self._tree is None or begin < self._tree_due:
            return
        tree, self._tree = self._tree, None
        self._decode_tree(tree)
        end = self.steady.now()
        self._tree_due = end + (end - begin) / TREE_SHARE

    def _on_tree(self, message: BehaviourTree) -> None:
        numbers = {bytes(node.own_id.uuid): number for number, node in enumerate(message.behaviours)}
        nodes = [
            ShownNode(
                node.name,
                numbers.get(bytes(node.parent_id.uuid), -1),
                node.type,
                node.status,
                node.message,
                node.is_active,
            )
            for node in message.behaviours
        ]
        keys = {each.key: each.value for each in message.blackboard_on_visited_path}
        for name, value in tree_parts(nodes, keys).items():
            self._parts.put(name, value)


def tellers_of(node: FlorenceNode, topic: str, gone: Callable[[], object]) -> Tellers:
    """Return who publishes a topic, with what to do when nobody is left who has told it."""
    name = node.resolve_topic_name(topic)
    return Tellers(DiscoveredServers(lambda: node.get_publishers_info_by_topic(name)).ids, gone)


def _m(value: float) -> float:
    """Round metres for a picture."""
    return round(float(value), 3)


def _pose(pose: Pose2) -> list[float]:
    return [_m(pose.x), _m(pose.y), _m(pose.yaw)]


def _placed(grid: OccupancyGrid, version: list[int]) -> dict[str, Any]:
    rows, columns = grid.cells.shape
    size = [_m(columns * grid.resolution), _m(rows * grid.resolution)]
    return {"origin": _pose(grid.origin), "size": size, "version": version, "cells": [columns, rows]}
