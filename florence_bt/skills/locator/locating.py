"""The locator as a component: who was seen where, the map and the frames in; the answers of table 11 out.

Source: document, section 3.8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from florence_bt.core import topic_names
from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import FramedPose, Pose2
from florence_bt.core.heard import old_after_s
from florence_bt.core.limits import CheckedParameters, Positive
from florence_bt.core.outcome import Result
from florence_bt.core.ports import NOT_SAVED_PERIOD_S, Delivery, Fields, NoFields, Ports, Service, Topic
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.topic_names import HOTSPOTS as HOTSPOTS_TOPIC
from florence_bt.core.topic_names import MANUAL_OVERRIDE, USER_SEEN
from florence_bt.core.topics import FOUND, MAP, RUN_STATE, ZONES, FoundUser, RunState
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.core.zones import Zone
from florence_bt.skills.locator.habits import RoomHabits, load_habits
from florence_bt.skills.locator.hotspot_file import HotspotFile
from florence_bt.skills.locator.hotspots import OBJECT, ROOM_NAMES, Hotspot, Hotspots, load_hotspots
from florence_bt.skills.locator.locator import LastSeen, Locator

SAVE_PERIOD_S = 60.0
"""Between two looks whether the habits of the user are to be saved."""
ROOM_REFUSED_PERIOD_S = 60.0
"""Between two warnings of a room that a home sensor names and nobody knows (chosen)."""


@dataclass(frozen=True, slots=True)
class LocatorParameters(CheckedParameters):
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


@dataclass(frozen=True, slots=True)
class Sighting:
    """The room in which home sensors see the user.

    Attributes:
        room: Its label.
        seen: By what, and when.
    """

    room: str
    seen: LastSeen


@dataclass(frozen=True, slots=True)
class LabelRequest:
    """The request for a hotspot."""

    label: str


@dataclass(frozen=True, slots=True)
class RoomRequest:
    """A request about a room."""

    room: str


@dataclass(frozen=True, slots=True)
class PoseRequest:
    """A request about a pose: map frame, metres, radians."""

    x: float
    y: float
    phi: float = 0.0

    @property
    def pose(self) -> Pose2:
        """The pose."""
        return Pose2(self.x, self.y, self.phi)


@dataclass(frozen=True, slots=True)
class HotspotRequest(PoseRequest):
    """A request to put a hotspot."""

    label: str = ""


TRANSFORM_PERIOD_S = 1.0
"""Seconds between two transforms of a robot that stands, at most: ours come once a second then."""
OVERRIDE = Topic(MANUAL_OVERRIDE, bool, Delivery.LATCHED)
SIGHTINGS = Topic(USER_SEEN, Sighting, Delivery.LATCHED, "florence_interfaces/msg/UserSeen")
GOAL = Topic(topic_names.CURRENT_GOAL, FramedPose, Delivery.LATCHED, "geometry_msgs/msg/PoseStamped")
HOTSPOTS = Topic(HOTSPOTS_TOPIC, Hotspots, Delivery.LATCHED, "visualization_msgs/msg/MarkerArray")


class Locating:
    """Serves ``florenceLocator/*``.

    Args:
        ports: Its connections.
        hotspots: Those of its file.
        parameters: Its own.
        on_zones: Told the zones and the map, as far as it is known, whenever one of them is new.

    Attributes:
        locator: What knows the answers.

    Raises:
        ConfigError: The initial room is wrong.
    """

    def __init__(
        self,
        ports: Ports,
        hotspots: Hotspots,
        parameters: LocatorParameters,
        on_zones: Callable[[Sequence[Zone], OccupancyGrid | None], None] = lambda zones, grid: None,
    ) -> None:
        self._ports, self._p, self._on_zones = ports, parameters, on_zones
        room, names = parameters.initial_user_room, parameters.room_names
        self.locator = Locator(hotspots, ports.clock, room, self._load_habits(), names)
        self._frames = ports.listen_to_frames()
        ports.listen(OVERRIDE, self._take_override)
        ports.listen(FOUND, self._take_found)
        ports.listen(SIGHTINGS, self._take_sighting)
        ports.listen(RUN_STATE, self._take_run_state)
        ports.listen(GOAL, self._take_goal)
        ports.listen(MAP, self._take_map)
        self._hotspots, self._zones = ports.output(HOTSPOTS), ports.output(ZONES)
        self._send_hotspots()
        self._send_zones()
        self._serve_getters()
        self._serve_setters()
        call_every(ports.steady, SAVE_PERIOD_S, self._save_habits)

    def close(self) -> None:
        """Keep the habits of the user."""
        self._save_habits()

    # ---- habits ---------------------------------------------------------------------------------------

    def _load_habits(self) -> RoomHabits:
        file = self._p.habits_file
        try:
            return load_habits(Path(file)) if file else RoomHabits()
        except ConfigError as error:
            self._ports.tell(f"{error}; counting begins again", good=False)
            return RoomHabits()

    def _save_habits(self) -> None:
        if not self._p.habits_file or not self.locator.habits.unsaved:
            return
        try:
            self.locator.habits.save(Path(self._p.habits_file))
        except ConfigError as error:
            self._ports.warn(str(error), RoomHabits, NOT_SAVED_PERIOD_S)

    # ---- topics ---------------------------------------------------------------------------------------

    def _take_override(self, on: bool) -> None:
        self.locator.override = on

    def _take_found(self, user: FoundUser) -> None:
        if not user.command:
            return
        place, robot = Pose2(user.user_position_x, user.user_position_y), self._robot_pose()
        towards = place.bearing_to(robot.x, robot.y) if robot else 0.0
        result = self.locator.set_user_position(Pose2(place.x, place.y, towards), FOUND.name)
        if not result.succeeded:
            self._ports.refuse(FOUND.name, result.reason)

    def _take_sighting(self, sighting: Sighting) -> None:
        result = self.locator.take_sighting(sighting.room, sighting.seen)
        if not result.succeeded:
            self._ports.warn(f"{SIGHTINGS.name}: {result.reason}", SIGHTINGS, ROOM_REFUSED_PERIOD_S)

    def _take_run_state(self, run: RunState) -> None:
        self.locator.take_run_state(run.state)

    def _take_goal(self, goal: FramedPose) -> None:
        """Take the goal of a drive; that a drive is over, and has none, leaves the last one."""
        if goal.frame and not goal.problem and goal.pose.is_finite():
            self.locator.goal = goal.pose

    def _take_map(self, grid: OccupancyGrid) -> None:
        self.locator.map = grid
        self._on_zones(self.locator.hotspots.zones, grid)

    def _robot_pose(self) -> Pose2 | None:
        """Return where the robot is now; None when that is not known, or was known last some time ago."""
        frames, buffer = (self._p.map_frame, self._p.base_frame), self._frames.buffer
        try:
            self.locator.robot = buffer.lookup_pose(*frames)
        except TransformUnavailable:
            self.locator.robot = None
        newest = buffer.newest_between(*frames)
        if newest is not None and self._ports.clock.now() - newest > old_after_s(TRANSFORM_PERIOD_S):
            self.locator.robot = None
        return self.locator.robot

    # ---- getters --------------------------------------------------------------------------------------

    def _serve_getters(self) -> None:
        poses: dict[str, Callable[[], Pose2 | None]] = {
            "User": lambda: self.locator.user,
            "Robot": self._robot_pose,
            "Goal": lambda: self.locator.goal,
        }
        for name, pose_of in poses.items():
            self._serve(f"get{name}PosRoom", "GetRoom", NoFields, self._room_answer(pose_of))
            self._serve(f"get{name}PosXYPhi", "GetXYPhi", NoFields, _pose_answer(pose_of))
        self._serve("getUserSeen", "GetUserSeen", NoFields, self._get_user_seen)
        self._serve("getHotspot", "GetHotspot", LabelRequest, self._get_hotspot)
        self._serve("getViews", "GetViews", RoomRequest, self._get_views)
        self._ports.serve(Service("florenceLocator/getRooms", "std_srvs/srv/Trigger"), self._get_rooms)
        self._serve("getStatus", "GetStatus", NoFields, lambda _: {"status": self.locator.status})

    def _room_answer(self, pose_of: Callable[[], Pose2 | None]) -> Callable[[NoFields], Fields]:
        def answer(_: NoFields) -> Fields:
            room = self.locator.room_of_pose(pose_of())
            return {"room": room, "valid": bool(room)}

        return answer

    def _get_user_seen(self, _: NoFields) -> Fields:
        result = self.locator.get_user_room()
        return {"valid": result.succeeded, **result.outputs}

    def _get_hotspot(self, request: LabelRequest) -> Fields:
        result = self.locator.get_hotspot(request.label)
        answer = {"valid": result.succeeded, "message": result.reason}
        return {**answer, **_fields_of(result.outputs["pose"])} if result.succeeded else answer

    def _get_views(self, request: RoomRequest) -> Fields:
        result = self.locator.get_views(request.room)
        poses = result.outputs.get("poses", ())
        return {"valid": result.succeeded, "message": result.reason, "poses": poses}

    def _get_rooms(self, _: NoFields) -> Fields:
        self._robot_pose()
        return {"success": True, "message": ", ".join(self.locator.likely_rooms())}

    # ---- setters --------------------------------------------------------------------------------------

    def _serve_setters(self) -> None:
        self._serve("setHotspot", "SetHotspot", HotspotRequest, self._set_hotspot)
        self._ports.serve(Service("florenceLocator/reloadHotspots", "std_srvs/srv/Trigger"), self._reload)
        self._serve("setUserPosRoom", "SetRoom", RoomRequest, self._set_user_room)
        self._serve("setUserPosXYPhi", "SetXYPhi", PoseRequest, self._set_user_position)

    def _set_hotspot(self, request: HotspotRequest) -> Fields:
        before = self.locator.hotspots.copy()
        result = self.locator.set_hotspot(request.label, request.pose)
        done, message = result.succeeded, result.reason
        if done:
            done, message = self._save(result.outputs["hotspot"])
        if not done:
            self.locator.hotspots = before
        return {"success": done, "message": message}

    def _save(self, hotspot: Hotspot) -> tuple[bool, str]:
        file = self._p.hotspots_file
        if not file:
            self._send_hotspots()
            return True, f"kept as {_a(hotspot.kind)} until the node ends: it has no hotspots_file"
        try:
            changed = HotspotFile(file)
            changed.put(hotspot)
            changed.save()
        except ConfigError as error:
            return False, f"not saved, and not kept: {error}"
        self._use(changed.hotspots)
        return True, f"saved as {_a(hotspot.kind)} in {file}"

    def _reload(self, _: NoFields) -> Fields:
        file = self._p.hotspots_file
        try:
            hotspots = load_hotspots(file) if file else self.locator.hotspots
        except ConfigError as error:
            return {"success": False, "message": f"the hotspots stay as they were: {error}"}
        self._use(hotspots)
        counts = f"hotspots: {len(hotspots)}, zones: {len(hotspots.zones)}"
        return {"success": True, "message": f"{counts}, of {file or 'no file'}"}

    def _use(self, hotspots: Hotspots) -> None:
        """Take over the hotspots of a file that was changed."""
        changed = hotspots.zones != self.locator.hotspots.zones
        self.locator.hotspots = hotspots
        self._send_hotspots()
        if changed:
            self._send_zones()

    def _send_hotspots(self) -> None:
        self._hotspots.send(self.locator.hotspots)

    def _send_zones(self) -> None:
        zones = tuple(self.locator.hotspots.zones)
        self._zones.send(zones)
        self._on_zones(zones, self.locator.map)

    def _set_user_room(self, request: RoomRequest) -> Fields:
        result = self.locator.set_user_room(request.room)
        if not result.succeeded:
            self._ports.tell(f"setUserPosRoom: {result.reason}", good=False)
        return _answer(result)

    def _set_user_position(self, request: PoseRequest) -> Fields:
        return _answer(self.locator.set_user_position(request.pose))

    def _serve(self, name: str, kind: str, request: type, answer: Callable[..., Fields]) -> None:
        service = Service(f"florenceLocator/{name}", f"florence_interfaces/srv/{kind}", request)
        self._ports.serve(service, answer)


def _a(kind: str) -> str:
    return f"an {kind}" if kind == OBJECT else f"a {kind}"


def _answer(result: Result) -> Fields:
    return {"success": result.succeeded, "message": result.reason}


def _fields_of(pose: Pose2) -> Fields:
    return {"x": pose.x, "y": pose.y, "phi": pose.yaw}


def _pose_answer(pose_of: Callable[[], Pose2 | None]) -> Callable[[NoFields], Fields]:
    def answer(_: NoFields) -> Fields:
        pose = pose_of()
        return {"valid": False} if pose is None else {"valid": True, **_fields_of(pose)}

    return answer
