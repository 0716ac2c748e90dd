"""Two robots in one ROS domain on one machine, each below its namespace."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
import rclpy
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionServer

from florence_bt.app.bringup.locks import bring_up_here, lock_domain
from florence_bt.core.errors import ConfigError
from florence_bt.ros import arguments
from florence_bt.ros.action_client import ActionClient
from florence_bt.ros.arguments import start_ros, use_arguments
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.tf import TF_TOPIC
from tests.ros.conftest import GENEROUS_S, Child

pytestmark = pytest.mark.ros

EXAMPLE = Path(__file__).parents[2] / "examples" / "foreign_robot"
GO_FAR = """\
mission: go_far
description: Drives until somebody ends it.
tree:
  repeat: 1000
  do:
    drive_robot: {place: {x: 90 m, y: 0 m, yaw: 0 deg}}
"""


@pytest.fixture
def node_of(monkeypatch: pytest.MonkeyPatch, ros_domain: int) -> Iterator[Callable[[str], FlorenceNode]]:
    """Make a node in a process with these ROS arguments."""
    monkeypatch.setattr(arguments, "_arguments", ())
    made: list[tuple[FlorenceNode, SpinLoop, rclpy.Context]] = []

    def make(words: str, *first: str) -> FlorenceNode:
        use_arguments(words.split())
        context = rclpy.Context()
        start_ros(context, first=first)
        node, loop = FlorenceNode("probe", context=context), SpinLoop(context)
        loop.add(node)
        made.append((node, loop, context))
        return node

    yield make
    for node, loop, context in made:
        node.shut_down()
        loop.close()
        node.destroy_node()
        rclpy.shutdown(context=context)


@pytest.mark.parametrize(
    ("words", "tf", "topic"),
    [
        ("", "/tf", "/goal_pose"),
        ("-r __ns:=/robot1", "/robot1/tf", "/robot1/goal_pose"),
        ("-r __ns:=/robot1 -r /tf:=/tf", "/tf", "/robot1/goal_pose"),
        ("-r goal_pose:=goal", "/tf", "/goal"),
    ],
)
def test_the_transforms_are_below_the_namespace_as_with_nav2(node_of, words, tf, topic):
    node = node_of(words)
    assert node.resolve_topic_name(TF_TOPIC) == tf
    assert node.resolve_topic_name("goal_pose") == topic


def test_rules_of_the_bring_up_go_before_those_of_the_user(node_of):
    node = node_of("-r cmd_vel:=/mine -r __ns:=/robot1", "probe:cmd_vel:=filtered_cmd_vel")
    assert node.resolve_topic_name("cmd_vel") == "/robot1/filtered_cmd_vel"


def test_a_rule_for_an_action_holds_for_all_that_it_consists_of(node_of):
    node = node_of("-r navigate_to_pose:=nav2/navigate_to_pose -r __ns:=/robot1")
    assert node.resolve_action_name("navigate_to_pose") == "/robot1/nav2/navigate_to_pose"
    client = ActionClient(node, NavigateToPose, "navigate_to_pose")
    assert client.name == "/robot1/nav2/navigate_to_pose"
    names = {each.srv_name for each in node.clients}
    assert f"{client.name}/_action/send_goal" in names


def test_an_action_is_found_below_the_namespace_and_not_beside_it(node_of):
    server_node, client_node, other = (node_of(f"-r __ns:=/robot{n}") for n in (1, 1, 2))
    server = ActionServer(
        server_node, NavigateToPose, "navigate_to_pose", lambda goal: NavigateToPose.Result()
    )
    here = ActionClient(client_node, NavigateToPose, "navigate_to_pose")
    there = ActionClient(other, NavigateToPose, "navigate_to_pose")
    loop = SpinLoop(client_node.context)
    loop.add(client_node)
    for _ in range(500):
        loop.spin_once(0.02)
        if here.server_is_ready():
            break
    assert here.server_is_ready() and here.name == "/robot1/navigate_to_pose"
    assert there.servers() == 0 and not there.server_is_ready()
    server.destroy()
    loop.close()


def test_arguments_that_ros_does_not_take_are_told(node_of):
    with pytest.raises(ConfigError, match=r"--no-such.*would have worked: -r from:=to"):
        node_of("--no-such")


def test_each_namespace_has_its_lock(monkeypatch, ros_domain, tmp_path):
    monkeypatch.setattr(arguments, "_arguments", ("-r", "__ns:=/robot1"))
    assert not bring_up_here()
    locks = [lock_domain(tmp_path, robot) for robot in ("", "/robot2", "/robot2/arm")]
    assert not bring_up_here()
    locks.append(lock_domain(tmp_path, "/robot1"))
    assert bring_up_here()
    with pytest.raises(ConfigError, match=r"namespace /robot1.*--namespace /robot2"):
        lock_domain(tmp_path, "/robot1")
    for lock in locks:
        lock.close()


@pytest.mark.slow
def test_two_systems_side_by_side(
    ros_domain: int, start_process: Callable[..., Child], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far").mkdir()
    (tmp_path / "far" / "go_far.yaml").write_text(GO_FAR)
    (tmp_path / "params.yaml").write_text("/robot1/florence_bt:\n  ros__parameters: {keep_runs: 7}\n")

    def florence(*words: str | Path) -> Child:
        return start_process(sys.executable, "-m", "florence_bt.cli", *words)

    def done(*commands: str) -> list[tuple[int, str]]:
        """Run commands at the same time; gives the exit code and the output of each."""
        children = [florence(*command.split()) for command in commands]
        return [(child.process.wait(GENEROUS_S), child.output) for child in children]

    def status_of(*robots: str) -> list[str]:
        return [said.split()[1] for _, said in done(*(f"status --namespace {robot}" for robot in robots))]

    folders = ("--missions", EXAMPLE / "missions", "--missions", "far", "--params-file", "params.yaml")
    systems = [florence("up", "--missions-only", "--namespace", f"robot{n}", *folders) for n in (1, 2)]
    for number in (1, 2):
        start_process(sys.executable, EXAMPLE / "robot.py", "--ros-args", "-r", f"__ns:=/robot{number}/tb4")
    for number, system in enumerate(systems, 1):
        assert f"runs/up_robot{number}" in system.wait_for("ready after")
        if "nobody serves" in system.output:
            system.wait_for("every server that missions need is there")

    started = done(*(f"run go_far --detach --namespace {robot}" for robot in ("/robot1", "/robot2")))
    assert [code for code, _ in started] == [0, 0], started
    (stopped, elsewhere) = done("stop --ros-args -r __ns:=/robot1", "status")
    assert stopped[0] == 0, stopped
    assert elsewhere[0] == 3 and "--namespace /robot1 or /robot2" in elsewhere[1]
    assert status_of("/robot1", "/robot2") == ["STOPPED", "RUNNING"]
    assert systems[0].end() == 130
    assert status_of("/robot2") == ["RUNNING"]
    assert systems[1].end() == 130
