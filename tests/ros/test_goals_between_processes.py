"""No orphan goals, with real servers in processes of their own: slow answers, killed sides, nodes that leave.

Every order of events is shown on a model in ``tests/unit/ros/test_goal_orders.py``.
"""

from __future__ import annotations

import signal
import time
from typing import Any

import pytest

from florence_bt.core.outcome import Outcome, success

pytestmark = pytest.mark.ros

SERVER = """
import sys, time
from pathlib import Path
from nav2_msgs.action import Spin
from florence_bt.core.outcome import Outcome
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.process import run_nodes

# This many seconds, or until there is a file of this name.
thinks = sys.argv[1]

def make():
    node = FlorenceNode("spinner")
    def on_goal(goal):
        print("asked", flush=True)
        if thinks[0] == "/":
            while not Path(thinks).exists():
                time.sleep(0.01)
        else:
            time.sleep(float(thinks))
        print("goal", flush=True)
    def on_cancel():
        print("cancelled", flush=True)
        server.finish(Spin.Result(), Outcome.CANCELLED)
    server = SingleGoalServer(node, Spin, "spin", on_goal=on_goal, on_cancel=on_cancel)
    print("up", flush=True)
    return node

sys.exit(run_nodes([make]))
"""

CLIENT = """
import sys
from nav2_msgs.action import Spin
from florence_bt.core.outcome import success
from florence_bt.ros.action_skill import ActionSkill
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.process import run_nodes

def make():
    node = FlorenceNode("turner")
    skill = ActionSkill(node, Spin, "spin", to_goal=lambda i: Spin.Goal(), to_result=lambda m, o: success())
    run = skill.start({})
    run.on_change(lambda: print(run.phase.value, flush=True))
    node.on_close(run.cancel)
    return node

sys.exit(run_nodes([make]))
"""


LONG = {"accept_s": 300.0, "result_s": 600.0, "cancel_s": 300.0}
"""Deadlines that pass in no test that does not want it, however busy the machine is."""


@pytest.fixture
def client(ros: Any) -> Any:
    from florence_bt.ros.node import FlorenceNode

    return ros.add(FlorenceNode("client"))


def skill_of(client: Any, **deadlines: float) -> Any:
    from nav2_msgs.action import Spin

    from florence_bt.ros.action_skill import ActionSkill, Deadlines

    return ActionSkill(
        client,
        Spin,
        "spin",
        to_goal=lambda inputs: Spin.Goal(),
        to_result=lambda message, outcome: success(outcome=outcome.value),
        deadlines=Deadlines(**{**LONG, **deadlines}),
    )


def told(ros: Any, child: Any, text: str) -> None:
    ros.spin_until(lambda: text in child.output or child.process.poll() is not None, what=text)
    assert text in child.output, child.output


def test_a_cancel_while_the_server_still_thinks(ros, client, start_process, tmp_path):
    server = start_process("-c", SERVER, tmp_path / "enough")
    run = skill_of(client).start({})
    told(ros, server, "asked")
    run.cancel()
    assert run.poll() is None
    (tmp_path / "enough").touch()
    told(ros, server, "cancelled")
    assert ros.spin_until(run.poll).outputs == {"outcome": Outcome.CANCELLED.value}


def test_a_server_that_says_yes_too_late(ros, client, start_process, tmp_path):
    server = start_process("-c", SERVER, tmp_path / "enough")
    told(ros, server, "up")
    skill = skill_of(client, accept_s=0.3)
    ros.spin_until(skill.server_is_there, what="the server")
    run = skill.start({})
    told(ros, server, "asked")
    assert ros.spin_until(run.poll).code == "timed_out"
    (tmp_path / "enough").touch()
    told(ros, server, "cancelled")
    ros.spin_until(lambda: not run.goal_open, what="the end of the goal")


def test_a_node_that_leaves_before_the_answer(ros, client, start_process, tmp_path):
    server = start_process("-c", SERVER, tmp_path / "enough")
    skill = skill_of(client)
    skill.start({})
    told(ros, server, "asked")
    client.shut_down()
    assert not client.may_leave()
    (tmp_path / "enough").touch()
    ros.spin_until(client.may_leave, what="the answer")
    told(ros, server, "cancelled")


def test_a_node_that_leaves_asks_again_when_the_server_refused_at_first(ros, client):
    from nav2_msgs.action import Spin
    from rclpy.action import CancelResponse

    from florence_bt.ros.action_server import SingleGoalServer
    from florence_bt.ros.node import FlorenceNode

    ended = []
    server = SingleGoalServer(
        ros.add(FlorenceNode("spinner")),
        Spin,
        "spin",
        on_goal=lambda goal: None,
        on_cancel=lambda: ended.append(server.finish(Spin.Result(), Outcome.CANCELLED)),
    )
    answers = [CancelResponse.REJECT]
    obey = server._cancel_asked
    server._server.register_cancel_callback(lambda goal: answers.pop() if answers else obey(goal))
    run = skill_of(client).start({})
    ros.spin_until(lambda: run.phase.value == "active", what="the acceptance")
    client.shut_down()
    ros.spin_until(client.may_leave, what="the end of the goal")
    assert not answers and ended, "it was asked once only"


@pytest.mark.parametrize("thinks_s", ["0", "0.6"])
def test_a_process_that_is_ended_during_its_run(ros, start_process, thinks_s):
    server = start_process("-c", SERVER, thinks_s)
    caller = start_process("-c", CLIENT)
    told(ros, server, "asked")
    assert caller.end(signal.SIGINT) == 0, caller.output
    told(ros, server, "cancelled")


def test_the_goal_of_a_process_that_was_killed_is_cancelled_before_anything_else(ros, client, start_process):
    from nav_msgs.msg import Odometry

    from florence_bt.app.bringup.make_safe import BaseSafety
    from florence_bt.ros.open_goals import OpenGoals

    server = start_process("-c", SERVER, "0")
    caller = start_process("-c", CLIENT)
    caller.wait_for("active")
    caller.end(signal.SIGKILL)
    odometry = client.create_publisher(Odometry, "odom", 5)
    commands = []
    from geometry_msgs.msg import Twist

    client.create_subscription(Twist, "cmd_vel", commands.append, 10)
    safety = BaseSafety(client, OpenGoals(client, ["spin", "nobody_serves_this"]), limit_s=300.0)
    run = safety.make_safe()
    moving = Odometry()
    moving.twist.twist.linear.x = 0.2

    def drive(message):
        message.header.stamp = client.get_clock().now().to_msg()
        odometry.publish(message)
        return run.poll()

    told(ros, server, "cancelled")
    for _ in range(5):
        assert drive(moving) is None, "the base is still moving"
        ros.spin_for(0.02)
    assert ros.spin_until(lambda: drive(Odometry())).succeeded
    assert commands and commands[-1].linear.x == 0.0


def test_a_base_that_tells_nothing_is_not_known_to_be_safe(ros, client):
    from florence_bt.app.bringup.make_safe import BaseSafety
    from florence_bt.ros.open_goals import OpenGoals

    goals = OpenGoals(client, ["spin"])
    result = ros.spin_until(BaseSafety(client, goals, limit_s=0.3).make_safe().poll)
    assert result.code == "timed_out" and "no odometry" in result.reason


@pytest.mark.parametrize(("asked", "outcome"), [(True, Outcome.CANCELLED), (False, Outcome.FAILED)])
def test_a_server_that_was_started_anew_during_the_run(ros, client, start_process, asked, outcome):
    server = start_process("-c", SERVER, "0")
    run = skill_of(client, cancel_s=2.0).start({})
    told(ros, server, "goal")
    ros.spin_until(lambda: run.phase.value == "active")
    server.end(signal.SIGKILL)
    killed = time.monotonic()
    start_process("-c", SERVER, "0")
    if asked:
        run.cancel()
    result = ros.spin_until(run.poll)
    assert result.outcome is outcome and result.reason
    if not asked:
        assert result.code == "server_lost"
        assert time.monotonic() - killed < 15.0, "its process tells, not the lease of 20 s"


def test_a_newer_server_does_not_stand_in_for_the_one_that_had_the_goal(ros, client, start_process):
    """Killed and started anew at once: the name is served all the time, but nobody works on the goal."""
    from nav2_msgs.action import Spin

    from florence_bt.ros.action_server import SingleGoalServer
    from florence_bt.ros.node import FlorenceNode

    def serve(name):
        node = ros.add(FlorenceNode(name))
        return SingleGoalServer(node, Spin, "spin", on_goal=lambda goal: None, on_cancel=lambda: None)

    old = serve("old")
    run = skill_of(client, lost_s=0.5).start({})
    ros.spin_until(lambda: run.phase.value == "active", what="the acceptance")
    channel = run._channel
    ros.spin_until(lambda: channel.seen_servers, what="the first look after the server")
    serve("new")
    ros.spin_until(lambda: channel.servers() == 2, what="the newer server")
    old._server.destroy()  # without an end of its goal, as when it is killed
    result = ros.spin_until(run.poll, what="the loss")
    assert result.code == "server_lost" and "went away" in result.reason
