"""Places over ROS: zones from the locator to navigation and to Nav2, and the commands of a terminal."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("florence_interfaces.srv")

from florence_interfaces.msg import RunState, Zones
from florence_interfaces.msg import Zone as ZoneMsg
from florence_interfaces.srv import SetHotspot
from geometry_msgs.msg import Point32, Polygon
from nav2_msgs.action import ComputePathToPose
from nav2_msgs.msg import CostmapFilterInfo
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from rclpy.action import ActionClient
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState
from std_srvs.srv import Trigger

from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.geometry import Pose2
from florence_bt.core.topic_names import SUPERVISOR
from florence_bt.ros.conversions import (
    grid_from_ros,
    grid_to_ros,
    header_to_ros,
    pose_stamped_to_ros,
    stamp_to_ros,
)
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.ros.tf import TransformBroadcaster
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.skills.locator.node import LocatorNode
from florence_bt.skills.navigation.navigate.node import NavigationNode
from tests.ros.override_driver import OverrideDriver
from tests.unit.skills.navigation_world import make_map

pytestmark = pytest.mark.ros

HOME = """\
# Our home.
hotspots:
  - {label: kitchen, x: 1.0, y: 1.0, yaw: 90 deg, polygon: [[0, 0], [4, 0], [4, 5], [0, 5]]}   # cooking
zones:
  - {label: stairs, kind: keep_out, polygon: [[6, 3], [8, 3], [8, 5], [6, 5]]}
  - {label: rug, kind: slow, speed_limit: 0.2 m/s, polygon: [[1, 2], [3, 2], [3, 4], [1, 4]]}
  - {label: mat, kind: slow, speed_limit: 20 %, polygon: [[2, 2], [3, 2], [3, 4], [2, 4]]}
"""


class Terminal:
    """A locator with its file, a map, and somebody who types commands."""

    def __init__(self, ros: Any, folder: Path) -> None:
        self.ros = ros
        self.file = folder / "home.yaml"
        self.file.write_text(HOME)
        self.caller: FlorenceNode = ros.add(FlorenceNode("caller"))
        self.maps = self.caller.create_publisher(OccupancyGridMsg, "map", LATCHED)
        self.frames = TransformBroadcaster(self.caller)
        self.locator = ros.add(LocatorNode(parameters={"hotspots_file": str(self.file)}))
        self.heard: dict[str, Any] = {}

    def hear(self, kind: Any, topic: str) -> None:
        def take(message: Any) -> None:
            self.heard[topic] = message

        self.caller.create_subscription(kind, topic, take, LATCHED)

    def tell_map(self) -> None:
        self.maps.publish(grid_to_ros(make_map(), "map", 0.0))

    def call(self, kind: Any, name: str, **fields: Any) -> Any:
        client = self.caller.create_client(kind, name)
        self.ros.spin_until(client.service_is_ready, what=name)
        future = client.call_async(kind.Request(**fields))
        self.ros.spin_until(future.done, what=f"the answer of {name}")
        return future.result()

    def type(self, *arguments: str) -> tuple[int, str]:
        """Run a command; the robot stands at (2, 3, 0.5 rad) meanwhile."""
        process = subprocess.Popen(
            [sys.executable, "-m", "florence_bt.cli", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

        told = 0.0

        def over() -> bool:
            nonlocal told
            now = self.caller.timebase.now()
            if now - told > 0.2:
                told = now
                self.frames.send("map", "base_link", now, Pose2(2.0, 3.0, 0.5))
            return process.poll() is not None

        try:
            self.ros.spin_until(over, what=" ".join(arguments))
        finally:
            process.kill()  # harmless when it is over
            output, _ = process.communicate()
        return process.returncode, output


@pytest.fixture
def terminal(ros: Any, tmp_path: Path) -> Terminal:
    return Terminal(ros, tmp_path)


def test_zones_are_told_as_nav2s_filters_read_them(terminal: Terminal) -> None:
    for topic in ("keepout_filter_info", "speed_filter_info"):
        terminal.hear(CostmapFilterInfo, topic)
    for topic in ("keepout_filter_mask", "speed_filter_mask"):
        terminal.hear(OccupancyGridMsg, topic)
    terminal.tell_map()
    terminal.ros.spin_until(lambda: len(terminal.heard) == 4, what="the masks")
    heard = terminal.heard
    assert (heard["keepout_filter_info"].type, heard["speed_filter_info"].type) == (0, 2)
    assert heard["speed_filter_info"].filter_mask_topic == "/speed_filter_mask"
    keep_out, speed = (grid_from_ros(heard[f"{name}_filter_mask"]) for name in ("keepout", "speed"))
    assert (
        keep_out.cells[keep_out.cell_of(7.0, 4.0)] == 100 and keep_out.cells[keep_out.cell_of(5.0, 4.0)] == 0
    )

    def limit(x: float, y: float) -> float:
        info = heard["speed_filter_info"]
        return float(info.base + info.multiplier * speed.cells[speed.cell_of(x, y)])

    # 20 % of 0.45 m/s are 0.09 m/s; 0 is no limit.
    assert np.allclose([limit(1.5, 3.0), limit(2.5, 3.0), limit(5.0, 3.0)], [0.2, 0.09, 0.0])


def test_navigation_keeps_to_the_zones_of_the_file_also_after_a_reload(terminal: Terminal) -> None:
    ros, navigation = terminal.ros, terminal.ros.add(NavigationNode())
    terminal.tell_map()
    ros.spin_until(lambda: navigation.navigation.navigator, what="the costmaps")
    plans = ActionClient(terminal.caller, ComputePathToPose, "compute_path_to_pose")
    ros.spin_until(plans.server_is_ready, what="the planner")

    def plan() -> Any:
        start, goal = (pose_stamped_to_ros(pose, "map", 0.0) for pose in (Pose2(1, 1), Pose2(7, 4)))
        sent = plans.send_goal_async(ComputePathToPose.Goal(start=start, goal=goal, use_start=True))
        ros.spin_until(sent.done, what="the goal")
        result = sent.result().get_result_async()
        ros.spin_until(result.done, what="the plan")
        return result.result().result

    ros.spin_until(lambda: plan().error_code == 206, what="the zones")
    assert "'stairs'" in plan().error_msg
    terminal.file.write_text(HOME.partition("zones:")[0])
    told = terminal.call(Trigger, "florenceLocator/reloadHotspots")
    assert told.success and "zones: 0" in told.message
    ros.spin_until(lambda: plan().error_code == 0, what="no zones")
    terminal.file.write_text("hotspots:\n  - {label: a, x: 1, y: 2}\nzones: [{}]\n")
    told = terminal.call(Trigger, "florenceLocator/reloadHotspots")
    assert not told.success and f"{terminal.file}:3:9" in told.message
    assert plan().error_code == 0
    plans.destroy()


def test_zones_that_cannot_be_meant_are_refused(terminal: Terminal) -> None:
    navigation = terminal.ros.add(NavigationNode())
    zones = terminal.caller.create_publisher(Zones, "zones", LATCHED)
    square = [Point32(x=x, y=y) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))]
    for bad in (
        ZoneMsg(label="a", kind=7, area=Polygon(points=square)),
        ZoneMsg(label="a", area=Polygon(points=square[:2])),
        ZoneMsg(label="a", area=Polygon(points=[*square, Point32(x=float("nan"))])),
        ZoneMsg(label="a", kind=ZoneMsg.SLOW, area=Polygon(points=square)),
        ZoneMsg(
            label="a", kind=ZoneMsg.SLOW, area=Polygon(points=square), speed_limit=101.0, percentage=True
        ),
    ):
        before = navigation.health.refused["zones"]
        terminal.ros.spin_until(zones.get_subscription_count, what="the subscription")
        zones.publish(Zones(zones=[bad]))
        terminal.ros.spin_until(lambda before=before: navigation.health.refused["zones"] > before, what="it")


def test_a_taught_place_is_an_object_unless_it_is_called_like_a_room(terminal: Terminal) -> None:
    for label, kind in (
        ("sofa", "object"),
        ("Living Room", "room"),
        ("bedroom_2", "room"),
        ("kitchen", "room"),
    ):
        told = terminal.call(SetHotspot, "florenceLocator/setHotspot", label=label, x=3.0, y=2.0, phi=0.5)
        assert told.success and f" {kind} in " in told.message
        spot = load_hotspots(terminal.file).get(label)
        assert spot is not None and (spot.kind, spot.pose.x) == (kind, 3.0)
    assert "sofa" not in terminal.call(Trigger, "florenceLocator/getRooms").message
    kitchen = load_hotspots(terminal.file).get("kitchen")
    assert kitchen is not None and len(kitchen.polygon) == 4
    assert terminal.file.read_text().startswith("# Our home.") and "# cooking" in terminal.file.read_text()


def test_places_are_taught_and_looked_at_from_a_terminal(terminal: Terminal) -> None:
    code, output = terminal.type("hotspot", "here", "sofa")
    assert code == 0, output
    sofa = load_hotspots(terminal.file).get("sofa")
    assert sofa is not None and (sofa.kind, sofa.pose.x, sofa.pose.y) == ("object", 2.0, 3.0)
    assert abs(sofa.pose.yaw - 0.5) < 1e-3
    terminal.hear(Zones, "zones")
    code, output = terminal.type("hotspot", "zone", "remove", "stairs")
    assert code == 0, output
    terminal.ros.spin_until(
        lambda: [zone.label for zone in terminal.heard["zones"].zones] == ["rug", "mat"], what="the zones"
    )
    code, output = terminal.type("where", "--json")
    facts = json.loads(output.splitlines()[-1])
    assert code == 0 and facts["robot"]["values"] == {"x": 2.0, "y": 3.0, "yaw_deg": 28.6, "room": "kitchen"}
    assert {name for name, fact in facts.items() if not fact["known"]} >= {
        "mission",
        "battery",
        "user",
        "seen",
    }
    assert all(fact["text"].startswith("not known: ") for fact in facts.values() if not fact["known"])


def test_a_place_off_the_map_or_in_a_wall_is_refused_and_changes_nothing(terminal: Terminal) -> None:
    terminal.tell_map()
    before = terminal.file.read_text()
    for words in (
        ("add", "sofa", "x=100", "y=100"),
        ("move", "kitchen", "x=-30"),
        ("add", "cupboard", "x=6.3", "y=0.5"),
    ):
        code, output = terminal.type("hotspot", *words)
        assert code == 2 and words[1] in output and "the robot can stand" in output, output
    assert terminal.file.read_text() == before
    far = "polygon=[[100, 100], [101, 100], [101, 101]]"
    code, output = terminal.type("hotspot", "zone", "add", "far", "kind=keep_out", far)
    assert code == 2 and "no part of the zone far is on the map" in output, output
    assert terminal.file.read_text() == before
    for x, y in ((100.0, 100.0), (6.3, 0.5)):
        told = terminal.call(SetHotspot, "florenceLocator/setHotspot", label="sofa", x=x, y=y)
        assert not told.success and "the robot can stand" in told.message
    assert terminal.file.read_text() == before
    code, output = terminal.type("hotspot", "add", "sofa", "x=3", "y=2")
    assert code == 0 and "sofa" in terminal.file.read_text(), output
    code, output = terminal.type("hotspot", "rename", "sofa", "settee")
    assert code == 0, output


@pytest.mark.parametrize(
    ("state", "reason", "says"),
    [
        ("PENDING", "", "waits for its turn"),
        ("ACTIVE", "", "runs"),
        ("ACTIVE", "a visitor", "florence resume"),
        ("ABORTED", "no way", "failed: no way"),
    ],
)
def test_where_tells_how_the_mission_stands(terminal: Terminal, state: str, reason: str, says: str) -> None:
    server = terminal.ros.add(FlorenceNode("florence_bt"))
    runs = server.create_publisher(RunState, "florence_bt/run_state", LATCHED)
    runs.publish(RunState(run_id="7", mission="greet", state=state, reason=reason))
    code, output = terminal.type("where", "--json")
    mission = json.loads(output.splitlines()[-1])["mission"]
    assert code == 0 and mission["known"] and says in mission["text"] and "greet" in mission["text"]
    paused = (state, bool(reason)) == ("ACTIVE", True)
    assert mission["values"]["paused"] == paused == ("a visitor" in mission["text"])
    assert ("runs" in mission["text"]) == (says == "runs")


def test_where_does_not_take_the_silence_of_the_mission_server_for_no_mission(terminal: Terminal) -> None:
    server = terminal.ros.add(FlorenceNode("florence_bt"))
    code, output = terminal.type("where", "--json")
    mission = json.loads(output.splitlines()[-1])["mission"]
    assert code == 0 and not mission["known"] and "tells nothing" in mission["text"]
    server.create_publisher(RunState, "florence_bt/run_state", LATCHED).publish(RunState(state="IDLE"))
    code, output = terminal.type("where", "--json")
    mission = json.loads(output.splitlines()[-1])["mission"]
    assert mission["known"] and mission["text"] == "none has run yet"


def test_the_last_word_of_a_driver_that_hangs_is_old(terminal: Terminal) -> None:
    caller = terminal.caller
    battery = caller.create_publisher(BatteryState, "battery_state", LATCHED)
    sent = BatteryState(percentage=0.5)

    def told(stamp: Callable[[], float], *, goes_on: bool = True) -> dict[str, Any]:
        def tell() -> None:
            sent.header = header_to_ros("base_link", stamp())
            battery.publish(sent)

        tell()
        timer = caller.create_timer(0.2, tell) if goes_on else None
        code, output = terminal.type("where", "--json")
        if timer is not None:
            timer.cancel()
        assert code == 0, output
        fact: dict[str, Any] = json.loads(output.splitlines()[-1])["battery"]
        return fact

    assert told(lambda: 99.0)["known"], "of a clock that nobody tells: how old it is, is not known"
    assert told(caller.stamp)["values"]["charge"] == 0.5
    assert told(lambda: 0.0)["known"], "a stamp of zero is none"
    hangs = told(lambda: caller.stamp() - 60.0, goes_on=False)
    told_age = re.search(r"the last time (\d+)", hangs["text"])
    assert not hangs["known"] and told_age is not None and int(told_age[1]) >= 60
    clock = caller.create_publisher(Clock, "/clock", RELIABLE)
    caller.create_timer(0.05, lambda: clock.publish(Clock(clock=stamp_to_ros(100.0))))
    assert told(lambda: 99.0)["known"] and not told(lambda: 90.0, goes_on=False)["known"]


def test_where_tells_which_processes_hang_or_are_late_and_who_holds_the_robot(terminal: Terminal) -> None:
    up, busy = (terminal.ros.add(FlorenceNode(name)) for name in (SUPERVISOR, "busy"))
    terminal.ros.add(OverrideDriver("turtlebot_node", on=True))
    code, output = terminal.type("where", "--json")
    assert code == 0 and "processes" not in json.loads(output.splitlines()[-1])
    found = {
        "process hardware": Diagnosis(Severity.ERROR, "has not answered for 3 s"),
        "process people": Diagnosis(Severity.OK, "runs"),
    }
    publisher = diagnostics_publisher(up)
    call_every(
        up.steady, 0.5, lambda: publisher.publish(diagnostics_to_ros(found, SUPERVISOR, "", up.stamp()))
    )
    busy.health.count_late(3.2)
    code, output = terminal.type("where", "--json")
    facts = json.loads(output.splitlines()[-1])
    hangs, late = facts["processes"]["text"].split("; ")
    assert hangs == "process hardware: has not answered for 3 s"
    assert late == "the process of busy is 3.2 s behind: the machine is too busy"
    assert facts["mission"]["text"].endswith("; the manual override is on")
