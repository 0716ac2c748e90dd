"""A system in a folder and a ROS domain of its own, with a program beside it that watches the wheels."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from types import TracebackType
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from florence_interfaces.srv import (
    MissionStatus,
    PauseMission,
    ResumeMission,
    RunMission,
    SetTurtlebotMode,
)
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav2_msgs.action import NavigateToPose, Spin
from nav2_msgs.srv import LoadMap
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Bool, String
from std_srvs.srv import SetBool

from florence_bt.core.geometry import Pose2
from florence_bt.ros.conversions import pose_to_ros
from florence_bt.ros.environment import stay_on_this_machine
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.runtime.run import FINAL
from florence_bt.simulation.hardware.node import TRUTH_PERIOD_S

FLORENCE = [sys.executable, "-m", "florence_bt.cli"]
GROUPS = ("simulator", "hardware", "navigation", "people", "missions")
READY_S = 300.0
END_S = 60.0
DRIVE_S = 60.0
STAND_S = 20.0
STATUS_S = 60.0
SELF_TEST_S = 120.0
ASK_AGAIN_S = 3.0
ENDED = tuple(status.value for status in FINAL)
FLAT = Path(__file__).resolve().parents[2] / "maps" / "flat.yaml"
PATROL = """\
mission: patrol
description: Drives to and fro until somebody ends it.
on_restart: restart
tree:
  repeat: 1000
  do:
    sequence:
      - run: goto_room
        with: {room: kitchen}
      - run: goto_room
        with: {room: bedroom}
"""


class CampaignFailed(Exception):
    """Something did not happen that everything else needs."""


class RunningSystem:
    """``florence up --sim`` and a ROS node beside it. Use as a context manager.

    Attributes:
        folder: The folder of the bring-up.
        truth: What the simulator said last: wheels (m/s), moving, robot (x, y, yaw), monotonic (s).
        truths: Everything it said since :meth:`forget`.
        overridden: What the base's driver said last of the override, None before it said something.
    """

    def __init__(self, seed: int = 0, *options: str) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="florence-campaign-"))
        missions = self.folder / "missions"
        missions.mkdir()
        (missions / "patrol.yaml").write_text(PATROL)
        self._log = self.folder / "up.txt"
        self._command = [*FLORENCE, "up", "--sim", "--person", "absent", "--seed", str(seed)]
        self._command += ["--out", str(self.folder / "out"), "--missions", str(missions), *options]
        self.truth: dict[str, Any] = {}
        self.truths: list[dict[str, Any]] = []
        self.overridden: bool | None = None
        self._laser = ""

    def __enter__(self) -> RunningSystem:
        """Bring it up and wait until it is ready."""
        stay_on_this_machine()
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                self._command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT
            )
        try:
            self._context = rclpy.Context()
            rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
            self._loop = SpinLoop(self._context)
            self.node = FlorenceNode("campaign", context=self._context)
            self._loop.add(self.node)
            self._make_interfaces()
            self.wait(
                lambda: "ready after" in self.output or self.process.poll() is not None, "ready", READY_S
            )
            if self.process.poll() is not None:
                raise CampaignFailed(f"it did not come up:\n{self.output}")
            self.wait(
                lambda: self.truth and self.overridden is not None, "the simulator and the base", READY_S
            )
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End it; its folder stays when something went wrong."""
        self._loop.close()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)
        self._end()
        if kind is None:
            shutil.rmtree(self.folder)

    @property
    def output(self) -> str:
        """Read what ``florence up`` has printed."""
        return self._log.read_text()

    def pid(self, group: str) -> int | None:
        """Return the process of a group of nodes, None when there is none."""
        for entry in Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            try:
                words = (entry / "cmdline").read_bytes().decode(errors="replace").split("\0")
                state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
            except OSError:
                continue
            mine = words[2:4] == ["florence_bt.app.bringup.process", group] and str(self.folder) in words[4]
            if mine and state != "Z":
                return int(entry.name)
        return None

    def pids(self) -> dict[str, int]:
        """Return the processes that are there, by group."""
        found = {group: self.pid(group) for group in GROUPS}
        return {group: pid for group, pid in found.items() if pid is not None}

    def send(self, group: str, number: signal.Signals) -> None:
        """Send a signal to the process of a group."""
        pid = self.pid(group)
        if pid is None:
            raise CampaignFailed(f"there is no process {group!r}")
        os.kill(pid, number)

    def spin(self, seconds: float) -> None:
        """Serve callbacks for a while."""
        self.spin_until(lambda: False, seconds)

    def spin_until(self, done: Callable[[], Any], limit_s: float) -> bool:
        """Serve callbacks until a condition holds; whether it does."""
        end = time.monotonic() + limit_s
        while not done():
            rest = end - time.monotonic()
            if rest <= 0.0:
                return False
            self._loop.spin_once(min(rest, 0.02))
        return True

    def wait(self, done: Callable[[], Any], what: str, limit_s: float = 30.0) -> None:
        """Wait as :meth:`spin_until` does.

        Raises:
            CampaignFailed: It did not come.
        """
        if not self.spin_until(done, limit_s):
            raise CampaignFailed(f"waited {limit_s:g} s for {what}:\n{self.output}")

    def forget(self) -> None:
        """Begin a new list of truths."""
        self.truths.clear()

    def drive_by_mission(self) -> None:
        """Start the patrol."""
        self._start(RunMission.Request(mission="patrol", caller="campaign", policy="preempt"))

    def pause(self, reason: str) -> None:
        """Pause the run, and wait for the answer."""
        self._call(self._pause, PauseMission.Request(reason=reason))

    def resume(self) -> None:
        """Let the run go on, and wait for the answer."""
        self._call(self._resume, ResumeMission.Request())

    def wait_for_drive(self, dice: random.Random) -> bool:
        """Wait for a random moment of a drive; whether there was one."""
        if not self.spin_until(lambda: self.truth["moving"], DRIVE_S):
            return False
        self.spin(dice.uniform(0.0, 2.0))
        return self.spin_until(lambda: self.truth["moving"], DRIVE_S)

    def seconds_to_stand(self) -> float:
        """Measure how long the base still moves, in simulated time; infinite when it does not stop.

        The simulation waits up to a second for a process that hangs, and nothing moves meanwhile.
        """
        last, since = self.truth["time"], time.monotonic() - self.truth["monotonic"]
        begin = last + min(since, TRUTH_PERIOD_S)
        stood = self.spin_until(lambda: not self.truth["moving"], STAND_S)
        return max(0.0, self.truth["time"] - begin) if stood else float("inf")

    def put_back(self) -> None:
        """Undo what other programs may do: let the robot go, set mode, map and place, wait for the laser."""
        self.switch.publish(Bool(data=False))
        self._ask(SetBool, "velocity_filter/hard_stop", SetBool.Request(data=False))
        self._ask(SetTurtlebotMode, "turtlebot_node/set_operation_mode", SetTurtlebotMode.Request(mode=3))
        self._ask(LoadMap, "map_server/load_map", LoadMap.Request(map_url=FLAT.as_uri()))
        x, y, yaw = self.truth["robot"]
        place = PoseWithCovarianceStamped()
        place.header.frame_id = "map"
        place.pose.pose = pose_to_ros(Pose2(x, y, yaw))
        self.place.publish(place)
        self._laser = ""
        self.wait(lambda: self._laser == "measuring", "the laser", SELF_TEST_S)

    def runs_to_pose(self, x: float, y: float) -> Any:
        """Run goto_pose to its end; the status of the mission server then."""
        request = RunMission.Request(mission="goto_pose", caller="campaign", policy="preempt")
        request.input_names, request.input_values = ["x", "y"], [f"{x} m", f"{y} m"]
        run_id = self._start(request)
        self.wait(lambda: self.status().state in ENDED, f"the end of {run_id}", DRIVE_S)
        return self.status()

    def drive_by_topic(self, x: float, y: float) -> None:
        """Send a goal as RViz does."""
        self.goal_pose.publish(_pose(x, y))

    def drive_by_action(self, x: float, y: float) -> Any:
        """Send a goal as any client of navigation does; the future has navigation's answer."""
        return self._poses.call_async(_goal(NavigateToPose, pose=_pose(x, y)))

    def turn_by_action(self, angle: float) -> Any:
        """Send a turn as any client does; the future has navigation's answer."""
        goal = _goal(Spin, target_yaw=angle)
        goal.goal.time_allowance.sec = 20
        return self._spins.call_async(goal)

    def status(self) -> Any:
        """Ask for the status of the mission server.

        Asked for again and again: a question may go to a server that was killed just now and is still known.
        """
        end = time.monotonic() + STATUS_S
        while time.monotonic() < end:
            self.wait(self._status.service_is_ready, "the status")
            future = self._status.call_async(MissionStatus.Request())
            if self.spin_until(future.done, ASK_AGAIN_S):
                return future.result()
        raise CampaignFailed(f"no status came within {STATUS_S:g} s:\n{self.output}")

    def _start(self, request: RunMission.Request) -> str:
        self.wait(self._run.service_is_ready, "the mission server")
        future = self._run.call_async(request)
        self.wait(future.done, "the answer of the mission server")
        if not future.result().accepted:
            raise CampaignFailed(f"{request.mission} was refused: {future.result().message}")
        return str(future.result().run_id)

    def _ask(self, kind: Any, name: str, request: Any) -> None:
        client = self.node.create_client(kind, name)
        self.wait(client.service_is_ready, name)
        future = client.call_async(request)
        self.wait(future.done, f"the answer of {name}")

    def _call(self, client: Any, request: Any) -> None:
        self.wait(client.service_is_ready, client.srv_name)
        future = client.call_async(request)
        self.wait(future.done, f"the answer of {client.srv_name}")
        if not future.result().success:
            raise CampaignFailed(f"{client.srv_name} was refused: {future.result().message}")

    def _make_interfaces(self) -> None:
        node = self.node
        node.create_subscription(String, "simulator/truth", self._on_truth, 100)
        node.create_subscription(Bool, "manual_override", self._on_override, LATCHED)
        self.switch = node.create_publisher(Bool, "florenceLocator/manualOverride", RELIABLE)
        self.goal_pose = node.create_publisher(PoseStamped, "goal_pose", RELIABLE)
        self.velocities = [
            node.create_publisher(Twist, name, RELIABLE) for name in ("cmd_vel", "filtered_cmd_vel")
        ]
        self.by_hand = node.create_publisher(Twist, "manual_cmd_vel", RELIABLE)
        node.create_subscription(DiagnosticArray, "diagnostics", self._on_diagnostics, RELIABLE)
        self.place = node.create_publisher(PoseWithCovarianceStamped, "initialpose", RELIABLE)
        self._pause = node.create_client(PauseMission, "florence_bt/pause")
        self._resume = node.create_client(ResumeMission, "florence_bt/resume")
        self._run = node.create_client(RunMission, "florence_bt/run_mission")
        self._status = node.create_client(MissionStatus, "florence_bt/status")
        self._poses = _goal_client(node, NavigateToPose, "navigate_to_pose")
        self._spins = _goal_client(node, Spin, "spin")

    def _on_truth(self, message: String) -> None:
        try:
            truth = json.loads(message.data)
        except ValueError:
            return  # of the attack with messages, which leaves no topic out
        if isinstance(truth, dict) and "robot" in truth:
            self.truth = truth
            self.truths.append(truth)

    def _on_override(self, message: Bool) -> None:
        self.overridden = bool(message.data)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == "hokuyo_node: laser scanner":
                self._laser = status.message

    def _end(self) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


BringUp = Callable[[int], AbstractContextManager[RunningSystem]]
"""Brings a system up by a seed; with one that gives the same system again and again, attacks share it."""


def _goal_client(node: FlorenceNode, action: Any, name: str) -> Any:
    """Make a client that sends goals and asks for nothing else, as a program that dies after it does."""
    return node.create_client(action.Impl.SendGoalService, f"{name}/_action/send_goal")


def _goal(action: Any, **fields: Any) -> Any:
    request = action.Impl.SendGoalService.Request(goal=action.Goal(**fields))
    request.goal_id.uuid = list(os.urandom(16))
    return request


def _pose(x: float, y: float) -> PoseStamped:
    message = PoseStamped()
    message.header.frame_id = "map"
    message.pose.position.x, message.pose.position.y = x, y
    message.pose.orientation.w = 1.0
    return message
