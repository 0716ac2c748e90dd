"""The locator over real ROS, with a stand-in for the mission server."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("florence_interfaces.srv")

from florence_interfaces.msg import DetectedUser, RunState
from florence_interfaces.srv import (
    GetHotspot,
    GetRoom,
    GetStatus,
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
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OCCUPIED, OccupancyGrid
from florence_bt.ros.answers import Deferred
from florence_bt.ros.conversions import grid_to_ros, pose_from_ros, pose_stamped_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.tf import TransformBroadcaster
from florence_bt.skills.locator import node as locator_node
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.skills.locator.node import LocatorNode

pytestmark = pytest.mark.ros

HOTSPOTS = """\
hotspots:
  - {label: kitchen, x: 1.0, y: 1.0, phi: 1.5, polygon: [[0, 0], [2, 0], [2, 2], [0, 2]]}
  - {label: bedroom, x: 5.0, y: 1.0, phi: 0.0}
  - {label: tv, x: 4.0, y: 3.0, phi: 0.0, kind: object}
"""


class Missions(FlorenceNode):
    """Stands in for the mission server and for whoever calls the locator."""

    def __init__(self) -> None:
        super().__init__("missions")
        self.asked: list[RunMission.Request] = []
        self.stops: list[StopMission.Request] = []
        self.accept = True
        self.states = self.create_publisher(RunState, "florence_bt/run_state", LATCHED)
        self.override = self.create_publisher(Bool, "manual_override", LATCHED)
        self.detected = self.create_publisher(DetectedUser, "detected_user", RELIABLE)
        self.goals = self.create_publisher(PoseStamped, "navigate/current_goal", LATCHED)
        self.frames = TransformBroadcaster(self)

    def serve(self) -> None:
        self.create_service(RunMission, "florence_bt/run_mission", self._run)
        self.create_service(StopMission, "florence_bt/stop", self._stop)

    def _run(self, request: RunMission.Request, response: RunMission.Response) -> RunMission.Response:
        self.asked.append(request)
        response.accepted, response.run_id = self.accept, "run-1" if self.accept else ""
        response.message = "runs" if self.accept else "something more important runs"
        return response

    def _stop(self, request: StopMission.Request, response: StopMission.Response) -> StopMission.Response:
        self.stops.append(request)
        response.success = True
        return response


class Bench:
    """A locator, a mission server and a caller."""

    def __init__(self, ros: Any, folder: Path, *, use_sim_time: bool = False, habits_file: str = "") -> None:
        self.ros = ros
        self.file = folder / "hotspots.yaml"
        self.file.write_text(HOTSPOTS)
        self.missions: Missions = ros.add(Missions())
        parameters = {"hotspots_file": str(self.file), "habits_file": habits_file}
        self.locator = ros.add(LocatorNode(parameters=parameters | {"use_sim_time": use_sim_time}))
        self._clients: dict[str, Any] = {}

    def call(self, service_type: Any, name: str, **fields: Any) -> Any:
        client = self._clients.get(name)
        if client is None:
            client = self.missions.create_client(service_type, f"florenceLocator/{name}")
            self._clients[name] = client
        self.ros.spin_until(client.service_is_ready, what=name)
        future = client.call_async(service_type.Request(**fields))
        self.ros.spin_until(future.done, what=f"the answer of {name}")
        return future.result()

    def serve_missions(self) -> None:
        self.missions.serve()
        self.ros.spin_until(
            lambda: self.locator.count_services("florence_bt/stop") and self._mission_client_is_ready(),
            what="the mission server",
        )

    def _mission_client_is_ready(self) -> bool:
        return all(client.service_is_ready() for client in self.locator.clients)

    def until(self, condition: Any, what: str) -> Any:
        return self.ros.spin_until(condition, what=what)


@pytest.fixture
def bench(ros: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    monkeypatch.setattr(locator_node, "ANSWER_WITHIN_S", 600.0)  # whatever holds this machine up
    return Bench(ros, tmp_path)


def test_the_user_is_where_sensors_say(bench: Bench) -> None:
    assert not bench.call(GetRoom, "getUserPosRoom").valid
    assert not bench.call(GetXYPhi, "getUserPosXYPhi").valid
    refused = bench.call(SetRoom, "setUserPosRoom", room="kichen")
    assert not refused.success and "kitchen" in refused.message
    assert bench.call(SetRoom, "setUserPosRoom", room="kitchen").success
    assert bench.call(GetRoom, "getUserPosRoom").room == "kitchen"
    assert bench.call(SetXYPhi, "setUserPosXYPhi", x=0.5, y=0.25, phi=0.75).success
    assert bench.call(SetRoom, "setUserPosRoom", room="kitchen").success
    where = bench.call(GetXYPhi, "getUserPosXYPhi")
    assert (where.x, where.y, where.phi, where.valid) == (0.5, 0.25, 0.75, True)
    assert not bench.call(SetXYPhi, "setUserPosXYPhi", x=math.nan).success
    bench.until(lambda: bench.missions.detected.get_subscription_count(), "the subscription")
    bench.missions.detected.publish(DetectedUser(command=True, user_position_x=5.0, user_position_y=1.5))
    bench.until(lambda: bench.call(GetRoom, "getUserPosRoom").room == "bedroom", "the detected user")


def test_the_rooms_begin_where_the_user_was_last(bench: Bench) -> None:
    assert bench.call(Trigger, "getRooms").message == "kitchen, bedroom"
    assert bench.call(SetRoom, "setUserPosRoom", room="bedroom").success
    rooms = bench.call(Trigger, "getRooms")
    assert (rooms.success, rooms.message) == (True, "bedroom, kitchen")


def test_the_habits_of_the_user_outlive_the_node(ros: Any, tmp_path: Path) -> None:
    file = tmp_path / "habits.json"
    file.write_text("damaged")
    bench = Bench(ros, tmp_path, habits_file=str(file))
    assert bench.call(SetRoom, "setUserPosRoom", room="bedroom").success
    ros.close_node(bench.locator)
    counts = json.loads(file.read_text())
    assert list(counts) == ["bedroom"] and sum(counts["bedroom"]) == 1


def test_a_place_off_the_map_is_not_stored_and_one_on_a_sofa_is(bench: Bench) -> None:
    cells = np.zeros((4, 4), np.int8)
    cells[1, 2] = OCCUPIED
    maps = bench.missions.create_publisher(OccupancyGridMsg, "map", LATCHED)
    maps.publish(grid_to_ros(OccupancyGrid(0.5, Pose2(), cells), "map", 0.0))
    bench.until(
        lambda: not bench.call(SetXYPhi, "setUserPosXYPhi", x=9.0, y=-9.0).success, "the locator's map"
    )
    assert bench.call(SetXYPhi, "setUserPosXYPhi", x=1.25, y=0.75).success
    refused = bench.call(SetXYPhi, "setUserPosXYPhi", x=9.0, y=-9.0)
    assert not refused.success and "outside the map" in refused.message
    where = bench.call(GetXYPhi, "getUserPosXYPhi")
    assert (where.x, where.y) == (1.25, 0.75)


def test_the_robot_is_where_tf_says(bench: Bench) -> None:
    assert not bench.call(GetXYPhi, "getRobotPosXYPhi").valid
    assert not bench.call(GetRoom, "getRobotPosRoom").valid

    def known() -> bool:
        bench.missions.frames.send("map", "base_link", bench.missions.timebase.now(), Pose2(1.5, 0.5, 0.25))
        return bool(bench.call(GetXYPhi, "getRobotPosXYPhi").valid)

    bench.until(known, "the robot's pose")
    where = bench.call(GetXYPhi, "getRobotPosXYPhi")
    assert (where.x, where.y, where.phi) == pytest.approx((1.5, 0.5, 0.25))
    assert bench.call(GetRoom, "getRobotPosRoom").room == "kitchen"


@pytest.mark.parametrize(("ago_s", "known"), [(0.5, True), (4.0, False)])
def test_where_the_robot_was_a_while_ago_is_not_where_it_is(bench: Bench, ago_s: float, known: bool) -> None:
    """The driver or the localiser hangs: the last transform stays, and the robot drives on."""
    missions = bench.missions

    def listens() -> bool:
        missions.frames.send("odom", "base_link", missions.timebase.now(), Pose2())
        missions.frames.send("map", "odom", missions.timebase.now() - ago_s, Pose2(1.5, 0.5, 0.25))
        return bench.locator._locating._frames.buffer.newest_between("map", "base_link") is not None

    bench.until(listens, "the transforms")
    assert bench.call(GetXYPhi, "getRobotPosXYPhi").valid is known
    assert bench.call(GetRoom, "getRobotPosRoom").valid is known
    ago_s = 0.0
    bench.until(lambda: listens() and bench.call(GetXYPhi, "getRobotPosXYPhi").valid, "the next one")


def test_the_goal_is_the_one_of_navigation(bench: Bench) -> None:
    assert not bench.call(GetRoom, "getGoalPosRoom").valid
    bench.missions.goals.publish(pose_stamped_to_ros(Pose2(5.0, 1.0, 0.5), "map", 0.0))
    bench.until(lambda: bench.call(GetXYPhi, "getGoalPosXYPhi").valid, "the goal")
    assert bench.call(GetRoom, "getGoalPosRoom").room == "bedroom"
    bench.missions.goals.publish(PoseStamped())  # the drive is over: the last goal stays
    bench.missions.goals.publish(pose_stamped_to_ros(Pose2(1.0, 1.0, 0.5), "", 0.0))
    bench.ros.spin_for(0.3)
    assert bench.call(GetRoom, "getGoalPosRoom").room == "bedroom"


def test_hotspots_are_read_and_saved(bench: Bench) -> None:
    kitchen = bench.call(GetHotspot, "getHotspot", label="kitchen")
    assert (kitchen.x, kitchen.y, kitchen.phi, kitchen.valid) == (1.0, 1.0, 1.5, True)
    unknown = bench.call(GetHotspot, "getHotspot", label="bed room")
    assert not unknown.valid and "bedroom" in unknown.message
    views = bench.call(GetViews, "getViews", room="kitchen")
    assert views.valid and pose_from_ros(views.poses[0]).distance_to(Pose2(1.0, 1.0)) < 1e-6
    assert pose_from_ros(views.poses[0]).yaw == pytest.approx(1.5)
    attic = bench.call(GetViews, "getViews", room="attic")
    assert not attic.valid and not attic.poses and "kitchen" in attic.message
    saved = bench.call(SetHotspot, "setHotspot", label="study", x=3.0, y=4.0, phi=0.5)
    assert saved.success and str(bench.file) in saved.message
    assert load_hotspots(bench.file).get("study") is not None
    assert not bench.call(SetHotspot, "setHotspot", label=" ", x=3.0).success
    assert not bench.call(SetHotspot, "setHotspot", label="study", x=math.inf).success


def test_the_status_is_that_of_the_mission(bench: Bench) -> None:
    assert bench.call(GetStatus, "getStatus").status == "LOST"
    for state in ("ACTIVE", "SUCCEEDED", "PREEMPTED", "ABORTED"):
        bench.missions.states.publish(RunState(run_id="1", mission="goto_room", state=state))
        bench.until(lambda state=state: bench.call(GetStatus, "getStatus").status == state, state)


def test_goto_runs_missions_and_answers_what_they_answer(bench: Bench) -> None:
    bench.serve_missions()
    answer = bench.call(GotoRoom, "gotoRoom", room="kitchen")
    assert (answer.success, answer.message, answer.run_id) == (True, "runs", "run-1")
    request = bench.missions.asked[-1]
    assert (request.mission, request.policy) == ("goto_room", "preempt")
    assert (list(request.input_names), list(request.input_values)) == (["room"], ["kitchen"])
    bench.missions.accept = False
    refused = bench.call(GotoXYPhi, "gotoXYPhi", x=1.25, y=-2.0, phi=0.5)
    assert not refused.success and refused.message == "something more important runs"
    request = bench.missions.asked[-1]
    assert request.mission == "goto_pose"
    values = dict(zip(request.input_names, request.input_values, strict=True))
    assert values == {"x": "1.250000 m", "y": "-2.000000 m", "phi": "0.500000 rad"}


def test_goto_user_needs_a_known_user(bench: Bench) -> None:
    bench.serve_missions()
    assert not bench.call(Trigger, "gotoUser").success
    assert bench.missions.asked == []
    bench.call(SetRoom, "setUserPosRoom", room="kitchen")
    assert bench.call(Trigger, "gotoUser").success
    assert bench.missions.asked[-1].mission == "goto_user"


def test_a_bad_goal_never_reaches_the_missions(bench: Bench) -> None:
    bench.serve_missions()
    assert not bench.call(GotoXYPhi, "gotoXYPhi", x=math.nan).success
    assert "bedroom" in bench.call(GotoRoom, "gotoRoom", room="bedrom").message
    assert bench.missions.asked == []


def test_without_a_mission_server_goto_fails_without_waiting_for_it(bench: Bench) -> None:
    answer = bench.call(GotoRoom, "gotoRoom", room="kitchen")
    assert not answer.success and "mission server is not there" in answer.message


@pytest.mark.parametrize("simulated", [False, True])
def test_a_mission_server_that_does_not_answer_is_given_up_and_stopped_later(
    ros: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, simulated: bool
) -> None:
    """Also while the simulated time stands: what it waits for is another process."""
    bench = Bench(ros, tmp_path, use_sim_time=simulated)
    monkeypatch.setattr(locator_node, "ANSWER_WITHIN_S", 0.5)
    held: list[RunMission.Request] = []

    class Slow(FlorenceNode):
        def __init__(self) -> None:
            super().__init__("slow")
            self.stopped: list[str] = []
            self.later = Deferred()
            self.create_service(RunMission, "florence_bt/run_mission", self._run)
            self.create_service(StopMission, "florence_bt/stop", self._stop)

        def _run(self, request: RunMission.Request, response: RunMission.Response) -> Any:
            held.append(request)
            return self.later

        def _stop(self, request: StopMission.Request, response: StopMission.Response) -> StopMission.Response:
            self.stopped.append(request.run_id)
            return response

    slow = ros.add(Slow())
    bench.until(bench._mission_client_is_ready, "the slow server")
    answer = bench.call(GotoRoom, "gotoRoom", room="kitchen")
    assert not answer.success and "within 0.5 s" in answer.message
    # Meanwhile the locator answered everybody else.
    assert bench.call(GetStatus, "getStatus").status == "LOST"
    slow.later.answer(RunMission.Response(accepted=True, run_id="run-7"))
    bench.until(lambda: slow.stopped == ["run-7"], "the stop of the late run")


def test_while_the_base_is_overridden_every_goto_is_refused(bench: Bench) -> None:
    bench.serve_missions()
    bench.missions.override.publish(Bool(data=True))
    bench.until(lambda: "override" in bench.call(GotoRoom, "gotoRoom", room="kitchen").message, "the refusal")
    assert not bench.call(GotoRoom, "gotoRoom", room="kitchen").success
    assert bench.call(SetRoom, "setUserPosRoom", room="kitchen").success
    bench.missions.override.publish(Bool(data=False))
    bench.until(lambda: bench.call(GotoRoom, "gotoRoom", room="kitchen").success, "acceptance")
