"""The simulated hardware as a process on ROS: gives the simulated time on /clock and the truth on a topic.

Everything else goes through the emulated ports, as on the robot.
"""

from __future__ import annotations

import json
import select
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from florence_bt.core.limits import CheckedParameters, Limits
from florence_bt.core.topic_names import CLOCK, FILTERED_SCAN, SCAN, SIMULATOR_TRUTH
from florence_bt.ros.conversions import stamp_from_ros, stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR, TF_LISTENER
from florence_bt.ros.tf import TF_TOPIC
from florence_bt.simulation.hardware.server import STEP_S, HardwareServer
from florence_bt.simulation.hardware.slowest_reader import SlowestReader

CLOCK_PERIOD_S = 0.01
RESTING_CLOCK_PERIOD_S = 0.03
"""Simulated seconds between two messages on ``/clock``, while something moves and while nothing does.

Each message wakes every process; with fewer than 30 a second the odometry, which is stamped by them, would
be slower too.
"""
LONGEST_BURST_S = 0.02
"""Simulated seconds that are stepped at once; then, and after each message, the wall clock is waited for."""
TRUTH_PERIOD_S = 0.2
MAX_BACKLOG_S = 0.05
"""Wall seconds of missed time that are made up for; more is dropped, the simulation then runs slower."""
MOST_LAG_S = 0.4
"""Simulated seconds that the scans may be behind what the laser said last.

Frames are looked up until half a second after the last.
"""
MOST_FILTERED_LAG_S = 0.7
"""The same for the scans at the end of the filters: navigation takes none that is older than a second."""
MOST_BASE_LAG_S = 0.3
"""The same for the odometry: the base counts as silent after half a second."""
MOST_NAVIGATION_LAG_S = 0.1
"""The same for the localiser, which tells where the robot is for 0.2 s after the odometry that it has."""
READER_TIMEOUT_S = 5.0
"""Wall seconds without a scan after which the simulated time goes on, should the drivers make none of it."""
CATCH_UP_LOOK_S = 0.005
"""Wall seconds between two looks whether the drivers and the localiser have caught up."""
ODOM_FRAME, BASE_FRAME = "odom", "base_footprint"
"""The frames that the localiser places in the map, and the driver of the base in the odometry frame, many
times a second: they show that navigation and the driver keep up."""
TRANSFORM_TIMEOUT_S = 1.0
"""Wall seconds without a transform after which the simulated time goes on: its process hangs or has ended."""


@dataclass(frozen=True, slots=True)
class SimulatorParameters(CheckedParameters):
    """Parameters of the simulator.

    Attributes:
        speed: Simulated seconds per wall second aimed at; fewer where the drivers cannot follow.
        catch_up: Make up for all missed time, and publish no ``/clock``: the drivers follow the wall clock.
    """

    speed: Annotated[float, Limits(0.05, 100.0)] = 1.0
    catch_up: bool = False


class SimulatorNode(FlorenceNode):
    """Runs the simulated hardware in a thread of its own.

    Args:
        make_server: Builds the hardware; called on the thread that runs it.
        parameters: Overrides of the node's parameters.
    """

    parameter_classes = (SimulatorParameters,)

    def __init__(
        self, make_server: Callable[[], HardwareServer], *, parameters: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__("simulator", parameters=parameters)
        self._settings = self.read_parameters(SimulatorParameters)
        self._make_server = make_server
        self._clock_topic = (
            None if self._settings.catch_up else self.create_publisher(ClockMessage, CLOCK, RELIABLE)
        )
        self._truth_topic = self.create_publisher(String, SIMULATOR_TRUTH, LATCHED)
        # This node makes the time that the others have; its own is the wall clock.
        self._drivers = SlowestReader(MOST_LAG_S, READER_TIMEOUT_S)
        self.create_subscription(LaserScan, SCAN, self._on_scan, SENSOR, judge_stamps=False)
        self._filters = SlowestReader(MOST_FILTERED_LAG_S, READER_TIMEOUT_S)
        self.create_subscription(LaserScan, FILTERED_SCAN, self._on_filtered_scan, SENSOR, judge_stamps=False)
        self._placed = {
            ODOM_FRAME: SlowestReader(MOST_NAVIGATION_LAG_S, TRANSFORM_TIMEOUT_S),
            BASE_FRAME: SlowestReader(MOST_BASE_LAG_S, TRANSFORM_TIMEOUT_S),
        }
        self.create_subscription(TFMessage, TF_TOPIC, self._on_transforms, TF_LISTENER, judge_stamps=False)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulated hardware")
        self._thread.start()

    def close(self) -> None:
        """Stop the world and unplug the ports."""
        self._stop.set()
        self._thread.join()

    def _on_scan(self, message: LaserScan) -> None:
        self._drivers.received(stamp_from_ros(message.header.stamp), time.monotonic())

    def _on_filtered_scan(self, message: LaserScan) -> None:
        self._filters.received(stamp_from_ros(message.header.stamp), time.monotonic())

    def _on_transforms(self, message: TFMessage) -> None:
        for transform in message.transforms:
            reader = self._placed.get(transform.child_frame_id)
            if reader is not None:
                reader.received(stamp_from_ros(transform.header.stamp), time.monotonic())

    def _run(self) -> None:
        try:
            self._simulate()
        except Exception as error:
            # Raised on the executor's thread: a world that stops without a message could not be explained.
            self.fatal = error
            self.call_soon(lambda: None)

    def _simulate(self) -> None:
        server = self._make_server()
        server.open()
        try:
            self._pace(server)
        finally:
            server.close()

    def _pace(self, server: HardwareServer) -> None:
        """Step the world at ``speed`` times the wall clock, or as fast as it and the drivers go."""
        settings = self._settings
        due = time.monotonic()
        next_clock = next_truth = paced = server.time
        motion = server.motion
        while not self._stop.is_set():
            server.step()
            due += STEP_S / settings.speed
            # Half a step of tolerance: these are sums of floating-point numbers.
            now = server.time + STEP_S / 2
            if now < next_clock and now < paced + LONGEST_BURST_S:
                continue
            paced = server.time
            if now >= next_clock:
                next_clock += RESTING_CLOCK_PERIOD_S if server.world.resting else CLOCK_PERIOD_S
                self._publish_clock(server)
            if now >= next_truth or server.motion != motion:
                next_truth = server.time + TRUTH_PERIOD_S
                motion = server.motion
                truth = {**server.truth(), "monotonic": time.monotonic()}
                self._truth_topic.publish(String(data=json.dumps(truth)))
            wait = due - time.monotonic()
            if wait > 0.0:
                select.select([], [], [], wait)
            elif wait < -MAX_BACKLOG_S and not settings.catch_up:
                due = time.monotonic() - MAX_BACKLOG_S
            if self._readers_are_behind(server):
                self._wait_for_readers(server)
                due = time.monotonic()

    def _readers_are_behind(self, server: HardwareServer) -> bool:
        now, sent_at = time.monotonic(), server.laser_sent_at
        return (
            self._drivers.is_behind(sent_at, now)
            or self._filters.is_behind(sent_at, now)
            or any(reader.is_behind(server.time, now) for reader in self._placed.values())
        )

    def _publish_clock(self, server: HardwareServer) -> None:
        if self._clock_topic is not None:
            self._clock_topic.publish(ClockMessage(clock=stamp_to_ros(server.time)))

    def _wait_for_readers(self, server: HardwareServer) -> None:
        # A driver takes no bytes before it knows that it is as late as they are.
        self._publish_clock(server)
        while not self._stop.is_set():
            select.select([], [], [], CATCH_UP_LOOK_S)
            if not self._readers_are_behind(server):
                return
            server.serve()
