"""The clock jumps by an hour under drivers, a filter, sensors of the house and a mission: all go on."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("florence_interfaces")
from florence_interfaces.msg import HomeEvent, UserSeen
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image, LaserScan

from florence_bt.drivers.hokuyo.node import HokuyoNode
from florence_bt.drivers.kinect.codec import raw_from_metres
from florence_bt.drivers.kinect.node import KinectNode
from florence_bt.drivers.turtlebot.node import TurtlebotNode
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.ros.clock import RosClock
from florence_bt.ros.conversions import stamp_from_ros, stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR
from florence_bt.runtime.node import MissionNode
from florence_bt.runtime.run import MissionRequest
from florence_bt.simulation.emulators.kinect_frames import KinectFrameServer
from florence_bt.skills.filters.velocity_filter.node import VelocityFilterNode
from florence_bt.skills.home_sensors.node import HomeSensorsNode
from tests.ros.conftest import DRIVE, FakeSafety
from tests.ros.hokuyo_hardware import Hardware
from tests.ros.test_turtlebot_node import Device
from tests.scripted_skill import ScriptedSkill

pytestmark = pytest.mark.ros

HOUR_S = 3600.0
JUMPS = {"ahead and back": (HOUR_S, -HOUR_S), "ahead": (HOUR_S,), "back": (-HOUR_S,)}
AWAY_S = 0.8
"""How long the clock is wrong, when it comes back."""
WAIT_S, DEADLINE_S = 1.2, 2.0
MISSION = f"""\
mission: long
description: Waits, then drives without end.
tree:
  timeout: {DEADLINE_S} s
  do:
    sequence:
      - wait: {WAIT_S} s
      - drive: {{way: 1 m}}
"""
HOTSPOTS = """\
hotspots:
- {label: kitchen, x: 1, y: 1}
- {label: bath, x: 5, y: 1}
"""
HOME = """\
sensors:
  one: {room: kitchen}
  other: {room: bath}
"""
DEPTH = raw_from_metres(np.full((24, 32), 2.0, np.float32))


class MachineClock:
    """The clock of the machine, which somebody sets."""

    parameters: ClassVar[dict[str, Any]] = {}

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._ahead = 0.0
        monkeypatch.setattr(RosClock, "_read", lambda _clock: self.now())

    def now(self) -> float:
        return time.time() + self._ahead

    def jump(self, seconds: float) -> None:
        self._ahead += seconds

    def close(self) -> None:
        """Nothing to do."""


class SimulatedClock:
    """A simulation that publishes its time a hundred times a second, and starts over."""

    parameters: ClassVar[dict[str, Any]] = {"use_sim_time": True}

    def __init__(self, node: FlorenceNode) -> None:
        self._node = node
        self._topic = node.create_publisher(Clock, "/clock", RELIABLE)
        self._zero = time.monotonic() - 2.0 * HOUR_S
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def now(self) -> float:
        return time.monotonic() - self._zero

    def jump(self, seconds: float) -> None:
        self._zero -= seconds

    def close(self) -> None:
        self._end.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._end.wait(0.01):
            self._topic.publish(Clock(clock=stamp_to_ros(self.now())))


class SecondClock(SimulatedClock):
    """A simulation beside which somebody else publishes another time, twice as often."""

    _ahead = 0.0

    def jump(self, seconds: float) -> None:
        self._ahead += seconds

    def _run(self) -> None:
        while not self._end.wait(0.01):
            self._topic.publish(Clock(clock=stamp_to_ros(self.now())))
            for _ in range(2 if self._ahead else 0):
                self._topic.publish(Clock(clock=stamp_to_ros(self.now() + self._ahead)))


class Everything:
    """Emulated hardware, the nodes on it, a mission server, and somebody who listens."""

    def __init__(self, ros: Any, folder: Path, device: Device, clock: Any, judge: FlorenceNode) -> None:
        self.ros, self.clock, self.judge, self.device = ros, clock, judge, device
        self.laser, self.kinect = Hardware(folder / "laser"), KinectFrameServer(folder / "kinect")
        self.laser.plug_in()
        self.came: dict[str, list[float]] = {}
        for kind, topic, qos in (
            (LaserScan, "scan", SENSOR),
            (Odometry, "odom", RELIABLE),
            (Image, "camera/depth/image", SENSOR),
        ):
            self._listen(kind, topic, qos)
        self.filtered: list[float] = []
        judge.create_subscription(
            Twist, "filtered_cmd_vel", lambda message: self.filtered.append(message.linear.x), RELIABLE
        )
        self.seen: list[UserSeen] = []
        judge.create_subscription(UserSeen, "home_sensors/user_seen", self.seen.append, LATCHED)
        self.command = judge.create_publisher(Twist, "cmd_vel", RELIABLE)
        self.event = judge.create_publisher(HomeEvent, "home_sensors/event", RELIABLE)
        self._next_picture = self._next_command = 0.0
        self._make_nodes(folder, clock.parameters)

    def _listen(self, kind: Any, topic: str, qos: Any) -> None:
        came = self.came[topic] = []
        self.judge.create_subscription(
            kind,
            topic,
            lambda message: came.append(stamp_from_ros(message.header.stamp) - self.clock.now()),
            qos,
            judge_stamps=False,
        )

    def _make_nodes(self, folder: Path, parameters: dict[str, Any]) -> None:
        (folder / "hotspots.yaml").write_text(HOTSPOTS)
        (folder / "home.yaml").write_text(HOME)
        (folder / "missions").mkdir()
        (folder / "missions" / "long.yaml").write_text(MISSION)
        home = {"home_file": str(folder / "home.yaml"), "hotspots_file": str(folder / "hotspots.yaml")}
        runs = {"runs_folder": str(folder / "runs"), "mission_folders": (str(folder / "missions"),)}

        def make_skills(node: FlorenceNode) -> dict[str, ScriptedSkill]:
            self.drive = ScriptedSkill(DRIVE, node.timebase, (Step(None),))
            return {"drive": self.drive}

        add = self.ros.add
        # Patience with a busy machine, not with a clock.
        patient = {"reply_timeout_s": 10.0, "silence_timeout_s": 10.0}
        add(HokuyoNode(parameters={"port": str(self.laser.link), **patient, **parameters}))
        base = {"port": str(folder / "create"), "reconnect_delay_s": 0.05, "data_timeout": 10.0}
        add(TurtlebotNode(parameters=base | parameters))
        add(KinectNode(parameters={"source": str(self.kinect.path), **parameters}))
        add(VelocityFilterNode(parameters=parameters))
        add(HomeSensorsNode(parameters=home | parameters))
        self.server = add(
            MissionNode(
                make_skills,
                {"drive": DRIVE},
                make_safety=lambda node, goals: FakeSafety(),
                parameters=runs | parameters,
            )
        )

    def close(self) -> None:
        self.laser.unplug()
        self.kinect.close()

    def until(self, condition: Callable[[], Any], what: str) -> None:
        """Serve everything; far less than an hour is enough."""

        def served() -> Any:
            self.laser.serve()
            if time.monotonic() >= self._next_picture:
                self._next_picture = time.monotonic() + 0.05
                self.kinect.send_raw_depth(DEPTH, 0.0)
            return condition()

        self.ros.spin_until(served, what=what)

    def goes(self) -> None:
        """Everything sends, with stamps of the clock as it is, and obeys."""
        for topic, came in self.came.items():
            came.clear()
            self.until(lambda came=came: sum(abs(age) < 3.0 for age in came) >= 3, topic)
        self.device.wheels, self.filtered[:] = (0.0, 0.0), []

        def drives() -> bool:
            message = Twist()
            message.linear.x = 0.2
            if time.monotonic() >= self._next_command:
                self._next_command = time.monotonic() + 0.05
                self.command.publish(message)
            return self.device.wheels == (0.2, 0.2) and max(self.filtered, default=0.0) > 0.1

        self.until(drives, "a velocity that is obeyed")
        self.until(lambda: self.device.wheels == (0.0, 0.0), "the stop when nobody commands")
        self.until(lambda: self.filtered[-1] == 0.0, "the stop of the filter")

    def runs_a_mission_through(self, jumps: tuple[float, ...]) -> None:
        """A wait and a deadline keep their length, and no hour is in the record."""
        self.drive.runs.clear()
        begun = time.monotonic()
        run = self.server._missions.trigger(MissionRequest("long", {}, "test"))
        for number, seconds in enumerate(jumps):
            end = time.monotonic() + (AWAY_S if number else 0.1)
            self.until(lambda end=end: time.monotonic() > end, "the jump")
            self.clock.jump(seconds)
        self.until(lambda: self.drive.runs, "the end of the wait")
        assert time.monotonic() - begun > WAIT_S - 0.1
        self.until(lambda: run.status.final, "the deadline")
        assert time.monotonic() - begun > DEADLINE_S - 0.1
        assert run.why is not None and run.why.code == "timed_out"
        assert DEADLINE_S - 0.1 < run.ended - run.started < 30.0

    def is_told_of(self, sensor: str, room: str) -> None:
        for active in (False, True):
            now = stamp_to_ros(self.clock.now())
            self.event.publish(HomeEvent(sensor=sensor, active=active, stamp=now))
        self.until(lambda: self.seen and self.seen[-1].room == room, f"the report of {sensor}")


CLOCKS = {"machine": MachineClock, "simulation": SimulatedClock, "second clock": SecondClock}


@pytest.fixture
def everything(
    ros: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> Iterator[Everything]:
    device, judge = Device(tmp_path / "create"), ros.add(FlorenceNode("judge"))
    clock = CLOCKS[request.param](monkeypatch if request.param == "machine" else judge)
    made = Everything(ros, tmp_path, device, clock, judge)
    yield made
    clock.close()
    made.close()
    device.close()


@pytest.mark.parametrize(
    ("everything", "cases"),
    [("machine", [*JUMPS]), ("simulation", [*JUMPS]), ("second clock", ["ahead and back"])],
    indirect=["everything"],
    ids=["machine", "simulation", "second clock"],
)
def test_everything_goes_on(everything: Everything, cases: list[str]) -> None:
    everything.goes()
    everything.is_told_of("one", "kitchen")
    for case, (sensor, room) in zip(cases, itertools.cycle((("other", "bath"), ("one", "kitchen")))):
        print(case)
        everything.runs_a_mission_through(JUMPS[case])
        everything.goes()
        everything.is_told_of(sensor, room)
