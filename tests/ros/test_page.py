"""The page's process beside a robot: what viewers get, what is heard when nobody looks, who is refused.

Its tests share one page in one domain, each with a robot and viewers of its own.
"""

from __future__ import annotations

import http.client
import json
import re
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")
connect = pytest.importorskip("websockets.sync.client").connect

from action_msgs.msg import GoalStatus, GoalStatusArray  # noqa: E402
from florence_interfaces.msg import RunState, RunTree, StopReason, TreeNode  # noqa: E402
from florence_interfaces.srv import SetHotspot  # noqa: E402
from geometry_msgs.msg import PoseStamped, Twist  # noqa: E402
from nav_msgs.msg import Path as PathMsg  # noqa: E402
from sensor_msgs.msg import BatteryState  # noqa: E402
from sensor_msgs.msg import LaserScan as LaserScanMsg  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402
from websockets.exceptions import ConnectionClosed, InvalidStatus  # noqa: E402

from florence_bt.core.diagnosis import Diagnosis, Severity  # noqa: E402
from florence_bt.core.geometry import Pose2  # noqa: E402
from florence_bt.core.sensing import OccupancyGrid  # noqa: E402
from florence_bt.core.topic_names import SUPERVISOR  # noqa: E402
from florence_bt.drivers.turtlebot.override_file import OverrideFile  # noqa: E402
from florence_bt.drivers.turtlebot.override_switch import BaseWord, OverrideSwitch  # noqa: E402
from florence_bt.ros.conversions import grid_to_ros, pose_stamped_to_ros  # noqa: E402
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros  # noqa: E402
from florence_bt.ros.node import FlorenceNode  # noqa: E402
from florence_bt.ros.ports import RosPorts  # noqa: E402
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR  # noqa: E402
from florence_bt.ros.tf import TransformBroadcaster  # noqa: E402
from florence_bt.skills.locator.node import LocatorNode  # noqa: E402
from tests.ros.conftest import GENEROUS_S, Child, own_domain  # noqa: E402
from tools.page_figures import browser_socket  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("page")]


class Robot(FlorenceNode):
    """Says where it is, what it sees and what runs."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.map = self.create_publisher(type(_map()), "map", LATCHED)
        self.run = self.create_publisher(RunState, "florence_bt/run_state", LATCHED)
        self.scan = self.create_publisher(LaserScanMsg, "filtered_scan", SENSOR)
        self.plan = self.create_publisher(PathMsg, "plan", RELIABLE)
        base = BaseWord(standing=True, driven_by_hand=False, problem="")
        self.override = OverrideSwitch(RosPorts(self), OverrideFile(None), lambda on: None, lambda: base)
        self.on_close(self.override.close)
        self.frames = TransformBroadcaster(self)
        self.map.publish(_map())
        self.run.publish(RunState(run_id="7", mission="greet", state="ACTIVE"))
        self.told = self.create_publisher(String, "speaking", LATCHED)
        self.goal = self.create_publisher(PoseStamped, "navigate/current_goal", LATCHED)
        self.battery = self.create_publisher(BatteryState, "battery_state", LATCHED)
        self.stop = self.create_publisher(StopReason, "turtlebot_node/stop_reason", LATCHED)
        self.tree = self.create_publisher(RunTree, "florence_bt/run_tree", LATCHED)
        self.drives = self.create_publisher(GoalStatusArray, "navigate_to_pose/_action/status", LATCHED)
        self.moving = self.create_timer(0.05, self._tell)

    def _tell(self) -> None:
        now = self.timebase.now()
        self.frames.send("map", "base_link", now, Pose2(1.0, 2.0, 0.5))
        scan = LaserScanMsg(
            angle_min=0.0, angle_increment=0.01, range_min=0.1, range_max=5.0, ranges=[1.0] * 100
        )
        scan.header.frame_id = "base_link"
        scan.header.stamp = self.get_clock().now().to_msg()
        self.scan.publish(scan)


def _map() -> Any:
    import numpy as np

    cells = np.zeros((40, 60), np.int8)
    cells[0] = 100
    return grid_to_ros(OccupancyGrid(0.05, Pose2(-1.0, -0.5), cells), "map", 0.0)


@pytest.fixture(scope="module")
def ros_domain() -> Iterator[int]:
    """The domain of the page, and of every test here."""
    with own_domain() as domain:
        yield domain


@pytest.fixture(scope="module")
def page(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """The port of a running page."""
    folder = tmp_path_factory.mktemp("page")
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        port = server.getsockname()[1]
    command = [sys.executable, "-m", "florence_bt.cli", "page", "--port", str(port)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(folder))
        child = Child(command, folder / "page.txt")
    try:
        child.wait_for("Ctrl-C ends it")
        end = time.monotonic() + GENEROUS_S
        while not answers(port):
            assert time.monotonic() < end, child.output
            time.sleep(0.02)
        yield port
    finally:
        child.end()


def answers(port: int) -> bool:
    with socket.socket() as client:
        return client.connect_ex(("127.0.0.1", port)) == 0


def get(port: int, path: str, **headers: str) -> tuple[int, bytes]:
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=60)) as client:
        client.request("GET", path, headers=headers)
        answer = client.getresponse()
        return answer.status, answer.read()


class Viewer:
    """One WebSocket, and everything that it has brought."""

    def __init__(self, port: int) -> None:
        self._open = ExitStack()
        self.socket = self._open.enter_context(
            connect(f"ws://127.0.0.1:{port}/live", origin=f"http://127.0.0.1:{port}")
        )
        self.parts: dict[str, Any] = {}

    def close(self) -> None:
        self._open.close()

    def take(self) -> dict[str, Any]:
        """Take what is there, for a moment."""
        try:
            self.parts |= json.loads(self.socket.recv(timeout=0.02))
            self.socket.send("ok")
        except TimeoutError:
            pass
        return self.parts

    def drive(self, forward: float, *, age: float = 0.0) -> None:
        """Say where the hand is, as seen with the newest frame so many seconds ago."""
        self.socket.send(f"drive {forward} 0 {self.parts['beat'] - age} 0")


def test_a_viewer_sees_the_robot_and_nothing_is_heard_when_it_has_left(ros: Any, page: int) -> None:
    robot = ros.add(Robot())
    assert not robot.scan.get_subscription_count()
    viewer = Viewer(page)
    ros.spin_until(lambda: viewer.take().get("scene", {}).get("scan"), what="the scan in the map")
    assert viewer.parts["scene"]["pose"] == [1.0, 2.0, 0.5]
    assert abs(viewer.parts["beat"] - time.monotonic()) < GENEROUS_S
    ahead = viewer.parts["scene"]["scan"][:2]
    assert ahead == pytest.approx([1.0 + 0.878, 2.0 + 0.479], abs=0.02)
    assert viewer.parts["map"]["origin"] == [-1.0, -0.5, 0.0] and viewer.parts["map"]["size"] == [3.0, 2.0]
    assert viewer.parts["run"]["mission"] == "greet" and not viewer.parts["run"]["paused"]
    robot.run.publish(RunState(run_id="7", mission="greet", state="ACTIVE", reason="a visitor"))
    ros.spin_until(lambda: viewer.take()["run"]["paused"], what="the pause")
    status, picture = get(page, "/picture/map")
    assert status == 200 and picture.startswith(b"\x89PNG")
    robot.override.stop()
    ros.spin_until(lambda: viewer.take()["override"]["on"])
    viewer.close()
    ros.spin_until(lambda: not robot.scan.get_subscription_count(), what="the end of the subscriptions")


def test_what_has_ended_goes(ros: Any, page: int) -> None:
    robot = ros.add(Robot())
    people = robot.create_publisher(MarkerArray, "user_markers", RELIABLE)
    person = Marker(ns="user_text", id=3, text="Anna")
    person.header.frame_id = "map"
    viewer = Viewer(page)

    def part(name: str) -> Any:
        return viewer.take().get(name)

    def scene(name: str) -> Any:
        return (part("scene") or {}).get(name)

    def drive(status: int) -> None:
        robot.drives.publish(GoalStatusArray(status_list=[GoalStatus(status=status)]))

    def begin() -> None:
        robot.plan.publish(PathMsg(poses=[PoseStamped(), PoseStamped()]))
        ros.spin_until(lambda: part("plan"), what="the way")

    ros.spin_until(robot.plan.get_subscription_count, what="the page")
    robot.told.publish(String(data="Here I am."))
    robot.battery.publish(BatteryState(percentage=0.5))
    robot.stop.publish(StopReason(code="bumper", text="the left bumper is pressed"))
    robot.goal.publish(pose_stamped_to_ros(Pose2(1.0, 1.0), "map", 0.0))
    robot.tree.publish(RunTree(mission="m", nodes=[TreeNode(status=99, title="no such node")]))
    robot.tree.publish(RunTree(mission="m", nodes=[TreeNode(status=TreeNode.RUNNING, title="greet")]))
    begin()

    def sees_all() -> bool:
        people.publish(MarkerArray(markers=[person]))
        return bool(scene("pose") and scene("scan") and scene("people"))

    ros.spin_until(sees_all, what="what is seen")
    ros.spin_until(lambda: part("goal") and part("tree"), what="what is told")
    state = ros.spin_until(lambda: (now := viewer.take()["state"])["said"] and now, what="the sentence")
    ros.spin_until(lambda: viewer.take()["state"]["stop"] == "the left bumper is pressed", what="the stop")
    assert state["battery"] == 50

    robot.plan.publish(PathMsg())
    robot.goal.publish(PoseStamped())
    ros.spin_until(lambda: part("plan") == [] and part("goal") is None, what="the end of the drive")
    drive(GoalStatus.STATUS_EXECUTING)
    begin()
    drive(GoalStatus.STATUS_ABORTED)
    ros.spin_until(lambda: part("plan") == [], what="the end of a drive of Nav2")

    begin()
    robot.moving.cancel()
    ros.spin_until(
        lambda: scene("pose") is None and not scene("scan") and not scene("people"), what="what is not seen"
    )
    assert part("plan") and part("tree") and part("run")["state"] == "ACTIVE", "its teller is there"

    ros.close_node(robot)
    ros.spin_until(lambda: part("plan") == [] and part("tree") == [], what="the end of the robot")
    ros.spin_until(lambda: part("run")["state"] == "GONE", what="the end of the mission server")
    ended = {"said": "", "battery": None, "stop": ""}
    ros.spin_until(lambda: viewer.take()["state"].items() >= ended.items(), what="the end of the driver")
    viewer.close()


def test_who_says_nothing_is_told_with_the_seconds(ros: Any, page: int) -> None:
    robot = ros.add(Robot())
    viewer = Viewer(page)
    ros.spin_until(
        lambda: (now := viewer.take()).get("override") and "silent" in now and "base" not in now["silent"]
    )
    ros.spin_until(lambda: "missions" in viewer.take()["silent"], what="that no mission server answers")
    ros.close_node(robot)
    ros.spin_until(lambda: viewer.take()["silent"].get("base", 0) >= 2, what="the driver's silence")
    viewer.close()


def test_the_battery_of_a_driver_that_hangs_is_shown_with_its_age(ros: Any, page: int) -> None:
    robot = ros.add(Robot())
    viewer = Viewer(page)

    def state() -> dict[str, Any]:
        viewer.take()
        shown: dict[str, Any] = viewer.parts["state"]
        return shown

    robot.battery.publish(BatteryState(percentage=0.5))
    ros.spin_until(lambda: state()["battery"] == 50 and not state()["battery_was"], what="the battery")
    ros.spin_until(lambda: state()["battery"] is None, what="that its driver, which is there, says nothing")
    assert re.fullmatch(r"50 % \d+ s ago", state()["battery_was"])
    robot.battery.publish(BatteryState(percentage=0.4))
    ros.spin_until(lambda: state()["battery"] == 40 and not state()["battery_was"], what="its next word")
    viewer.close()


def test_who_hangs_or_is_late_is_shown_until_it_does_not(ros: Any, page: int) -> None:
    up, busy, viewer = ros.add(FlorenceNode(SUPERVISOR)), ros.add(FlorenceNode("busy")), Viewer(page)
    publisher = diagnostics_publisher(up)
    busy.health.count_late(3.2)
    hangs, late = "process hardware: has not answered for 3 s", "the process of busy is 3.2 s behind"

    down = ["hardware"]

    def shows(*texts: str) -> bool:
        hanging = Diagnosis(Severity.ERROR, "has not answered for 3 s")
        found = {f"process {name}": hanging for name in down}
        publisher.publish(diagnostics_to_ros(found, SUPERVISOR, "", up.stamp()))
        viewer.take()
        shown = viewer.parts.get("state", {}).get("trouble") or ""
        return all(text in shown for text in texts)

    ros.spin_until(lambda: shows(hangs, late), what="both")
    ros.close_node(busy)
    ros.spin_until(lambda: shows(hangs) and not shows(late), what="that nobody is late")
    assert "navigation" not in viewer.take()["silent"]
    down.append("navigation")
    ros.spin_until(
        lambda: shows(hangs) and viewer.take()["silent"].get("navigation", 0) >= 2,
        what="that what navigation has told is old",
    )
    ros.close_node(up)
    ros.spin_until(lambda: viewer.take()["state"]["trouble"] is None, what="that nobody tells of processes")
    viewer.close()


def test_places_that_somebody_changes_elsewhere_are_shown_at_once(
    ros: Any, page: int, tmp_path: Path
) -> None:
    file = tmp_path / "home.yaml"
    room = "{label: kitchen, x: 1, y: 2, yaw: 90 deg, polygon: [[0, 0], [3, 0], [3, 3], [0, 3]]}"
    file.write_text(f"hotspots:\n- {room}\n- {{label: sofa, x: 2, y: 1, kind: object}}\n")
    locator = ros.add(LocatorNode(parameters={"hotspots_file": str(file)}))
    client = locator.create_client(SetHotspot, "florenceLocator/setHotspot")
    viewer = Viewer(page)

    def places() -> dict[str, tuple[float, float, str]]:
        return {
            each["label"]: (each["x"], each["y"], each["kind"]) for each in viewer.take().get("places", [])
        }

    ros.spin_until(lambda: "sofa" in places(), what="the places of the file")
    assert places() == {"kitchen": (1.0, 2.0, "room"), "sofa": (2.0, 1.0, "object")}
    client.call_async(SetHotspot.Request(label="sofa", x=2.5, y=1.5, phi=0.0))
    ros.spin_until(lambda: places().get("sofa") == (2.5, 1.5, "object"), what="the sofa where it is now")
    file.write_text(
        f"hotspots:\n- {room}\nzones:\n- {{label: rug, kind: keep_out, polygon: [[0, 0], [1, 0], [1, 1]]}}\n"
    )
    reload = locator.create_client(Trigger, "florenceLocator/reloadHotspots")
    reload.call_async(Trigger.Request())
    ros.spin_until(lambda: "sofa" not in places(), what="the end of the sofa")
    ros.spin_until(lambda: viewer.take()["zones"], what="the zone")
    assert [zone["label"] for zone in viewer.parts["zones"]] == ["rug"]
    viewer.close()


def test_a_hand_drives_while_the_override_is_on_and_a_viewer_that_vanishes_stops_the_robot(
    ros: Any, page: int
) -> None:
    robot = ros.add(Robot())
    commands: list[float] = []
    robot.create_subscription(
        Twist, "manual_cmd_vel", lambda message: commands.append(message.linear.x), RELIABLE
    )
    viewer = Viewer(page)
    ros.spin_until(lambda: viewer.take().get("scene", {}).get("pose"))
    ros.spin_until(lambda: not viewer.take()["override"]["on"], what="that the override is off")
    viewer.drive(1.0)
    ros.spin_for(0.5)
    robot.override.stop()
    ros.spin_until(lambda: viewer.take()["override"]["on"])
    assert commands == [], "what was said before the override does not count"

    def drives() -> bool:
        viewer.drive(0.5)
        return bool(commands)

    viewer.drive(1.0, age=2.0)
    ros.spin_for(0.3)
    assert commands == [], "what a line has held for seconds does not drive"
    ros.spin_until(drives, what="a command")
    assert commands[-1] == pytest.approx(0.5 * viewer.parts["state"]["speeds"][0])
    viewer.close()
    ros.spin_until(lambda: commands[-1] == 0.0, what="the stop")
    commands.clear()
    ros.spin_for(0.5)
    assert commands == []


def test_a_costmap_is_heard_on_request_only(ros: Any, page: int) -> None:
    robot = ros.add(Robot())
    costs = robot.create_publisher(type(_map()), "local_costmap/costmap", LATCHED)
    costs.publish(_map())
    viewer = Viewer(page)
    ros.spin_until(lambda: viewer.take().get("scene", {}).get("pose"))
    assert not costs.get_subscription_count() and "local_costmap" not in viewer.parts
    viewer.socket.send("want scene local_costmap")
    ros.spin_until(lambda: viewer.take().get("local_costmap"), what="the costmap")
    assert get(page, "/picture/local_costmap")[0] == 200
    viewer.socket.send("want scene")
    ros.spin_until(lambda: not costs.get_subscription_count(), what="the end of the subscription")
    viewer.close()


def test_a_viewer_that_takes_nothing_delays_nobody(ros: Any, page: int) -> None:
    ros.add(Robot())
    idle = [Viewer(page) for _ in range(5)]
    viewer = Viewer(page)
    ros.spin_until(lambda: viewer.take().get("scene", {}).get("pose"))
    for each in (viewer, *idle):
        each.close()


def test_a_page_of_another_origin_gets_neither_page_nor_stream(ros: Any, page: int) -> None:
    assert get(page, "/")[0] == 200
    assert get(page, "/", Origin="http://evil.example")[0] == 403
    assert get(page, "/", Host="evil.example")[0] == 403
    assert get(page, "/picture/../../etc/passwd.png")[0] == 404
    with (
        pytest.raises((ConnectionClosed, InvalidStatus)),
        connect(f"ws://127.0.0.1:{page}/live", origin="http://evil.example") as stranger,
    ):
        stranger.recv()


def test_a_message_that_is_too_large_ends_that_viewer_only(ros: Any, page: int) -> None:
    ros.add(Robot())
    hostile, viewer = Viewer(page), Viewer(page)
    hostile.socket.send("x" * 2_000_000)
    with pytest.raises(ConnectionClosed):
        while True:
            hostile.socket.recv(timeout=60)
    hostile.close()
    ros.spin_until(lambda: viewer.take().get("scene", {}).get("pose"))
    viewer.close()


def test_a_flood_on_the_socket_of_nicegui_ends_that_browser_only(ros: Any, page: int) -> None:
    ros.add(Robot())
    viewer = Viewer(page)
    with browser_socket(page) as (hostile, event), browser_socket(page) as (calm, _):
        with pytest.raises(ConnectionClosed):
            for _ in range(10_000):
                hostile.send(event)
        assert hostile.close_code == 1008
        calm.send(event)
        calm.ping().wait(60)
        assert calm.close_code is None
    ros.spin_until(lambda: viewer.take().get("scene", {}).get("pose"))
    viewer.close()
    assert get(page, "/_nicegui_ws/socket.io/?EIO=4&transport=polling")[0] == 400


def test_on_the_network_it_needs_a_token(
    start_process: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    child = start_process("-m", "florence_bt.cli", "page", "--host", "0.0.0.0")
    assert child.process.wait(GENEROUS_S) == 2
    assert "florence page --token" in child.output


def test_a_wrong_address_is_answered_with_a_sentence(page: int) -> None:
    """And not with a page of NiceGUI, which is kept for a minute."""
    for path in ("/nothing", "/_nicegui/nothing", "/edit/a/b"):
        assert get(page, path) == (404, b"nothing is here: open /\n")
