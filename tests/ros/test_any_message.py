"""No message, request or goal ends or poisons a node, whatever is in it.

What a node subscribes to and serves is read from the node itself, and the messages are generated from the
definitions of their types, so that a new topic, service or action is covered without a word here.
"""

from __future__ import annotations

import inspect
import random
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

pytest.importorskip("rclpy")
from rclpy.action import ActionClient, get_action_server_names_and_types_by_node
from rclpy.action.server import ActionServer
from rclpy.serialization import serialize_message

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.core.errors import DeviceLost
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.drivers.hokuyo.node import HokuyoNode
from florence_bt.drivers.kinect.motor.node import KinectMotorNode
from florence_bt.drivers.kinect.node import KinectNode
from florence_bt.drivers.turtlebot.node import TurtlebotNode
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.tf import TF_STATIC_TOPIC
from florence_bt.ros.validation import CHECKS, problem_with, type_name
from florence_bt.runtime.node import MissionNode
from florence_bt.skills.calibration.node import CalibrationNode
from florence_bt.skills.filters.depth_to_laser.node import FakeLaserNode
from florence_bt.skills.filters.laser_combinator.node import LaserCombinatorNode
from florence_bt.skills.filters.laser_filter.node import LaserFilterNode
from florence_bt.skills.filters.velocity_filter.node import VelocityFilterNode
from florence_bt.skills.home_sensors.node import HomeSensorsNode
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.skills.locator.node import LocatorNode
from florence_bt.skills.navigation.localisation.node import LocaliserNode
from florence_bt.skills.navigation.map_server.map_writer import save_map
from florence_bt.skills.navigation.map_server.node import MapServerNode
from florence_bt.skills.navigation.mapping.node import MappingNode
from florence_bt.skills.navigation.navigate.node import NavigationNode
from florence_bt.skills.people.approach_user.node import ApproachNode
from florence_bt.skills.people.user_tracker.node import UserTrackerNode
from florence_bt.skills.robot_description.node import RobotDescriptionNode
from florence_bt.skills.speech.node import SpeechNode
from florence_bt.trees.language.declarations import collect_declarations
from tools.safety_campaign.messages import arbitrary, load_type, ordinary, spoilt

pytestmark = pytest.mark.ros

ROUNDS = 25
"""Messages for each topic and service of a node."""
GOALS = 6
"""Goals for each action, over ROS."""
NOT_USED = {
    "florence_interfaces/ApproachMe_FeedbackMessage": "handed to the client of approach_me as it comes",
    "florence_interfaces/FollowUser_FeedbackMessage": "handed to the client of follow_me as it comes",
    "florence_interfaces/ManualOverride": "its sent_at is not read by the mission server",
    "florence_interfaces/ReleaseOverride_Request": "whatever is no time within the last second is refused",
    "py_trees_ros_interfaces/OpenSnapshotStream_Request": "its parameters are not read",
    "py_trees_ros_interfaces/ReconfigureSnapshotStream_Request": "its parameters are not read",
}
"""Types with numbers that need no check, and why."""


def absent(*_: Any) -> Any:
    raise DeviceLost("there is no device in this test")


def tracker(folder: Path) -> UserTrackerNode:
    node = UserTrackerNode()
    node._tracking._start()  # it takes pictures only then
    return node


def locator(folder: Path) -> LocatorNode:
    (folder / "hotspots.yaml").write_text("hotspots: []")
    return LocatorNode(parameters={"hotspots_file": str(folder / "hotspots.yaml")})


def home_sensors(folder: Path) -> HomeSensorsNode:
    (folder / "hotspots.yaml").write_text("hotspots: [{label: hall, x: 0, y: 0}]")
    (folder / "home.yaml").write_text("sensors: {pir: {room: hall}}")
    files = {"home_file": folder / "home.yaml", "hotspots_file": folder / "hotspots.yaml"}
    return HomeSensorsNode(parameters={name: str(file) for name, file in files.items()})


def map_server(folder: Path) -> MapServerNode:
    file = save_map(OccupancyGrid(0.1, Pose2(), np.zeros((5, 5), np.int8)), folder / "map.yaml")
    return MapServerNode(parameters={"map_file": str(file)})


def missions(folder: Path) -> MissionNode:
    return MissionNode(make_skills, collect_declarations(), parameters={"runs_folder": str(folder)})


NODES: dict[str, Callable[[Path], FlorenceNode]] = {
    "map_server": map_server,
    "navigate": lambda _: NavigationNode(),
    "localiser": lambda _: LocaliserNode(),
    "mapping": lambda _: MappingNode(),
    "velocity_filter": lambda _: VelocityFilterNode(),
    "turtlebot": lambda _: TurtlebotNode(open_port=absent),
    "hokuyo": lambda _: HokuyoNode(open_port=absent),
    "kinect": lambda _: KinectNode(open_source=absent),
    "kinect_motor": lambda _: KinectMotorNode(open_motor=absent),
    "kinect_laser": lambda _: FakeLaserNode(),
    "laser_combinator": lambda _: LaserCombinatorNode(parameters={"project_origin": True}),
    "laser_filter": lambda _: LaserFilterNode(parameters={"filter_kinect": True}),
    "robot_description": lambda _: RobotDescriptionNode(),
    "approach_user": lambda _: ApproachNode(),
    "calibration": lambda _: CalibrationNode(lambda _: None, lambda: None),
    "tracker": tracker,
    "home_sensors": home_sensors,
    "locator": locator,
    "speech": lambda _: SpeechNode(),
    "missions": missions,
}


@pytest.fixture(params=NODES)
def node(request: pytest.FixtureRequest, ros: Any, tmp_path: Path) -> FlorenceNode:
    return ros.add(NODES[request.param](tmp_path))


def generated(message_type: Any, node: FlorenceNode, rng: random.Random) -> Any:
    if rng.random() < 0.3:
        return arbitrary(message_type, rng)
    return spoilt(ordinary(message_type, node.timebase.now()), rng)


def deliver(subscription: Any, message: Any) -> None:
    """Hand a message over as rclpy does: as bytes, and with when it was sent, where that was asked for."""
    given = serialize_message(message) if subscription.raw else message
    told = len(inspect.signature(subscription.callback).parameters) == 2
    subscription.callback((given, {"source_timestamp": time.time_ns()}) if told else given)


def attack(
    ros: Any, node: FlorenceNode, rng: random.Random, subscriptions: Sequence[Any], services: Sequence[Any]
) -> None:
    """One generated message for every topic and service; an exception of a callback is raised by the loop."""
    for subscription in subscriptions:
        message = generated(subscription.msg_type, node, rng)
        refused = sum(node.health.refused.values())
        deliver(subscription, message)
        counted = sum(node.health.refused.values()) - refused
        # What is sifted out is not looked at.
        assert subscription.raw or counted >= (problem_with(message) is not None)
        ros.loop.drain(3)
    for service in services:
        request = generated(service.srv_type.Request, node, rng)
        answer = service.callback(request, service.srv_type.Response())
        if problem_with(request) is not None:
            assert not any(getattr(answer, name, False) for name in ("success", "valid", "accepted"))
            assert "would have worked" in getattr(answer, "message", "would have worked")
        ros.loop.drain(3)


def test_no_message_or_request_raises(ros: Any, node: FlorenceNode) -> None:
    for subscription in list(node.subscriptions):
        deliver(subscription, ordinary(subscription.msg_type, node.timebase.now()))
    ros.loop.drain()

    # Those of now: the mission server has others in a mission, and Hypothesis wants the same draws each time.
    attacked_now = list(node.subscriptions), list(node.services)

    @settings(
        max_examples=ROUNDS,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.randoms(use_true_random=False))
    def attacked(rng: random.Random) -> None:
        attack(ros, node, rng, *attacked_now)

    attacked()
    # It still does its work: what is good is taken. All messages name one frame, which cannot be both static
    # and moving; a transform that contradicted before is judged with the next one.
    subscriptions = [each for each in node.subscriptions if each.topic_name != TF_STATIC_TOPIC]
    refused: list[dict[str, int]] = []
    for _ in range(10):  # what contradicted is judged a moment later, which may fall into any round
        for subscription in subscriptions:
            deliver(subscription, ordinary(subscription.msg_type, node.timebase.now()))
        ros.loop.drain()
        refused.append(dict(node.health.refused))
        if refused[-2:-1] == refused[-1:]:
            break
    assert refused[-2] == refused[-1]


def test_no_goal_raises_and_each_ends(ros: Any, node: FlorenceNode) -> None:
    actions = get_action_server_names_and_types_by_node(node, node.get_name(), node.get_namespace())
    if not actions:
        pytest.skip("this node serves no action")
    for subscription in list(node.subscriptions):
        deliver(subscription, ordinary(subscription.msg_type, node.timebase.now()))
    client_node = ros.add(FlorenceNode("client"))
    rng = random.Random(8)
    for name, (type_of_action,) in actions:
        action_type = load_type(type_of_action)
        client = ActionClient(client_node, action_type, name)
        client_node.on_destroy(client.destroy)
        ros.spin_until(client.server_is_ready, what="the server")
        for _ in range(GOALS):
            goal = generated(action_type.Goal, node, rng)
            sent = client.send_goal_async(goal)
            ros.spin_until(sent.done, what=f"the answer to {goal}")
            if not sent.result().accepted:
                continue
            end = sent.result().get_result_async()
            sent.result().cancel_goal_async()
            ros.spin_until(end.done, what=f"the end of {goal}")
            if problem_with(goal) is not None:
                assert end.result().status == 6  # ABORTED
                # The actions of the document have no field for it; test_navigation_node reads it elsewhere.
                reason = getattr(end.result().result, "error_msg", "would have worked")
                assert "would have worked" in reason


def test_the_hotspots_that_were_set_are_read_at_the_next_start(ros: Any, tmp_path: Path) -> None:
    node = ros.add(locator(tmp_path))
    (service,) = [one for one in node.services if one.srv_name.endswith("setHotspot")]
    kept = []
    for label in (
        "kitchen",
        "a\x85b",
        "a\u2028b",
        "x" * 10_001,
        " ",
        "\U0001f916",
        "true",
        "1.5",
        "# no",
        "study",
    ):
        answer = service.callback(service.srv_type.Request(label=label, x=1.0), service.srv_type.Response())
        kept += [label] if answer.success else []
        assert answer.message
    assert load_hotspots(tmp_path / "hotspots.yaml").labels() == tuple(kept)
    assert kept == ["kitchen", "\U0001f916", "true", "1.5", "# no", "study"]


def test_every_type_with_numbers_that_a_node_takes_has_a_check(node: FlorenceNode) -> None:
    """A new type: give it a check in florence_bt/ros/validation.py, or put it into NOT_USED with a reason."""
    taken = [subscription.msg_type for subscription in node.subscriptions]
    taken += [service.srv_type.Request for service in node.services]
    taken += [part.action_type.Goal for part in node.waitables if isinstance(part, ActionServer)]
    unchecked = {type_name(one) for one in taken if has_floats(one)} - CHECKS.keys() - NOT_USED.keys()
    assert not unchecked


def has_floats(message_type: Any) -> bool:
    kinds = message_type.get_fields_and_field_types().values()
    return any(
        has_floats(load_type(name))
        if "/" in (name := kind.replace("sequence<", "").split(">")[0].split("[")[0])
        else name in ("float", "double")
        for kind in kinds
    )
