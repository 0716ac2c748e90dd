"""The same components, wired by ROS and wired by the rig: what was recorded once gives the same in both."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np
import pytest
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image

from florence_bt.app.bringup.config import load_config
from florence_bt.app.bringup.simulated import robot_frames
from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result
from florence_bt.core.ports import Delivery, Ports, Topic
from florence_bt.core.sensing import LaserScan, PoseEstimate
from florence_bt.core.skill import Skill, SkillRun
from florence_bt.core.topics import COLOUR, DEPTH, FOUND, MAP, ODOMETRY, POSE, SCAN, FoundUser
from florence_bt.ros.conversions import (
    camera_info_to_ros,
    colour_to_ros,
    depth_to_ros,
    grid_to_ros,
    odometry_to_ros,
    stamp_to_ros,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.ros.qos import RELIABLE, SENSOR
from florence_bt.ros.tf import StaticTransformBroadcaster
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.rig.components import connect_localiser, connect_navigation, connect_user_tracking
from florence_bt.simulation.rig.skills import rig_skills
from florence_bt.simulation.rig.wires import Wires
from florence_bt.skills.navigation.localisation.node import LocaliserNode
from florence_bt.skills.navigation.navigate.node import NavigationNode
from florence_bt.skills.people.user_tracker.node import UserTrackerNode
from florence_bt.skills.people.user_tracker.tracking import USERS, UserIds

pytestmark = pytest.mark.ros

SEED = 1
BEGIN_S = 1000.0
"""The time of ROS at which what was recorded begins: zero would be no time."""
FILTERED = Topic("filtered_scan", LaserScan, Delivery.SENSOR)
INPUTS = (ODOMETRY, SCAN, FILTERED, DEPTH, COLOUR)
GOALS = "navigate_to", "look_for_user"
NEAR_M = 0.01
"""Between the two: messages have single precision and whole nanoseconds."""


@dataclass(frozen=True)
class Recording:
    """What the sensors of a drive of the rig have said, and what was asked of it meanwhile.

    Attributes:
        start: Where the robot believed to be at first.
        said: When, on which topic, what; a goal has the name of its skill in place of a topic.
        end: Seconds.
    """

    start: Pose2
    said: list[tuple[float, Any, Any]]
    end: float


@dataclass
class Events:
    """What came of it.

    Attributes:
        poses: Of the robot, by the localiser.
        users: The ids of who is tracked, by each picture.
        found: Whom looks have found.
        results: Of the goals.
    """

    poses: list[PoseEstimate] = field(default_factory=list)
    users: list[list[int]] = field(default_factory=list)
    found: list[FoundUser] = field(default_factory=list)
    results: dict[str, Result] = field(default_factory=dict)

    def listen(self, ports: Ports) -> None:
        """Hear of them."""
        ports.listen(POSE, self.poses.append)
        ports.listen(USERS, self._take_users)
        ports.listen(FOUND, self.found.append)

    def _take_users(self, users: UserIds) -> None:
        self.users.append(list(users.user_ids))


def moment(when: float) -> float:
    """Return a moment of the rig as one of ROS, in whole nanoseconds, as messages have it."""
    return round(BEGIN_S + when, 9)


class Copy:
    """A picture that was read when it was taken."""

    def __init__(self, image: Any) -> None:
        self.stamp, self._image = image.stamp, image

    def read(self) -> Any:
        return self._image


def record() -> Recording:
    """Drive up to somebody and look at them."""
    start = load_flat().start
    goal = start @ Pose2(0.6, 0.0)
    rig = make_rig(seed=SEED, person=PersonSpec("user", goal @ Pose2(2.0, 0.2, np.pi)))
    skills, said = rig_skills(rig.wires, SEED), []
    looks = False

    def note(topic: Topic[Any], value: Any) -> None:
        if topic in (DEPTH, COLOUR):
            if not looks:
                return
            value = value.read()
        value = replace(value, stamp=moment(value.stamp))
        said.append((moment(rig.clock.now()), topic, Copy(value) if topic in (DEPTH, COLOUR) else value))

    rig.clock.advance(0.03)  # odometry is the first that is recorded: no scan lies before all of it
    for topic in INPUTS:
        rig.topics[topic.name].subscribe(partial(note, topic))
    rig.clock.advance(1.0)
    for name, inputs in (
        ("navigate_to", {"goal": goal}),
        ("look_for_user", {"window": 5.0, "user_id": 0, "x": 0.0, "y": 0.0}),
    ):
        looks = name == "look_for_user"
        said.append((moment(rig.clock.now()), name, inputs))
        run = skills[name].start(inputs)
        while run.poll() is None:
            rig.clock.run_next()
        rig.clock.advance(0.5)
    return Recording(start, said, moment(rig.clock.now()))


def over_wires(recording: Recording) -> Events:
    """Give the recording to the components in the rig."""
    clock, config, events = ManualClock(recording.said[0][0] - 0.1), load_config(), Events()
    wires = Wires(clock, robot_frames().mounts())
    connect_localiser(wires, config, recording.start, SEED)
    connect_navigation(wires, config)
    connect_user_tracking(wires, config)
    hardware = wires.ports("hardware")
    events.listen(wires.ports("listener"))
    outputs = {topic: hardware.output(topic) for topic in INPUTS}
    hardware.output(MAP).send(laser_map(load_flat()))
    skills, runs = rig_skills(wires), {}
    for when, topic, value in recording.said:
        clock.advance_to(when)
        if topic in GOALS:
            runs[topic] = skills[topic].start(value)
        else:
            outputs[topic].send(value)
            if topic == ODOMETRY:
                hardware.send_frame("odom", "base_footprint", value.stamp, value.pose)
        clock.advance(0.0)
    clock.advance_to(recording.end)
    events.results = {name: _result(run) for name, run in runs.items()}
    return events


def _result(run: SkillRun) -> Result:
    result = run.poll()
    assert result is not None, "it has ended while it was recorded, too"
    return result


class OverRos:
    """Gives a recording to the nodes of the same components.

    Simulated time goes on when everybody has what was said and has done its work.
    """

    def __init__(self, ros: Any, recording: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
        self.ros, self.recording, self.events = ros, recording, Events()
        self.sent: Counter[str] = Counter()
        self.taken: dict[Any, int] = {}
        publish = Publisher.publish

        def count_and_publish(publisher: Publisher, message: Any) -> None:
            self.sent[publisher.topic_name] += 1
            publish(publisher, message)

        monkeypatch.setattr(Publisher, "publish", count_and_publish)
        self.player = ros.add(FlorenceNode("player", parameters={"use_sim_time": True}))
        self.clock = self.player.create_publisher(Clock, "/clock", RELIABLE)
        ports = RosPorts(
            self.player,
            {
                ODOMETRY: lambda odometry: odometry_to_ros(
                    self.player.stamped(odometry), "odom", "base_footprint"
                ),
                MAP: lambda grid: grid_to_ros(grid, "map", self.player.stamp()),
            },
        )
        self.ports = ports
        self.outputs = {topic: ports.output(topic) for topic in (ODOMETRY, SCAN, FILTERED)}
        create = partial(self.player.create_publisher, qos_profile=SENSOR)
        self.info = create(CameraInfo, "camera/depth/camera_info")
        self.depth, self.colour = create(Image, DEPTH.name), create(Image, COLOUR.name)
        StaticTransformBroadcaster(self.player).send(robot_frames().mounts())
        ports.output(MAP).send(laser_map(load_flat()))
        self.events.listen(ports)
        self.skills: dict[str, Skill] = make_skills(self.player)
        self.nodes = [self.player, *self._system()]

    def _system(self) -> list[FlorenceNode]:
        start, config = self.recording.start, load_config()
        initial = {"initial_x": start.x, "initial_y": start.y, "initial_yaw": start.yaw, "seed": SEED}

        def parameters(node: str) -> dict[str, Any]:
            return {**config.get(node, {}), "use_sim_time": True}

        self.localiser = self.ros.add(LocaliserNode(parameters=parameters("localiser") | initial))
        self.navigation = self.ros.add(NavigationNode(parameters=parameters("navigate")))
        self.tracker = self.ros.add(UserTrackerNode(parameters=parameters("user_tracker_ni_node")))
        return [self.localiser, self.navigation, self.tracker]

    def play(self) -> Events:
        """Give it all."""
        spin = self.ros.spin_until
        spin(partial(self._time_is_known, self.recording.said[0][0] - 0.1), what="the time")
        spin(
            lambda: self.localiser.localising.localiser and self.navigation.navigation.navigator, what="maps"
        )
        spin(lambda: all(self.skills[name].server_is_there() for name in GOALS), what="servers")  # type: ignore[attr-defined]
        spin(self._are_met, what="discovery")
        runs: dict[str, SkillRun] = {}
        for when, said in groupby(self.recording.said, lambda each: each[0]):
            self._tell_time(when)
            for _, topic, value in said:
                if topic in GOALS:
                    runs[topic] = self._begin(topic, value)
                else:
                    self._say(topic, value)
                    self._settle()
        self._tell_time(self.recording.end)
        spin(lambda: all(run.poll() for run in runs.values()), what="the results")
        self.events.results = {name: _result(run) for name, run in runs.items()}
        self.events.poses = [self.player.stamped(estimate) for estimate in self.events.poses]
        return self.events

    def _time_is_known(self, when: float) -> bool:
        self.clock.publish(Clock(clock=stamp_to_ros(when)))
        return all(node.stamp() == pytest.approx(when) for node in self.nodes)

    def _are_met(self) -> bool:
        """Whether who publishes knows who listens: odometry, scans and frames reach their nodes."""
        self.ports.send_frame("odom", "base_footprint", self.player.timebase.now(), Pose2())
        listeners = {topic: output.listeners for topic, output in self.outputs.items()}
        frames = self.navigation.navigation._frames.buffer.frames()
        return listeners == {ODOMETRY: 2, SCAN: 1, FILTERED: 1} and "base_footprint" in frames

    def _begin(self, name: str, inputs: Any) -> SkillRun:
        run = self.skills[name].start(inputs)
        if name == "navigate_to":
            self.ros.spin_until(lambda: self.navigation.navigation.active, what="the drive")
            return run
        self.ros.spin_until(
            lambda: (
                self.depth.get_subscription_count()
                and self.colour.get_subscription_count()
                and self.info.get_subscription_count()
                and self.outputs[FILTERED].listeners == 2
            ),
            what="the tracker",
        )
        return run

    def _say(self, topic: Topic[Any], value: Any) -> None:
        if topic in (DEPTH, COLOUR):
            image = value.read()
            if topic is COLOUR:
                self.colour.publish(colour_to_ros(image))
            else:
                self.info.publish(camera_info_to_ros(image.camera, image.frame_id, image.stamp))
                self._settle()
                self.depth.publish(depth_to_ros(image))
            return
        timed = self.player.timed(value)
        self.outputs[topic].send(timed)
        if topic == ODOMETRY:
            self.ports.send_frame("odom", "base_footprint", timed.stamp, timed.pose)

    def _tell_time(self, when: float) -> None:
        """Set the clock and wait until everybody has done all that was to be done until then."""
        due: list[FlorenceNode] = []
        for node in self.nodes:
            # A hair earlier: the message has whole nanoseconds.
            node.timebase.call_at(node.time_of(when) - 1e-6, partial(due.append, node))
        self.clock.publish(Clock(clock=stamp_to_ros(when)))
        self.ros.spin_until(lambda: len(due) == len(self.nodes), what="the time")
        self._settle()

    def _settle(self) -> None:
        """Wait until each message has reached who listens to it, and what it has caused has, too."""
        for node in self.nodes:
            for subscription in node.subscriptions:
                if subscription not in self.taken:
                    self._count(subscription)
        self.ros.spin_until(
            lambda: all(count >= self.sent[each.topic_name] for each, count in self.taken.items()),
            what="what was published",
        )
        self.ros.loop.drain()  # of readings that came together, the newest is served when the round ends

    def _count(self, subscription: Any) -> None:
        """Count what a subscription is given from now on: all that is sent from now on."""
        self.taken[subscription] = self.sent[subscription.topic_name]
        callback: Callable[..., None] = subscription.callback

        def count_and_take(message: Any) -> None:
            self.taken[subscription] += 1
            callback(message)

        subscription.callback = count_and_take


def test_what_was_recorded_gives_the_same_over_ros_and_in_the_rig(
    ros: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = record()
    rig = over_wires(recording)
    over_ros = OverRos(ros, recording, monkeypatch).play()
    assert [round(each.stamp, 6) for each in over_ros.poses] == [round(each.stamp, 6) for each in rig.poses]
    for here, there in zip(over_ros.poses, rig.poses, strict=True):
        assert here.pose.distance_to(there.pose) < NEAR_M
        assert here.pose.yaw == pytest.approx(there.pose.yaw, abs=NEAR_M)
    assert over_ros.users == rig.users and rig.users[-1] == [1]
    (here_found,), (there_found,) = over_ros.found, rig.found
    assert here_found.user_position_x == pytest.approx(there_found.user_position_x, abs=NEAR_M)
    assert here_found.user_position_y == pytest.approx(there_found.user_position_y, abs=NEAR_M)
    for name in GOALS:
        here_result, there_result = over_ros.results[name], rig.results[name]
        assert (here_result.code, here_result.succeeded) == (there_result.code, True)
    look, other = over_ros.results["look_for_user"].outputs, rig.results["look_for_user"].outputs
    assert look["distance"] == pytest.approx(other["distance"], abs=NEAR_M)
    assert {**look, "user": 0, "distance": 0, "height": 0} == {**other, "user": 0, "distance": 0, "height": 0}
