"""The approach of a user as a component: proposes poses, and tells how the approach goes."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core import topic_names
from florence_bt.core.clock import Timer, call_every
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Positive
from florence_bt.core.ports import Fields, Ports, Service, Topic
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.topics import GLOBAL_COSTMAP, RUN_STATE, RunState
from florence_bt.skills.people.approach_user.approach_status import ApproachStatus
from florence_bt.skills.people.approach_user.polite_pose import DEFAULT_SAFE_DISTANCE, Proposals
from florence_bt.skills.robot_description.room import RoomParameters

UNCHECKED = "unchecked: no costmap was received yet"


@dataclass(frozen=True, slots=True)
class ApproachParameters(CheckedParameters):
    """Parameters of the approach.

    Attributes:
        safe_distance: Distance to the user when a request asks for 0, metres (document, table 13).
        status_period_s: Seconds between two repeats of the status (REFERENCE 12.2, row 1).
    """

    safe_distance: Positive = DEFAULT_SAFE_DISTANCE
    status_period_s: Positive = 0.2


@dataclass(frozen=True, slots=True)
class ProposalRequest:
    """The request of ``florence_interfaces/ProposeApproach``; see there."""

    user_x: float
    user_y: float
    robot_x: float
    robot_y: float
    safe_distance: float
    trial: int


STATUS = Topic(topic_names.APPROACH_STATUS, str)
PROPOSE = Service("approach_user/propose", "florence_interfaces/srv/ProposeApproach", ProposalRequest)


class Approaching:
    """Serves ``approach_user/propose`` and publishes ``approach_user/status``.

    Args:
        ports: Its connections.
        parameters: Its own.
        room: What the robot needs on the floor, as navigation has it.
    """

    def __init__(self, ports: Ports, parameters: ApproachParameters, room: RoomParameters) -> None:
        self._ports, self._p, self._room = ports, parameters, room
        self._costmap: OccupancyGrid | None = None
        self._proposals = Proposals()
        self._status = ApproachStatus()
        self._timer: Timer | None = None
        self._words = ports.output(STATUS)
        ports.listen(GLOBAL_COSTMAP, self._take_costmap)
        ports.listen(RUN_STATE, self._take_run_state)
        ports.serve(PROPOSE, self._propose)

    def _take_costmap(self, grid: OccupancyGrid) -> None:
        self._costmap = grid

    def _propose(self, request: ProposalRequest) -> Fields:
        result = self._proposals.propose(
            Pose2(request.user_x, request.user_y),
            Pose2(request.robot_x, request.robot_y),
            request.trial,
            request.safe_distance or self._p.safe_distance,
            self._costmap,
            self._room,
        )
        unchecked = result.succeeded and self._costmap is None
        answer = {"valid": result.succeeded, "message": UNCHECKED if unchecked else result.reason}
        pose = result.outputs.get("pose")
        return answer if pose is None else {**answer, "x": pose.x, "y": pose.y, "phi": pose.yaw}

    def _take_run_state(self, run: RunState) -> None:
        if self._status.take(run.run_id, run.mission, run.state) and self._timer is None:
            clock = self._ports.clock
            self._timer = call_every(clock, self._p.status_period_s, self._repeat, start=clock.now())

    def _repeat(self) -> None:
        word = self._status.next_word()
        if word is not None:
            self._words.send(word)
        elif self._timer is not None:
            self._timer.cancel()
            self._timer = None
