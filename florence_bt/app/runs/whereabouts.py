"""The robot's pose and the distance still to go, as a viewer sees them: it asks no mission server.

The feedback of navigation is a topic that anybody may read, with Florence's navigation and with Nav2; rooms
and the goal are the locator's. Missions themselves do not say how far it is: a countdown would make every
tick look like a change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from florence_interfaces.srv import GetRoom, GetXYPhi
from nav2_msgs.action import NavigateThroughPoses, NavigateToPose

from florence_bt.app.runs.client import LOCATOR, MissionClient, OpenQuestion
from florence_bt.core.heard import Heard
from florence_bt.ros.action_client import LatestMessages
from florence_bt.ros.conversions import duration_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.present_time import SteadyTime

ROBOT_ROOM = f"{LOCATOR}/getRobotPosRoom"
GOAL_ROOM = f"{LOCATOR}/getGoalPosRoom"
GOAL_POSE = f"{LOCATOR}/getGoalPosXYPhi"
_OF_THE_GOAL = {GOAL_ROOM: GetRoom, GOAL_POSE: GetXYPhi}
LOCATOR_PERIOD_S = 1.0
"""Wall seconds between two times at which the locator is asked."""
FEEDBACK_PERIOD_S = 1.0
"""Seconds between two words of navigation on a drive, at most; Nav2 and Florence's tell more often."""
ARRIVED_M = 0.05
"""Metres left that are not worth telling."""


@dataclass(frozen=True, slots=True)
class DriveProgress:
    """A drive that goes on.

    Attributes:
        goal_id: The goal of the action.
        distance: Metres to go.
        seconds: The time that it will still take; 0 when that is not known.
        to_goal: Whether the locator knows its goal; that of a drive through several poses it does not.
    """

    goal_id: bytes
    distance: float
    seconds: float
    to_goal: bool


class DriveWatch:
    """Listens to the feedback of drives.

    Args:
        node: The node that listens.
    """

    def __init__(self, node: FlorenceNode) -> None:
        self._ways = [
            LatestMessages(node, action.Impl.FeedbackMessage, f"{name}/_action/feedback", 1)
            for action, name in (
                (NavigateToPose, "navigate_to_pose"),
                (NavigateThroughPoses, "navigate_through_poses"),
            )
        ]
        self._drive: Heard[DriveProgress] = Heard(SteadyTime(node.steady), FEEDBACK_PERIOD_S)

    def now(self) -> DriveProgress | None:
        """Return the drive that goes on; None when nothing has been told of one lately."""
        for way in self._ways:
            for message in way.take():
                told = message.feedback
                self._drive.take(
                    DriveProgress(
                        bytes(message.goal_id.uuid),
                        float(told.distance_remaining),
                        duration_from_ros(told.estimated_time_remaining),
                        way is self._ways[0],
                    )
                )
        return self._drive.fresh


class Whereabouts:
    """Tells in one line where the robot is and where it drives, without ever waiting.

    Args:
        client: The client that is spun meanwhile.
    """

    def __init__(self, client: MissionClient) -> None:
        self._drives = DriveWatch(client.node)
        self._questions = {name: OpenQuestion(client) for name in (ROBOT_ROOM, *_OF_THE_GOAL)}
        self._time = SteadyTime(client.node.steady)
        self._answers: dict[str, Heard[Any]] = {}
        self._goal_id = b""
        self._ask_at = 0.0

    def text(self) -> str:
        """Say where the robot is and where it drives; empty while nobody knows."""
        drive = self._drives.now()
        if drive is not None and drive.goal_id != self._goal_id:
            self._goal_id, self._ask_at = drive.goal_id, 0.0
            for name in _OF_THE_GOAL:
                self._answers.pop(name, None)
        self._ask(_OF_THE_GOAL if drive is not None and drive.to_goal else {})
        room = self._room(ROBOT_ROOM)
        if drive is None or drive.distance < ARRIVED_M:
            return where_text(room)
        destination = self._destination(room) if drive.to_goal else ""
        return where_text(room, destination, drive.distance, drive.seconds)

    def _ask(self, of_the_goal: dict[str, Any]) -> None:
        for name, question in self._questions.items():
            answer = question.take()
            if answer is not None:
                self._answers.setdefault(name, Heard(self._time, LOCATOR_PERIOD_S)).take(answer)
        now = self._time.steady()
        if now >= self._ask_at:
            asked = [
                self._questions[name].ask(service, name, service.Request())
                for name, service in {ROBOT_ROOM: GetRoom, **of_the_goal}.items()
            ]
            self._ask_at = now + LOCATOR_PERIOD_S if any(asked) else self._ask_at

    def _answer(self, question: str) -> Any:
        """Return the answer of the locator while it is fresh."""
        heard = self._answers.get(question)
        return None if heard is None else heard.fresh

    def _room(self, question: str) -> str:
        answer = self._answer(question)
        return answer.room if answer is not None and answer.valid else ""

    def _destination(self, here: str) -> str:
        room, pose = self._room(GOAL_ROOM), self._answer(GOAL_POSE)
        if room and room != here:
            return f"the {room}"
        return f"({pose.x:.1f}, {pose.y:.1f})" if pose is not None and pose.valid else ""


def where_text(room: str, destination: str = "", distance: float | None = None, seconds: float = 0.0) -> str:
    """Write where the robot is.

    Args:
        room: Its room, empty when nobody knows.
        destination: Where it drives to, empty when nobody knows.
        distance: Metres to go; None when it does not drive to a place.
        seconds: The time that it will still take, 0 when that is not known.
    """
    parts = [f"in the {room}"] if room else []
    if distance is not None:
        about = [f"about {seconds:.0f} s"] if seconds >= 0.5 else []
        to_go = ", ".join([f"{distance:.1f} m", *about])
        parts.append(f"drives to {destination}: {to_go} left" if destination else f"drives, {to_go} left")
    return "; ".join(parts)
