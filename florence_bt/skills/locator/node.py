"""The locator on ROS (``florenceLocator``): every service of the document's table 11."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from florence_interfaces.msg import DetectedUser, RunState, UserSeen, Zones
from florence_interfaces.srv import (
    GetHotspot,
    GetRoom,
    GetStatus,
    GetUserSeen,
    GetViews,
    GetXYPhi,
    GotoRoom,
    GotoXYPhi,
    RunMission,
    SetHotspot,
    SetRoom,
    SetXYPhi,
    StopMission,
)
from geometry_msgs.msg import PoseStamped
from nav2_msgs.msg import CostmapFilterInfo
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from std_msgs.msg import Bool, Header
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.heard import old_after_s
from florence_bt.core.limits import CheckedParameters, Positive
from florence_bt.core.outcome import Result
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.core.zones import Zone
from florence_bt.ros.answers import Deferred
from florence_bt.ros.conversions import grid_from_ros, grid_to_ros, pose_from_ros, pose_to_ros, stamp_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.tf import TransformListener
from florence_bt.ros.topics import (
    CURRENT_GOAL,
    DETECTED_USER,
    HOTSPOTS,
    MANUAL_OVERRIDE,
    MAP,
    RUN_STATE,
    USER_SEEN,
    ZONES,
)
from florence_bt.ros.zones import zones_to_ros
from florence_bt.skills.locator.habits import RoomHabits, load_habits
from florence_bt.skills.locator.hotspot_file import HotspotFile
from florence_bt.skills.locator.hotspots import OBJECT, ROOM_NAMES, Hotspot, Hotspots, load_hotspots
from florence_bt.skills.locator.locator import LastSeen, Locator
from florence_bt.skills.locator.markers import hotspots_to_ros

RUN_SERVICE, STOP_SERVICE = "florence_bt/run_mission", "florence_bt/stop"
ANSWER_WITHIN_S = 5.0
"""Of this machine's time: the speed of a simulation does not matter to the mission server."""
CALLER = "florenceLocator"
TRANSFORM_PERIOD_S = 1.0
"""Seconds between two transforms of a robot that stands, at most: ours come once a second then."""
SAVE_PERIOD_S = 60.0
"""Between two looks whether the habits of the user are to be saved."""

Answer = Callable[[bool, str, str], None]
"""Called with whether a mission was accepted, the reason, and the run's id."""


@dataclass(frozen=True, slots=True)
class LocatorNodeParameters(CheckedParameters):
    """Parameters of the locator.

    Attributes:
        hotspots_file: The YAML file of the hotspots; empty for none. New hotspots are written there.
        initial_user_room: The room to believe the user in at the start; empty for none.
        room_names: A taught hotspot with one of these labels, perhaps with a number behind it, is a room; one
            with another label is an object.
        max_vel_x: What limits in per cent are of in the mask for Nav2's speed filter, m/s.
        habits_file: Keeps in which rooms the user was seen at which hour; empty for nowhere.
        map_frame: The frame of the map.
        base_frame: The robot's frame.

    Source:
        Document, section 3.8.
    """

    hotspots_file: str = ""
    initial_user_room: str = ""
    room_names: tuple[str, ...] = ROOM_NAMES
    max_vel_x: Positive = 0.45
    habits_file: str = ""
    map_frame: str = "map"
    base_frame: str = "base_link"


class LocatorNode(FlorenceNode):
    """Serves ``florenceLocator/*``.

    Args:
        parameters: Overrides of the node's parameters.

    Raises:
        ConfigError: The hotspot file or the initial room is wrong.
    """

    parameter_classes = (LocatorNodeParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("florenceLocator", parameters=parameters)
        self._params = self.read_parameters(LocatorNodeParameters)
        file = self._params.hotspots_file
        hotspots = load_hotspots(file) if file else Hotspots()
        self._locator = Locator(
            hotspots,
            self.timebase,
            self._params.initial_user_room,
            self._load_habits(self._params.habits_file),
            self._params.room_names,
        )
        self._tf = TransformListener(self)
        self._missions = _MissionClient(self)
        self.create_subscription(Bool, MANUAL_OVERRIDE, self._on_override, LATCHED)
        self.create_subscription(DetectedUser, DETECTED_USER, self._on_detected, RELIABLE)
        self.create_subscription(UserSeen, USER_SEEN, self._on_user_seen, LATCHED)
        self.create_subscription(RunState, RUN_STATE, self._on_run_state, LATCHED)
        self.create_subscription(PoseStamped, CURRENT_GOAL, self._on_goal, LATCHED)
        self.create_subscription(OccupancyGridMsg, MAP, self._on_map, LATCHED)
        self._hotspots = self.create_publisher(MarkerArray, HOTSPOTS, LATCHED)
        self._zones = self.create_publisher(Zones, ZONES, LATCHED)
        self._filters = _FilterMasks(self, self._params)
        self._tell_hotspots()
        self._tell_zones()
        self._create_getters()
        self._create_setters()
        self._create_gotos()
        call_every(self.steady, SAVE_PERIOD_S, self._save_habits)
        self.on_close(self._save_habits)

    # ---- habits ---------------------------------------------------------------------------------------

    def _load_habits(self, file: str) -> RoomHabits:
        try:
            return load_habits(Path(file)) if file else RoomHabits()
        except ConfigError as error:
            self.get_logger().warning(f"{error}; counting begins again")
            return RoomHabits()

    def _save_habits(self) -> None:
        if not self._params.habits_file or not self._locator.habits.unsaved:
            return
        try:
            self._locator.habits.save(Path(self._params.habits_file))
        except ConfigError as error:
            self.get_logger().warning(str(error), throttle_duration_sec=600.0)

    # ---- topics ---------------------------------------------------------------------------------------

    def _on_override(self, message: Bool) -> None:
        self._locator.override = bool(message.data)

    def _on_detected(self, message: DetectedUser) -> None:
        if not message.command:
            return
        x, y = message.user_position_x, message.user_position_y
        robot = self._robot_pose()
        result = self._locator.set_user_position(
            Pose2(x, y, Pose2(x, y).bearing_to(robot.x, robot.y) if robot else 0.0), DETECTED_USER
        )
        if not result.succeeded:
            self.health.count_refused(DETECTED_USER, result.reason)

    def _on_user_seen(self, message: UserSeen) -> None:
        since, at = (self.time_of(stamp_from_ros(told)) for told in (message.since, message.stamp))
        seen = LastSeen(message.source, since, at)
        result = self._locator.take_sighting(message.room, seen)
        if not result.succeeded:
            self.get_logger().warning(f"{USER_SEEN}: {result.reason}", throttle_duration_sec=60.0)

    def _on_run_state(self, message: RunState) -> None:
        self._locator.take_run_state(message.state)

    def _on_goal(self, message: PoseStamped) -> None:
        """Take the goal of a drive; that a drive is over, and has none, leaves the last one."""
        goal = pose_from_ros(message.pose)
        if message.header.frame_id and goal.is_finite():
            self._locator.goal = goal

    def _on_map(self, message: OccupancyGridMsg) -> None:
        try:
            self._locator.map = grid_from_ros(message)
        except FlorenceError as error:
            self.get_logger().warning(f"the map is left out: {error}")
        else:
            self._filters.publish(self._locator.hotspots.zones, self._locator.map)

    # ---- getters --------------------------------------------------------------------------------------

    def _create_getters(self) -> None:
        poses: dict[str, Callable[[], Pose2 | None]] = {
            "User": lambda: self._locator.user,
            "Robot": self._robot_pose,
            "Goal": lambda: self._locator.goal,
        }
        for name, pose_of in poses.items():
            self._serve(GetRoom, f"get{name}PosRoom", self._room_answer(pose_of))
            self._serve(GetXYPhi, f"get{name}PosXYPhi", _pose_answer(pose_of))
        self._serve(GetUserSeen, "getUserSeen", self._on_get_user_seen)
        self._serve(GetHotspot, "getHotspot", self._on_get_hotspot)
        self._serve(GetViews, "getViews", self._on_get_views)
        self._serve(Trigger, "getRooms", self._on_get_rooms)
        self._serve(GetStatus, "getStatus", self._on_get_status)

    def _room_answer(self, pose_of: Callable[[], Pose2 | None]) -> Callable[..., GetRoom.Response]:
        def answer(request: GetRoom.Request, response: GetRoom.Response) -> GetRoom.Response:
            response.room = self._locator.room_of_pose(pose_of())
            response.valid = bool(response.room)
            return response

        return answer

    def _on_get_user_seen(
        self, request: GetUserSeen.Request, response: GetUserSeen.Response
    ) -> GetUserSeen.Response:
        result = self._locator.get_user_room()
        response.valid = result.succeeded
        if result.succeeded:
            seen = result.outputs
            response.room, response.source, response.age = seen["room"], seen["source"], seen["age"]
        return response

    def _on_get_hotspot(
        self, request: GetHotspot.Request, response: GetHotspot.Response
    ) -> GetHotspot.Response:
        return _with_pose(response, self._locator.get_hotspot(request.label))

    def _on_get_views(self, request: GetViews.Request, response: GetViews.Response) -> GetViews.Response:
        result = self._locator.get_views(request.room)
        response.valid, response.message = result.succeeded, result.reason
        response.poses = [pose_to_ros(pose) for pose in result.outputs.get("poses", ())]
        return response

    def _on_get_rooms(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._robot_pose()
        response.success, response.message = True, ", ".join(self._locator.likely_rooms())
        return response

    def _on_get_status(self, request: GetStatus.Request, response: GetStatus.Response) -> GetStatus.Response:
        response.status = self._locator.status
        return response

    def _robot_pose(self) -> Pose2 | None:
        """Return where the robot is now; None when that is not known, or was known last some time ago."""
        frames = self._params.map_frame, self._params.base_frame
        try:
            self._locator.robot = self._tf.buffer.lookup_pose(*frames)
        except TransformUnavailable:
            self._locator.robot = None
        newest = self._tf.buffer.newest_between(*frames)
        if newest is not None and self.timebase.now() - newest > old_after_s(TRANSFORM_PERIOD_S):
            self._locator.robot = None
        return self._locator.robot

    # ---- setters --------------------------------------------------------------------------------------

    def _create_setters(self) -> None:
        self._serve(SetHotspot, "setHotspot", self._on_set_hotspot)
        self._serve(Trigger, "reloadHotspots", self._on_reload)
        self._serve(SetRoom, "setUserPosRoom", self._on_set_user_room)
        self._serve(SetXYPhi, "setUserPosXYPhi", self._on_set_user_position)

    def _on_set_hotspot(
        self, request: SetHotspot.Request, response: SetHotspot.Response
    ) -> SetHotspot.Response:
        before = self._locator.hotspots.copy()
        result = self._locator.set_hotspot(request.label, _pose_of(request))
        response.success, response.message = result.succeeded, result.reason
        if result.succeeded:
            response.success, response.message = self._save(result.outputs["hotspot"])
        if not response.success:
            self._locator.hotspots = before
        return response

    def _save(self, hotspot: Hotspot) -> tuple[bool, str]:
        file = self._params.hotspots_file
        if not file:
            self._tell_hotspots()
            return True, f"kept as {_a(hotspot.kind)} until the node ends: it has no hotspots_file"
        try:
            changed = HotspotFile(file)
            changed.put(hotspot)
            changed.save()
        except ConfigError as error:
            return False, f"not saved, and not kept: {error}"
        self._use(changed.hotspots)
        return True, f"saved as {_a(hotspot.kind)} in {file}"

    def _on_reload(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        file = self._params.hotspots_file
        try:
            hotspots = load_hotspots(file) if file else self._locator.hotspots
        except ConfigError as error:
            response.success, response.message = False, f"the hotspots stay as they were: {error}"
            return response
        self._use(hotspots)
        counts = f"hotspots: {len(hotspots)}, zones: {len(hotspots.zones)}"
        response.success, response.message = True, f"{counts}, of {file or 'no file'}"
        return response

    def _use(self, hotspots: Hotspots) -> None:
        """Take over the hotspots of a file that was changed."""
        changed = hotspots.zones != self._locator.hotspots.zones
        self._locator.hotspots = hotspots
        self._tell_hotspots()
        if changed:
            self._tell_zones()

    def _tell_hotspots(self) -> None:
        self._hotspots.publish(hotspots_to_ros(self._locator.hotspots, self._map_header()))

    def _tell_zones(self) -> None:
        zones = self._locator.hotspots.zones
        self._zones.publish(zones_to_ros(zones, self._map_header()))
        self._filters.publish(zones, self._locator.map)

    def _map_header(self) -> Header:
        return Header(frame_id=self._params.map_frame)

    def _on_set_user_room(self, request: SetRoom.Request, response: SetRoom.Response) -> SetRoom.Response:
        result = self._locator.set_user_room(request.room)
        if not result.succeeded:
            self.get_logger().warning(f"setUserPosRoom: {result.reason}")
        response.success, response.message = result.succeeded, result.reason
        return response

    def _on_set_user_position(
        self, request: SetXYPhi.Request, response: SetXYPhi.Response
    ) -> SetXYPhi.Response:
        result = self._locator.set_user_position(_pose_of(request))
        response.success, response.message = result.succeeded, result.reason
        return response

    # ---- goto -----------------------------------------------------------------------------------------

    def _create_gotos(self) -> None:
        self._serve(Trigger, "gotoUser", self._on_goto_user)
        self._serve(GotoRoom, "gotoRoom", self._on_goto_room)
        self._serve(GotoXYPhi, "gotoXYPhi", self._on_goto_pose)

    def _on_goto_user(
        self, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response | Deferred:
        return self._goto(response, self._locator.why_not_goto_user(), "goto_user", {})

    def _on_goto_room(
        self, request: GotoRoom.Request, response: GotoRoom.Response
    ) -> GotoRoom.Response | Deferred:
        refusal = self._locator.why_not_goto_room(request.room)
        return self._goto(response, refusal, "goto_room", {"room": request.room})

    def _on_goto_pose(
        self, request: GotoXYPhi.Request, response: GotoXYPhi.Response
    ) -> GotoXYPhi.Response | Deferred:
        pose = _pose_of(request)
        inputs = {"x": f"{pose.x:.6f} m", "y": f"{pose.y:.6f} m", "phi": f"{pose.yaw:.6f} rad"}
        return self._goto(response, self._locator.why_not_goto_pose(pose), "goto_pose", inputs)

    def _goto(self, response: Any, refusal: str | None, mission: str, inputs: Mapping[str, str]) -> Any:
        """Refuse at once, or ask for the mission and answer when that was answered."""
        if refusal is not None:
            response.success, response.message = False, refusal
            return response
        later = Deferred()

        def answer(accepted: bool, message: str, run_id: str) -> None:
            response.success, response.message = accepted, message
            if hasattr(response, "run_id"):
                response.run_id = run_id
            later.answer(response)

        self._missions.run(mission, inputs, answer)
        return later

    def _serve(self, service_type: Any, name: str, callback: Callable[..., Any]) -> None:
        self.create_service(service_type, f"florenceLocator/{name}", callback)


class _MissionClient:
    """Asks the mission server to run and stop missions, without waiting for it."""

    def __init__(self, node: FlorenceNode) -> None:
        self._node = node
        self._run = node.create_client(RunMission, RUN_SERVICE)
        self._stop = node.create_client(StopMission, STOP_SERVICE)

    def run(self, mission: str, inputs: Mapping[str, str], answer: Answer) -> None:
        """Ask for a mission in place of what runs now; the answer comes within two seconds in any case."""
        if not self._run.service_is_ready():
            answer(False, f"the mission server is not there: no service {RUN_SERVICE}", "")
            return
        request = RunMission.Request(
            mission=mission,
            input_names=list(inputs),
            input_values=list(inputs.values()),
            caller=CALLER,
            policy="preempt",
        )
        waiting = True

        def too_late() -> None:
            nonlocal waiting
            waiting = False
            answer(False, f"the mission server did not answer within {ANSWER_WITHIN_S:g} s", "")

        def answered(future: Any) -> None:
            message = future.result()
            if waiting:
                timer.cancel()
                answer(message.accepted, message.message, message.run_id)
            elif message.accepted:
                # The caller has the answer that nothing will happen.
                self.stop("accepted too late", message.run_id)

        timer = self._node.steady.call_at(self._node.steady.now() + ANSWER_WITHIN_S, too_late)
        self._run.call_async(request).add_done_callback(self._node.guarded(answered))

    def stop(self, reason: str, run_id: str = "") -> None:
        """Ask for the end of a run, or of the one that has the robot."""
        if self._stop.service_is_ready():
            self._stop.call_async(StopMission.Request(run_id=run_id, reason=reason))


class _FilterMasks:
    """Publishes the zones as Nav2's costmap filters read them, as soon as there is one.

    Source:
        nav2_msgs/CostmapFilterInfo; Nav2, KeepoutFilter and SpeedFilter.
    """

    def __init__(self, node: FlorenceNode, params: LocatorNodeParameters) -> None:
        self._node, self._params = node, params
        self._publishers: dict[str, tuple[Any, Any]] = {}

    def publish(self, zones: Sequence[Zone], grid: OccupancyGrid | None) -> None:
        """Publish both masks; nothing before there is a map and a first zone."""
        if grid is None or not (zones or self._publishers):
            return
        from florence_bt.skills.locator import filter_masks  # loads numpy

        speed = filter_masks.speed_mask(zones, grid, self._params.max_vel_x)
        self._tell("keepout", filter_masks.KEEP_OUT_TYPE, 1.0, filter_masks.keep_out_mask(zones, grid))
        self._tell("speed", filter_masks.SPEED_LIMIT_TYPE, filter_masks.MPS_PER_VALUE, speed)

    def _tell(self, name: str, kind: int, multiplier: float, mask: OccupancyGrid) -> None:
        topic, frame = f"{name}_filter_mask", self._params.map_frame
        if name not in self._publishers:
            self._publishers[name] = (
                self._node.create_publisher(CostmapFilterInfo, f"{name}_filter_info", LATCHED),
                self._node.create_publisher(OccupancyGridMsg, topic, LATCHED),
            )
        info, masks = self._publishers[name]
        info.publish(
            CostmapFilterInfo(
                header=Header(frame_id=frame),
                type=kind,
                filter_mask_topic=self._node.resolve_topic_name(topic),
                multiplier=multiplier,
            )
        )
        masks.publish(grid_to_ros(mask, frame, self._node.stamp()))


def _a(kind: str) -> str:
    return f"an {kind}" if kind == OBJECT else f"a {kind}"


def _with_pose(response: Any, result: Result) -> Any:
    """Fill in the pose that a skill gave, or why there is none."""
    response.valid, response.message = result.succeeded, result.reason
    if result.succeeded:
        pose = result.outputs["pose"]
        response.x, response.y, response.phi = pose.x, pose.y, pose.yaw
    return response


def _pose_answer(pose_of: Callable[[], Pose2 | None]) -> Callable[..., GetXYPhi.Response]:
    def answer(request: GetXYPhi.Request, response: GetXYPhi.Response) -> GetXYPhi.Response:
        pose = pose_of()
        response.valid = pose is not None
        if pose is not None:
            response.x, response.y, response.phi = pose.x, pose.y, pose.yaw
        return response

    return answer


def _pose_of(request: Any) -> Pose2:
    return Pose2(request.x, request.y, request.phi)
