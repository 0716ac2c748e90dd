"""The other process of ``test_bench_ros``: missions of hops over ROS, and plain rclpy doing the same by hand.

``python benchmarks/ros_hops.py FOLDER``: ``hops`` sends and waits for an answer on topics, ``action_hops``
runs one action after the other. Beside them, with the same executor and QoS, an echo answers each message,
and a plain action client sends a goal as soon as it has the result of the one before.
``python benchmarks/ros_hops.py stock`` is an echo as everybody writes it, with ``rclpy.spin``. With ``sim``
behind it, either follows ``/clock``.
"""

from __future__ import annotations

import gc
import sys
from pathlib import Path
from typing import Any

import rclpy
from nav2_msgs.action import Spin
from rclpy.action import ActionClient
from rclpy.executors import ExternalShutdownException
from rclpy.parameter import Parameter
from std_msgs.msg import String

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.core.serving import WaitBinding
from florence_bt.ros.action_skill import ActionSkill, Deadlines
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.process import run_nodes
from florence_bt.ros.qos import RELIABLE
from florence_bt.ros.topic_skill import TopicPublication, TopicWait
from florence_bt.runtime.node import MissionNode

HOP = SkillDeclaration("hop", "Publishes the start of a hop", deadline_s=3600.0)
HOPPED = SkillDeclaration("hopped", "Waits for the end of a hop", deadline_s=3600.0)
ACTION_HOP = SkillDeclaration("action_hop", "Commanded by an action", deadline_s=3600.0)
LONG = Deadlines(result_s=3600.0)
WAIT = WaitBinding(
    skill=HOPPED.name,
    interface="std_msgs/msg/String",
    name="hop/done",
    result=lambda message: success(),
    time_limit=lambda inputs: 3600.0,
    nothing=lambda inputs: failure("timed_out", "no end of a hop within an hour"),
)
MISSION = """mission: {name}
tree:
  repeat: 1000000
  do:
    sequence:
{steps}
"""
STEPS = 20
"""Hops in a row, before the ``repeat`` begins its next round (which is a tick of its own)."""


def make_skills(node: FlorenceNode) -> dict[str, Any]:
    """Make skills that do nothing but send to the other process and wait for it."""
    return {
        "hop": TopicPublication(node, (String, "hop/start"), lambda inputs: String(data="go")),
        "hopped": TopicWait(node, String, WAIT, deadline_s=HOPPED.deadline_s),
        "action_hop": ActionSkill(
            node,
            Spin,
            "hop_action",
            to_goal=lambda inputs: Spin.Goal(),
            to_result=lambda message, outcome: success(),
            deadlines=LONG,
        ),
    }


class Plain(FlorenceNode):
    """Topic in, topic out; result in, goal out."""

    def __init__(self) -> None:
        super().__init__("plain")
        self._echo = self.create_publisher(String, "plain/start", RELIABLE)
        self.create_subscription(String, "plain/done", self._on_message, RELIABLE)
        self._client = ActionClient(self, Spin, "plain_action")
        self.create_subscription(String, "plain/begin", lambda message: self._send(), RELIABLE)

    def _on_message(self, message: String) -> None:
        self._echo.publish(String(data="go"))

    def _send(self) -> None:
        self._client.send_goal_async(Spin.Goal()).add_done_callback(self._on_answer)

    def _on_answer(self, future: Any) -> None:
        future.result().get_result_async().add_done_callback(lambda result: self._send())


def stock(*, use_sim_time: bool) -> int:
    """Echo until SIGTERM, with nothing of Florence."""
    rclpy.init()
    node = rclpy.create_node("stock", parameter_overrides=[Parameter("use_sim_time", value=use_sim_time)])
    echo = node.create_publisher(String, "stock/start", RELIABLE)
    node.create_subscription(String, "stock/done", lambda message: echo.publish(String(data="go")), RELIABLE)
    gc.collect()
    gc.freeze()
    try:
        rclpy.spin(node)
    except ExternalShutdownException:
        node.destroy_node()
    return 0


def main(folder: Path, *, use_sim_time: bool) -> int:
    """Serve until SIGTERM."""
    missions = folder / "missions"
    missions.mkdir(parents=True)
    for name, skills in (("hops", ("hop", "hopped")), ("action_hops", ("action_hop",))):
        hop = "".join(f"      - {skill}: {{}}\n" for skill in skills)
        (missions / f"{name}.yaml").write_text(MISSION.format(name=name, steps=STEPS * hop))
    parameters: dict[str, Any] = {"runs_folder": str(folder / "runs"), "mission_folders": (str(missions),)}
    parameters["use_sim_time"] = use_sim_time
    declarations = {each.name: each for each in (HOP, HOPPED, ACTION_HOP)}
    return run_nodes([lambda: MissionNode(make_skills, declarations, parameters=parameters), Plain])


if __name__ == "__main__":
    simulated = sys.argv[2:] == ["sim"]
    if sys.argv[1] == "stock":
        sys.exit(stock(use_sim_time=simulated))
    sys.exit(main(Path(sys.argv[1]), use_sim_time=simulated))
