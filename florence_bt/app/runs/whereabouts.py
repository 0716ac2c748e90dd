"""Where the robot is and how far it still has to go, as a viewer of a run sees it: it asks no mission server.

The feedback of navigation is a topic that anybody may read, with Florence's navigation and with Nav2.
Missions themselves do not say how far it is: a countdown would make every tick look like a change.
"""

from __future__ import annotations

import time
from typing import Any

from florence_interfaces.srv import GetRoom
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import NavigateThroughPoses, NavigateToPose

from florence_bt.app.bringup.locks import running_folder
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.runs.client import MissionClient, OpenQuestion
from florence_bt.core.errors import FlorenceError
from florence_bt.ros.action_client import LatestMessages
from florence_bt.ros.conversions import duration_from_ros
from florence_bt.ros.qos import LATCHED
from florence_bt.skills.locator.hotspots import Hotspots, load_hotspots

ROBOT_ROOM = "florenceLocator/getRobotPosRoom"
ROOM_PERIOD_S = 1.0
"""Wall seconds between two questions for the robot's room."""
FRESH_S = 3.0
"""Wall seconds without feedback after which the robot is not on its way any more."""
ARRIVED_M = 0.05
"""Metres left that are not worth telling."""


class Whereabouts:
    """Listens to navigation and asks the locator for the robot's room, without ever waiting.

    Args:
        client: The client that is spun meanwhile.
    """

    def __init__(self, client: MissionClient) -> None:
        self._client = client
        node = client.node
        self._drives = [
            LatestMessages(node, action.Impl.FeedbackMessage, f"{name}/_action/feedback", 1)
            for action, name in (
                (NavigateToPose, "navigate_to_pose"),
                (NavigateThroughPoses, "navigate_through_poses"),
            )
        ]
        node.create_subscription(PoseStamped, "navigate/current_goal", self._on_goal, LATCHED)
        self._hotspots = _hotspots_in_use()
        self._goal: tuple[float, float] | None = None
        self._room = ""
        self._question = OpenQuestion(client)
        self._ask_at = 0.0
        self._drive: Any = None
        self._to_goal = False
        self._drove_at = 0.0

    def text(self) -> str:
        """Say where the robot is and where it drives; empty while nobody knows."""
        now = time.monotonic()
        self._ask_for_room(now)
        for way in self._drives:
            for message in way.take():
                self._drive, self._drove_at, self._to_goal = message.feedback, now, way is self._drives[0]
        drive, fresh = self._drive, now - self._drove_at <= FRESH_S
        if drive is None or not fresh or drive.distance_remaining < ARRIVED_M:
            return where_text(self._room)
        destination = self._destination() if self._to_goal else ""
        seconds = duration_from_ros(drive.estimated_time_remaining)
        return where_text(self._room, destination, float(drive.distance_remaining), seconds)

    def _ask_for_room(self, now: float) -> None:
        answer = self._question.take()
        if answer is not None:
            self._room = answer.room if answer.valid else ""
        if now >= self._ask_at and self._question.ask(GetRoom, ROBOT_ROOM, GetRoom.Request()):
            self._ask_at = now + ROOM_PERIOD_S

    def _destination(self) -> str:
        if self._goal is None:
            return ""
        room, place = self._hotspots.room_of(*self._goal), f"({self._goal[0]:.1f}, {self._goal[1]:.1f})"
        return f"the {room}" if room and room != self._room else place

    def _on_goal(self, message: PoseStamped) -> None:
        self._goal = (message.pose.position.x, message.pose.position.y)


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


def _hotspots_in_use() -> Hotspots:
    """Read the hotspots of the system that runs on this machine; none when it runs elsewhere."""
    folder = running_folder()
    if folder is None:
        return Hotspots()
    try:
        return load_hotspots(BringUp.in_folder(folder).hotspots)
    except (FlorenceError, OSError, ValueError):
        return Hotspots()  # a folder that is gone, or of another version: rooms have no names then
