"""The node ``florenceLocator``: :class:`Locating` on ROS, with what asks the mission server to drive."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from florence_interfaces.msg import UserSeen
from florence_interfaces.srv import GotoRoom, GotoXYPhi, RunMission, StopMission
from geometry_msgs.msg import PoseStamped
from nav2_msgs.msg import CostmapFilterInfo
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from florence_bt.core.geometry import FramedPose, Pose2
from florence_bt.core.ports import Topic
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.topics import ZONES
from florence_bt.core.zones import Zone
from florence_bt.ros.answers import Deferred
from florence_bt.ros.conversions import frame_from_ros, grid_to_ros, pose_from_ros, stamp_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import FromRos, RosPorts, ToRos
from florence_bt.ros.qos import LATCHED
from florence_bt.ros.zones import zones_to_ros
from florence_bt.skills.locator import filter_masks
from florence_bt.skills.locator.hotspots import Hotspots, load_hotspots
from florence_bt.skills.locator.locating import (
    GOAL,
    HOTSPOTS,
    SIGHTINGS,
    Locating,
    LocatorParameters,
    Sighting,
)
from florence_bt.skills.locator.locator import LastSeen
from florence_bt.skills.locator.markers import hotspots_to_ros

RUN_SERVICE, STOP_SERVICE = "florence_bt/run_mission", "florence_bt/stop"
ANSWER_WITHIN_S = 5.0
"""Of this machine's time: the speed of a simulation does not matter to the mission server."""
CALLER = "florenceLocator"

Answer = Callable[[bool, str, str], None]
"""Called with whether a mission was accepted, the reason, and the run's id."""


class LocatorNode(FlorenceNode):
    """Serves ``florenceLocator/*``.

    Args:
        parameters: Overrides of the node's parameters.

    Raises:
        ConfigError: The hotspot file or the initial room is wrong.
    """

    parameter_classes = (LocatorParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("florenceLocator", parameters=parameters)
        own = self.read_parameters(LocatorParameters)
        header = Header(frame_id=own.map_frame)
        to_ros: dict[Topic[Any], ToRos] = {
            HOTSPOTS: lambda hotspots: hotspots_to_ros(hotspots, header),
            ZONES: lambda zones: zones_to_ros(zones, header),
        }
        from_ros: dict[Topic[Any], FromRos] = {SIGHTINGS: self._sighting, GOAL: _goal}
        self._missions = _MissionClient(self)
        self._locating = Locating(
            RosPorts(self, to_ros, from_ros),
            load_hotspots(own.hotspots_file) if own.hotspots_file else Hotspots(),
            own,
            _FilterMasks(self, own).publish,
        )
        self.on_close(self._locating.close)
        self._create_gotos()

    def _sighting(self, message: UserSeen) -> Sighting:
        since, at = (self.time_of(stamp_from_ros(told)) for told in (message.since, message.stamp))
        return Sighting(message.room, LastSeen(message.source, since, at))

    # ---- goto -----------------------------------------------------------------------------------------

    def _create_gotos(self) -> None:
        self._serve(Trigger, "gotoUser", self._on_goto_user)
        self._serve(GotoRoom, "gotoRoom", self._on_goto_room)
        self._serve(GotoXYPhi, "gotoXYPhi", self._on_goto_pose)

    def _on_goto_user(
        self, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response | Deferred:
        return self._goto(response, self._locating.locator.why_not_goto_user(), "goto_user", {})

    def _on_goto_room(
        self, request: GotoRoom.Request, response: GotoRoom.Response
    ) -> GotoRoom.Response | Deferred:
        refusal = self._locating.locator.why_not_goto_room(request.room)
        return self._goto(response, refusal, "goto_room", {"room": request.room})

    def _on_goto_pose(
        self, request: GotoXYPhi.Request, response: GotoXYPhi.Response
    ) -> GotoXYPhi.Response | Deferred:
        pose = Pose2(request.x, request.y, request.phi)
        inputs = {"x": f"{pose.x:.6f} m", "y": f"{pose.y:.6f} m", "phi": f"{pose.yaw:.6f} rad"}
        return self._goto(response, self._locating.locator.why_not_goto_pose(pose), "goto_pose", inputs)

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

    def __init__(self, node: FlorenceNode, params: LocatorParameters) -> None:
        self._node, self._params = node, params
        self._publishers: dict[str, tuple[Any, Any]] = {}

    def publish(self, zones: Sequence[Zone], grid: OccupancyGrid | None) -> None:
        """Publish both masks; nothing before there is a map and a first zone."""
        if grid is None or not (zones or self._publishers):
            return
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


def _goal(message: PoseStamped) -> FramedPose:
    return FramedPose(pose_from_ros(message.pose), frame_from_ros(message.header.frame_id))
